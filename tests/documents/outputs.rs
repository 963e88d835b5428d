//! Outputs of the command for people equal the snapshots in `tests/snapshots`, with their numbers masked.
//!
//! Masked are numbers with a fraction, with an exponent, or of three digits and more, which may differ between machines and after changes
//! of numerics: `tests/answers` compares numbers. Bars of the overview of a channel are masked too.

use std::fmt::Write;
use std::path::Path;

use quietcut_tests::command::{cases, folder, quietcut};
use quietcut_tests::documents::assert_generated;

/// The snapshots: the name of each, and its commands. Their files come from the commands before them.
const OUTPUTS: [(&str, &[&str]); 9] = [
    (
        "lobes",
        &[
            "lobes case.toml --at 1045,2",
            "lobes case.toml --rpm 900:1000:2 --depth-mm 0.1:3:10",
        ],
    ),
    (
        "bifurcation",
        &[
            "bifurcation case.toml --vary depth --range 0:4 --fix rpm=1045",
            "bifurcation case.toml --vary depth --range 0:3 --fix rpm=1200 --curve torus --in rpm,depth --range 1190:1210 --out curve.svg",
        ],
    ),
    (
        "table",
        &[
            "table case.toml --rpm 900:1000:2 --out case.qct",
            "table --show case.qct",
        ],
    ),
    (
        "recordings",
        &[
            "simulate case.toml --rpm 900 --depth-mm 1 --seconds 3 --out cut.csv",
            "look cut.csv",
            "replay cut.csv --table case.qct",
            "identify cut.csv --method force-coefficients --out material.toml",
        ],
    ),
    (
        "frf",
        &[
            "simulate case.toml --experiment hammer --force-n 300 --sample-rate-hz 512 --impacts 3 --out tap.csv",
            "frf tap.csv --band-hz 10:30 --out frf.csv",
        ],
    ),
    (
        "plan",
        &["plan case.toml --rpm 900:1000:2 --depth-mm 0:6:20 --width-percent 40"],
    ),
    (
        "diagnose",
        &[
            "simulate case.toml --rpm 900 --depth-mm 1 --seconds 6 --sample-rate-hz 500 --ideal --measure displacement --noise-percent 1 --effect runout=15 --out runout.csv",
            "diagnose case.toml runout.csv",
        ],
    ),
    (
        "setup",
        &[
            "setup mill --teeth 2 --diameter-mm 12.7 --ktc-mpa 119 --krc-mpa 20.2 --kac-mpa 39.3 --down-milling-mm 6.35 --feed-per-tooth-mm 0.15 --rpm 600:2400",
            "next mill",
        ],
    ),
    ("demo", &["demo --out demo"]),
];

/// The text with masked numbers and bars. Spaces that align columns are joined to one, those at the start of a line stay.
pub(crate) fn masked(text: &str) -> String {
    let mut lines = String::new();
    for line in text.lines() {
        let indent = line.len() - line.trim_start().len();
        let words: Vec<_> = line[indent..]
            .split(' ')
            .filter(|word| !word.is_empty())
            .collect();
        let mut rest = words.join(" ");
        // Right-aligned columns begin with numbers of several widths.
        let indent = if rest.starts_with(|c: char| c.is_ascii_digit()) {
            0
        } else {
            indent
        };
        lines += &line[..indent.min(12)];
        while let Some(first) = rest.chars().next() {
            let length = number_length(&rest, lines.chars().last());
            let bars = rest.chars().take_while(|c| ('▁'..='█').contains(c)).count();
            let taken = if length > 0 {
                lines.push('#');
                length
            } else if bars > 0 {
                lines.push('▁');
                bars * '▁'.len_utf8()
            } else {
                lines.push(first);
                first.len_utf8()
            };
            rest.drain(..taken);
        }
        lines.truncate(lines.trim_end().len());
        lines.push('\n');
    }
    lines
}

/// Number of bytes of the number to be masked at the start of `text`, with its sign; 0 if there is none. `before` is the character before.
fn number_length(text: &str, before: Option<char>) -> usize {
    let is_free = before.is_none_or(|c| !c.is_alphanumeric() && !['_', '-', '#'].contains(&c));
    let unsigned = text.strip_prefix('-').filter(|_| is_free).unwrap_or(text);
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let whole = digits(unsigned);
    // A word such as "kr90" or a CRC is no number by itself.
    if whole == 0 || before.is_some_and(|c| c.is_alphanumeric() || c == '_') {
        return 0;
    }
    let mut end = whole;
    let mut is_masked = whole >= 3;
    while unsigned[end..].starts_with('.') && digits(&unsigned[end + 1..]) > 0 {
        end += 1 + digits(&unsigned[end + 1..]);
        is_masked = true;
    }
    if let Some(exponent) = unsigned[end..].strip_prefix('e') {
        let of_exponent = digits(exponent.strip_prefix('-').unwrap_or(exponent));
        if of_exponent > 0 {
            end += 1 + usize::from(exponent.starts_with('-')) + of_exponent;
            is_masked = true;
        }
    }
    if is_masked {
        end + text.len() - unsigned.len()
    } else {
        0
    }
}

/// The words that differ between runs: the port of the simulated device, the check sum of a table, and the time that a command took.
fn without_run(line: &str) -> String {
    let mut line = line.to_owned();
    for (opening, ends) in [("/dev/pts/", " ,"), ("CRC ", ","), ("tooth pass ", ")")] {
        if let Some(at) = line.find(opening) {
            let from = at + opening.len();
            let to = line[from..]
                .find(|c| ends.contains(c))
                .map_or(line.len(), |length| from + length);
            line.replace_range(from..to, "#");
        }
    }
    if let Some(at) = line.find(" s in all)") {
        let from = line[..at].rfind('(').map_or(at, |open| open + 1);
        line.replace_range(from..at, "#");
    }
    line
}

fn run(folder: &Path, command: &str) -> String {
    let arguments: Vec<_> = command.split(' ').collect();
    let outcome = quietcut(folder, &arguments);
    assert_eq!(outcome.status, Some(0), "{command}: {outcome:?}");
    let said = format!("{}{}", outcome.stdout, outcome.stderr);
    let said: String = said.lines().map(|line| without_run(line) + "\n").collect();
    format!("$ quietcut {command}\n{}", masked(&said))
}

#[test]
fn outputs_for_people_are_as_reviewed() {
    let folder = folder();
    std::fs::copy(
        cases().join("kuka-kr90-acetal.toml"),
        folder.path().join("case.toml"),
    )
    .expect("a case");
    for (name, commands) in OUTPUTS {
        let mut text = String::new();
        for command in commands {
            writeln!(text, "{}", run(folder.path(), command)).expect("a string grows");
        }
        assert!(!text.contains("/tmp"), "{text}");
        assert_generated(&format!("tests/snapshots/output-{name}.txt"), None, &text);
    }
}

#[test]
fn numbers_are_masked_and_words_stay() {
    let text = "kuka-kr90: 2 teeth, 3504 bytes, -1.500 N\n  1045.0  x 1.961+0.633i (±0.001), 3.9e-1 to 1e5\n    ▃▃▄█ 5 % of 12\n";
    let wanted = "kuka-kr90: 2 teeth, # bytes, # N\n# x #+#i (±#), # to #\n    ▁ 5 % of 12\n";
    assert_eq!(masked(text), wanted);
    assert_eq!(
        without_run("at /dev/pts/12, CRC 4b49, 7 bytes"),
        "at /dev/pts/#, CRC #, 7 bytes"
    );
    assert_eq!(without_run("report (11 s in all)"), "report (# s in all)");
}
