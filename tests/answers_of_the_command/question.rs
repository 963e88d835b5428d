//! Questions to the command: the command lines that are run, in groups of one reference file each.

use std::path::Path;
use std::process::Command;

use crate::json::Json;
use crate::reference::ONLY_FULL;

/// A question: commands that run one after the other in one folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Question {
    /// Name of the reference file that holds the answer.
    pub(crate) group: String,
    /// Arguments of the command, one line for each run.
    pub(crate) commands: Vec<String>,
}

impl Question {
    fn new(group: &str, commands: &[String]) -> Self {
        Self {
            group: group.to_owned(),
            commands: commands.to_vec(),
        }
    }

    /// The question that an answer of the reference contains.
    pub(crate) fn of_answer(group: &str, answer: &Json) -> Self {
        let commands = match answer {
            Json::List(steps) => steps.iter().filter_map(|s| s.get("command")?.text()).collect(),
            _ => Vec::new(),
        };
        Self {
            group: group.to_owned(),
            commands: commands.into_iter().map(str::to_owned).collect(),
        }
    }
}

/// Verbs whose examples are not run, each with the reason.
const EXAMPLES_LEFT_OUT: &[(&str, &str)] = &[
    (
        "monitor",
        "prints what arrives within two seconds of real time; the number of lines depends on the load",
    ),
    (
        "upload",
        "its answer counts messages in real time; `table` compares the bytes that it sends",
    ),
    (
        "doctor",
        "its counters depend on real time, and its ports on the computer",
    ),
    (
        "completions",
        "prints a script, which `tests/completions.rs` runs in its shell",
    ),
];

/// Former names of verbs that the command still takes: name in the help, former name.
const FORMER_NAMES: [(&str, &str); 1] = [("working-point", "work")];

/// Methods of `lobes`, as arguments of the option --method.
const METHODS: [&str; 7] = [
    "collocation",
    "sdm",
    "fdm",
    "zoa",
    "nyquist",
    "multi-frequency",
    "mode-coupling",
];

/// All questions. With `full` also those that take minutes.
pub(crate) fn questions(command: &Path, tests: &Path, full: bool) -> Result<Vec<Question>, String> {
    let mut all = examples(command)?;
    all.extend(limits(tests)?);
    all.extend(recordings(tests)?);
    all.extend(tables());
    all.extend(seeded_diagnoses(tests)?);
    all.retain(|question| full || !ONLY_FULL.contains(&question.group.as_str()));
    Ok(all)
}

fn text_of(command: &Path, arguments: &[&str]) -> Result<String, String> {
    let output = Command::new(command)
        .args(arguments)
        .output()
        .map_err(|error| format!("{}: {error}", command.display()))?;
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The lines under "Example:" in the help of every verb, also with the former name of the verb.
fn examples(command: &Path) -> Result<Vec<Question>, String> {
    let help = text_of(command, &["help"])?;
    let (_, verbs) = help
        .split_once("Commands:\n")
        .ok_or("the help lists no commands")?;
    let verbs = verbs
        .lines()
        .take_while(|line| !line.is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next());
    let mut found = Vec::new();
    for verb in verbs.filter(|verb| *verb != "help") {
        if EXAMPLES_LEFT_OUT.iter().any(|(name, _)| *name == verb) {
            continue;
        }
        let help = text_of(command, &["help", verb])?;
        let (_, example) = help
            .split_once("Example:\n")
            .ok_or_else(|| format!("the help of {verb} has no example"))?;
        let lines: Vec<String> = example
            .lines()
            .filter_map(|line| line.strip_prefix("  quietcut "))
            .map(|line| {
                if line.contains("--json") {
                    line.to_owned()
                } else {
                    format!("{line} --json")
                }
            })
            .collect();
        found.push(Question::new("examples", &lines));
        for (_, former) in FORMER_NAMES.iter().filter(|(name, _)| *name == verb) {
            let renamed: Vec<String> = lines
                .iter()
                .filter_map(|line| Some(format!("{former}{}", line.strip_prefix(verb)?)))
                .collect();
            found.push(Question::new("examples", &renamed));
        }
    }
    Ok(found)
}

/// Names without ending of the files in a folder that end in `.ending`, sorted.
fn names(folder: &Path, ending: &str) -> Result<Vec<String>, String> {
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter_map(|name| name.strip_suffix(ending).map(str::to_owned))
        .collect();
    names.sort();
    Ok(names)
}

/// Options of a small grid for a case: speeds in rev/min and depths in mm.
fn ranges(case: &str) -> (&'static str, &'static str, &'static str) {
    if case.starts_with("insperger") {
        ("6000:14000:3", "0.1:4:10", "9000,1")
    } else {
        ("800:1400:3", "0.1:4:10", "1045,2")
    }
}

fn limits(tests: &Path) -> Result<Vec<Question>, String> {
    let mut found = Vec::new();
    for case in names(&tests.join("cases"), ".toml")? {
        let (speeds, depths, point) = ranges(&case);
        let mut lines: Vec<String> = METHODS
            .iter()
            .map(|method| {
                format!(
                    "lobes tests/cases/{case}.toml --rpm {speeds} --depth-mm {depths} --method {method} --no-refine --json"
                )
            })
            .collect();
        lines.push(format!("lobes tests/cases/{case}.toml --at {point} --json"));
        found.push(Question::new("limits", &lines));
    }
    Ok(found)
}

/// Path of a committed recording, as an argument of the command.
fn recording(name: &str) -> String {
    format!("tests/data/answers/recordings/{name}.csv")
}

fn recordings(tests: &Path) -> Result<Vec<Question>, String> {
    let mut found = Vec::new();
    for name in names(&tests.join("data/answers/recordings"), ".csv")? {
        if name.starts_with("cut-") && name != "cut-forces" {
            let rpm = name.split('-').nth(1).unwrap_or_default();
            let head = std::fs::read_to_string(tests.join(format!("data/answers/recordings/{name}.csv")))
                .map_err(|error| error.to_string())?;
            let has_tachometer = head.lines().next().is_some_and(|line| line.contains("tacho"));
            let speed = if has_tachometer {
                String::new()
            } else {
                format!(" --rpm {rpm}")
            };
            let line = format!("replay {}{speed} --json", recording(&name));
            found.push(Question::new("replay", &[line]));
        }
    }
    let (x, y) = (recording("hammer-x"), recording("hammer-y"));
    let (steps, forces) = (recording("steps"), recording("cut-forces"));
    let decay = recording("free-decay");
    let measured = [
        format!("frf {x} {y} --band-hz 10:30 --out frf.csv --json"),
        format!("frf {x} --band-hz 10:30 --method h2 --json"),
        format!("frf {steps} --force-n 5.8 --out frf-of-steps.csv --json"),
        "identify frf.csv --method modes --case tests/cases/kuka-kr90-acetal.toml --out modes.toml --json"
            .to_owned(),
    ];
    found.push(Question::new("frf", &measured));
    let identified = [
        format!("identify {steps} --method harmonic-balance --out found.toml --json"),
        format!("identify {steps} --method hfrf --json"),
        format!("identify {steps} --method linearity --json"),
        format!("identify {steps} --method ncma --json"),
        format!("identify {steps} --method restoring-force --json"),
        format!("identify {decay} --method restoring-force --mass-kg 50 --json"),
        format!("identify {decay} --method output-only --band-hz 10,30 --json"),
        format!("identify {decay} --method backbone --json"),
        format!("identify {} --method output-only --band-hz 10,30 --json", recording("motion-only")),
        format!("identify {forces} --method force-coefficients --out material.toml --json"),
        format!("identify {} {} --method mode-shapes --force-at tip,flange --sensor-at tip --json", recording("hammer-x"), recording("hammer-y")),
        "identify tests/data/answers/recordings/tried-cuts.csv --method inverse-stability --start tests/cases/kuka-kr90-acetal.toml --json".to_owned(),
    ];
    for line in identified {
        found.push(Question::new("identify", &[line]));
    }
    for (group, case, name) in [
        ("diagnose", "kuka-kr90-full", "sweep"),
        ("long-diagnoses", "kuka-kr90-full", "hammer-x"),
        ("long-diagnoses", "kuka-kr90-y17-low", "free-decay"),
        ("long-diagnoses", "kuka-kr90-y17-low", "steps"),
    ] {
        let line = format!(
            "diagnose tests/cases/{case}.toml {} --out diagnosis --json",
            recording(name)
        );
        found.push(Question::new(group, &[line]));
    }
    Ok(found)
}

fn tables() -> Vec<Question> {
    let case = "tests/cases/kuka-kr90-acetal.toml";
    let lines = [
        format!("table {case} --rpm 800:1400:3 --speeds 21 --out small.qct --json"),
        "table --show small.qct --json".to_owned(),
        format!("table {case} --rpm 800:1400:3 --speeds 11 --derivatives --out derivatives.qct --json"),
        "table --show derivatives.qct --json".to_owned(),
    ];
    let cells = format!("lobes {case} --rpm 800:1400:9 --depth-mm 0.5:4:6 --cells --json");
    vec![Question::new("tables", &lines), Question::new("tables", &[cells])]
}

/// Folder of the cases and recordings of the seeded diagnoses, as an argument of the command.
const SEEDED: &str = "tests/data/answers/seeded";

/// Diagnoses of the puzzles that `tests/hidden_effects` wrote: a case NAME.toml with its recordings NAME-0.csv, NAME-1.csv and so on.
fn seeded_diagnoses(tests: &Path) -> Result<Vec<Question>, String> {
    let folder = tests.join("data/answers/seeded");
    let recordings = names(&folder, ".csv")?;
    let mut found = Vec::new();
    for case in names(&folder, ".toml")? {
        if recordings.contains(&case) {
            // The sidecar of a recording.
            continue;
        }
        let mut line = format!("diagnose {SEEDED}/{case}.toml");
        let of_case = |name: &&String| name.rsplit_once('-').is_some_and(|(start, _)| start == case);
        for recording in recordings.iter().filter(of_case) {
            line += &format!(" {SEEDED}/{recording}.csv");
        }
        found.push(Question::new("seeded-diagnoses", &[line + " --json"]));
    }
    Ok(found)
}
