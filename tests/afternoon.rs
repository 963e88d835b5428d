//! An afternoon in a laboratory, from files only: taps of three tools, one of them of the wrong tool and one with a clipped
//! impact; modes, chart, five cuts, and the update. Only `quietcut next` says which command comes next.
//!
//! The virtual machines are case files that only the laboratory knows. Each is two coupled modes of 450 to 600 Hz.

#![allow(clippy::expect_used, clippy::panic)]

use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use quietcut_tests::command::{Outcome, folder, quietcut};
use serde_json::Value;

/// Stiffness matrices of the three tools in their holders, N/m: xx, xy and yy.
const TOOLS: [[f64; 3]; 3] = [
    [7.2e6, 3.0e5, 8.4e6],
    [9.5e6, 2.0e5, 11.0e6],
    [8.1e6, -2.5e5, 9.6e6],
];

/// Spindle speeds at which the limits are asked for, rev/min.
const SPEEDS_RPM: [f64; 4] = [8000.0, 9000.0, 10_000.0, 11_000.0];

/// The laboratory, which knows the true machines, and the folder `mill` of the user, who knows only files.
struct Afternoon {
    folder: tempfile::TempDir,
}

impl Afternoon {
    /// Sets up the user's folder with what one knows about a machine without measuring.
    fn new() -> Self {
        let afternoon = Self { folder: folder() };
        for (tool, [xx, xy, yy]) in TOOLS.into_iter().enumerate() {
            let text = format!(
                "[structure]\nkind = \"matrices\"\ndirections = [\"x\", \"y\"]\nmass = [[0.9, 0.0], [0.0, 0.8]]\n\
                 damping = [[150.0, 0.0], [0.0, 130.0]]\nstiffness = [[{xx:?}, {xy:?}], [{xy:?}, {yy:?}]]\n\
                 [tool]\nteeth = 4\nedge_angle_deg = 90.0\ndiameter_mm = 16.0\n\
                 [material]\nktc_mpa = 800.0\nkrc_mpa = 240.0\nkac_mpa = 0.0\n\
                 [cut]\nstart_deg = 90.0\nexit_deg = 180.0\nfeed_per_tooth_mm = 0.1\n"
            );
            fs::write(afternoon.path(&format!("true-{tool}.toml")), text).expect("written");
        }
        afternoon.run(
            "setup mill --teeth 4 --diameter-mm 16 --ktc-mpa 800 --krc-mpa 240 --down-milling-mm 8 --feed-per-tooth-mm 0.1 \
             --rpm 7500:11500",
        );
        afternoon
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self, line: &str) -> Outcome {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        let outcome = quietcut(self.folder.path(), &arguments);
        assert_eq!(outcome.status, Some(0), "{line}: {outcome:?}");
        outcome
    }

    /// Taps a tool in x and y, and saves the files of the analyzer in the folder of taps. `clipped` is the range of the
    /// hammer's charge amplifier, as a share of the hardest impact.
    fn tap(&self, tool: usize, style: Style, clipped: Option<f64>) {
        for (axis, seed) in [("x", 2 * tool + 5), ("y", 2 * tool + 6)] {
            // Noise of 0.02 N and 3 m/s² over a band of 20 kHz: that of an ordinary accelerometer of 500 g.
            self.run(&format!(
                "simulate true-{tool}.toml --experiment hammer --direction {axis} --force-n 300 --sample-rate-hz 40960 --pulse-ms 1 \
                 --spacing-s 0.8 --impacts 6 --measure acceleration --noise f{axis}=0.02 --noise ax=3 --noise ay=3 --seed {seed} \
                 --out raw.csv"
            ));
            let raw = fs::read_to_string(self.path("raw.csv")).expect("a recording");
            let file = style.file(axis, &analyzer(&raw, clipped));
            fs::write(self.path(&format!("mill/taps/{axis}.csv")), file).expect("written");
            // Without a word about the filter, content above half the sample rate might have folded: wider intervals.
            let sections: Vec<String> = style
                .columns(axis)
                .iter()
                .map(|column| format!("[channels.\"{column}\"]\nanti_aliasing = true\n"))
                .collect();
            fs::write(self.path(&format!("mill/taps/{axis}.toml")), sections.concat()).expect("written");
        }
    }

    /// Makes a cut of the tool and saves its recording.
    fn cut(&self, tool: usize, number: usize, rpm: f64, depth_mm: f64) {
        self.run(&format!(
            "simulate true-{tool}.toml --rpm {rpm} --depth-mm {depth_mm} --seconds 2 --ideal --sample-rate-hz 26667 \
             --measure acceleration --no-force --noise-percent 1 --seed {number} --out mill/cuts/{number}.csv"
        ));
    }

    /// The next step that the command proposes.
    fn next(&self) -> Value {
        // The file system must see that what follows is newer.
        std::thread::sleep(Duration::from_millis(20));
        self.run("next mill --json").json()
    }

    /// Runs the command that `next` proposes, which must be the verb `verb`, and returns its outcome.
    fn follow(&self, verb: &str) -> Outcome {
        let step = self.next();
        let command = step["command"].as_str().expect("a command");
        let words = command.strip_prefix("quietcut ").expect("a command of quietcut");
        assert_eq!(words.split_whitespace().next(), Some(verb), "{step}");
        self.run(words)
    }

    /// Asserts that the 90 % intervals of the user's limits hold the true limits of a tool at all speeds asked for.
    fn limits_hold_those_of(&self, tool: usize) {
        for rpm in SPEEDS_RPM {
            let line = |case: &str| {
                self.run(&format!("lobes {case} --rpm {rpm} --depth-mm 16 --json"))
                    .json()
            };
            let truth = line(&format!("true-{tool}.toml"))["speeds"][0]["first_limit"]["depth_mm"]
                .as_f64()
                .expect("a limit");
            let own = line("mill/case.toml");
            let percentiles = &own["speeds"][0]["limit_percentiles_mm"];
            let [low, high] = ["5", "95"].map(|share| percentiles[share].as_f64().expect("a percentile"));
            println!("tool {tool}, {rpm} rev/min: {low:.4} to {high:.4} mm, true {truth:.4} mm");
            // An interval of 90 % misses one limit of ten. Here it is widened by half of its width at both ends: 90 % become
            // 99.9 % of a normal distribution, so that none of twelve may miss.
            let wider = 0.5 * (high - low);
            assert!(
                (low - wider..=high + wider).contains(&truth),
                "tool {tool}, {rpm} rev/min: {low} to {high} for {truth}"
            );
            assert!(high - low < 0.1 * truth, "{low} to {high} says little");
        }
    }
}

/// Time in s, force in N, and accelerations in x and y in m/s², as they leave an analyzer: through an anti-aliasing filter, at
/// a quarter of the rate. The force is clipped at the share `clipped` of its largest sample.
fn analyzer(raw: &str, clipped: Option<f64>) -> Vec<[f64; 4]> {
    let rows: Vec<[f64; 4]> = raw
        .lines()
        .skip(1)
        .map(|line| {
            let mut numbers = line.split(',').map(|number| number.parse().expect("a number"));
            std::array::from_fn(|_| numbers.next().expect("four columns"))
        })
        .collect();
    // Windowed sinc (Hamming) with the edge at 0.8 of half the new rate.
    const EACH: usize = 4;
    const HALF: usize = 64;
    let weight = |k: f64| {
        let edge = 0.4 / EACH as f64;
        let sinc = if k == 0.0 {
            1.0
        } else {
            (TAU * edge * k).sin() / (TAU * edge * k)
        };
        2.0 * edge * sinc * (0.54 + 0.46 * (TAU * k / (2 * HALF) as f64).cos())
    };
    let weights: Vec<f64> = (0..=2 * HALF).map(|k| weight(k as f64 - HALF as f64)).collect();
    let sum: f64 = weights.iter().sum();
    let mut file: Vec<[f64; 4]> = (0..rows.len())
        .step_by(EACH)
        .map(|at| {
            let filtered = |column: usize| -> f64 {
                let taps = weights.iter().enumerate().filter_map(|(k, weight)| {
                    let row = rows.get((at + k).checked_sub(HALF)?)?;
                    Some(weight * row[column])
                });
                taps.sum::<f64>() / sum
            };
            [rows[at][0], filtered(1), filtered(2), filtered(3)]
        })
        .collect();
    if let Some(share) = clipped {
        let range_n = share * file.iter().fold(0.0_f64, |most, row| most.max(row[1]));
        for row in &mut file {
            row[1] = row[1].min(range_n);
        }
    }
    file
}

/// The forms in which the files of three laboratories come.
#[derive(Clone, Copy)]
enum Style {
    /// Semicolons, decimal commas, German words, g.
    German,
    /// Tabs, units in parentheses, kN.
    Tabs,
    /// A remark, names with signs, and a row of units.
    UnitRow,
}

impl Style {
    /// Names of force and accelerations in the file.
    fn columns(self, axis: &str) -> [String; 3] {
        let upper = axis.to_uppercase();
        match self {
            Self::German => [format!("Hammer {upper}"), "Acc X".into(), "Acc Y".into()],
            Self::Tabs => [
                format!("Force {axis}"),
                "Acceleration x".into(),
                "Acceleration y".into(),
            ],
            Self::UnitRow => [
                format!("Hammer {axis}+"),
                "Accelerometer x+".into(),
                "Accelerometer y+".into(),
            ],
        }
    }

    fn file(self, axis: &str, rows: &[[f64; 4]]) -> String {
        let [hammer, x, y] = self.columns(axis);
        let mut text = match self {
            Self::German => format!("Zeit [s];{hammer} [N];{x} [g];{y} [g]\n"),
            Self::Tabs => format!("Time (s)\t{hammer} (kN)\t{x} (m/s²)\t{y} (m/s²)\n"),
            Self::UnitRow => format!("# Modal test\nt,{hammer},{x},{y}\ns,N,m/s^2,m/s^2\n"),
        };
        for [t, force, ax, ay] in rows {
            let _ = match self {
                Self::German => {
                    let [ax, ay] = [ax, ay].map(|a| a / 9.80665);
                    let row = format!("{t:.7};{force:.4};{ax:.6};{ay:.6}").replace('.', ",");
                    writeln!(text, "{row}")
                }
                Self::Tabs => writeln!(text, "{t:.7}\t{:.7}\t{ax:.5}\t{ay:.5}", force / 1e3),
                Self::UnitRow => writeln!(text, "{t:.7},{force:.4},{ax:.5},{ay:.5}"),
            };
        }
        text
    }
}

#[test]
fn a_tool_from_taps_to_cuts_that_agree() {
    let afternoon = Afternoon::new();
    let step = afternoon.next();
    assert!(step["why"].to_string().contains("no taps yet"), "{step}");
    afternoon.tap(0, Style::German, None);
    let frf = afternoon.follow("frf");
    assert!(!frf.stderr.contains("inverted"), "{frf:?}");
    // The peak is the resonance and not the noise of the accelerometer at the first lines.
    assert!(
        frf.stdout.contains("Hxx: ") && frf.stdout.contains("at 44"),
        "{frf:?}"
    );
    for verb in ["identify", "lobes", "table", "plan"] {
        afternoon.follow(verb);
    }
    afternoon.limits_hold_those_of(0);
    // Five cuts. The true limits are 3.92 mm at 8000, 2.44 at 9000, 2.79 at 10 000 and 3.20 mm at 11 000 rev/min.
    let cuts = [
        (8000.0, 2.5),
        (9000.0, 1.5),
        (9000.0, 4.5),
        (10_000.0, 1.8),
        (11_000.0, 5.0),
    ];
    for (number, (rpm, depth_mm)) in cuts.into_iter().enumerate() {
        afternoon.cut(0, number, rpm, depth_mm);
    }
    for _ in cuts {
        afternoon.follow("replay");
    }
    let tried = fs::read_to_string(afternoon.path("mill/tried.csv")).expect("the table of tried cuts");
    let outcomes: Vec<&str> = tried
        .lines()
        .skip(1)
        .filter_map(|line| line.split(',').nth(2))
        .collect();
    assert_eq!(
        outcomes,
        ["stable", "stable", "chatter", "stable", "chatter"],
        "{tried}"
    );
    let chart = afternoon.follow("lobes");
    assert!(
        chart.stdout.contains("0 of 5 trial cuts are predicted wrong"),
        "{chart:?}"
    );
    // A diagnosis of five cuts takes minutes; it is the next step because nothing contradicts the chart.
    let step = afternoon.next();
    assert!(step["command"].to_string().contains("diagnose"), "{step}");
}

#[test]
fn taps_of_another_tool_are_noticed_from_the_cuts() {
    let afternoon = Afternoon::new();
    // The tool in the spindle is tool 1; the taps are those of tool 0.
    afternoon.tap(0, Style::UnitRow, None);
    for verb in ["frf", "identify", "lobes", "table", "plan"] {
        afternoon.follow(verb);
    }
    // The true limits of tool 1 are 10.68 mm at 8000 and 5.43 mm at 9000 rev/min, those of tool 0 3.92 and 2.44 mm.
    let head = "rpm [rev/min],depth [mm],outcome\n";
    let cuts = "8000,5,stable\n9000,4,stable\n10000,1.5,stable\n11000,1.5,stable\n11000,6,chatter\n";
    fs::write(afternoon.path("mill/tried.csv"), format!("{head}{cuts}")).expect("written");
    let chart = afternoon.follow("lobes");
    assert!(
        chart.stdout.contains("2 of 5 trial cuts are predicted wrong"),
        "{chart:?}"
    );
    let step = afternoon.next();
    let why = step["why"].as_str().expect("a reason");
    for words in [
        "2 of 5 tried cuts contradict",
        "another tool",
        "8000 rev/min, 5.00 mm: stable",
    ] {
        assert!(why.contains(words), "{words}: {step}");
    }
    assert!(
        step["command"].to_string().contains("frf mill/taps/x.csv"),
        "{step}"
    );
    // The right tool is tapped, and the command of the step is run.
    afternoon.tap(1, Style::UnitRow, None);
    for verb in ["frf", "identify", "lobes", "table"] {
        afternoon.follow(verb);
    }
    afternoon.limits_hold_those_of(1);
    let step = afternoon.next();
    assert!(!step["why"].to_string().contains("contradict"), "{step}");
}

#[test]
fn a_clipped_impact_is_left_out_with_the_reason() {
    let afternoon = Afternoon::new();
    // At this range of the amplifier two impacts in y are whole. Without coherence, noise at the first lines is no peak that
    // folding changes.
    afternoon.tap(2, Style::Tabs, Some(0.87));
    let frf = afternoon.run("frf mill/taps/y.csv");
    assert!(frf.stderr.contains("2 impacts: there is no coherence"), "{frf:?}");
    afternoon.tap(2, Style::Tabs, Some(0.9));
    let frf = afternoon.follow("frf");
    assert!(
        frf.stderr.contains("impacts with clipped samples are left out"),
        "{frf:?}"
    );
    afternoon.follow("identify");
    afternoon.limits_hold_those_of(2);
}
