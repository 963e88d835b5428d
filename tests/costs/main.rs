//! The processor time of the command's main stages, as ratios to a fixed loop on the same core.
//!
//! ```text
//! cargo build --release -p quietcut && cargo bench -p quietcut-tests --bench costs                 # prints the ratios, and what has become slower by more than 10 %
//! cargo bench -p quietcut-tests --bench costs -- --record     # writes them to tests/data/costs.json
//! ```
//!
//! Each stage is a run of the command on one thread. Its cost is the smallest user time of several runs, divided by the user
//! time of the fixed loop, which runs between them: a busy machine or another clock rate changes both. Ratios of other
//! processors and compilers differ. The file names the compiler and the commit.

#![allow(clippy::unwrap_used, clippy::panic)]

mod clock;
mod stage;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};

use crate::clock::{fixed_loop_s, user_time_of};
use crate::stage::{Stage, stages};

/// Number of runs of each stage. The smallest time of five runs varies by less than 3 % on a machine with other work.
const ROUNDS: usize = 5;

/// Ratio of a cost to the recorded one above which the stage is reported as slower: about three times that variation.
const SLOWER: f64 = 1.10;

/// Recorded costs of all stages.
#[derive(Serialize, Deserialize)]
struct Costs {
    /// The commit that was measured.
    commit: String,
    /// The compiler that built the command.
    compiler: String,
    /// Processor time of each stage, divided by that of the fixed loop.
    ratios: BTreeMap<String, f64>,
}

fn main() {
    let record = std::env::args().any(|argument| argument == "--record");
    let folder = tempfile::tempdir().unwrap();
    let all = stages();
    for stage in &all {
        stage.prepare(folder.path());
    }
    let measured = Costs {
        commit: said(Command::new("git").args(["rev-parse", "--short", "HEAD"])),
        compiler: said(Command::new("rustc").arg("--version")),
        ratios: ratios(&all, folder.path()),
    };
    let file = file();
    let before = std::fs::read_to_string(&file)
        .ok()
        .map(|text| serde_json::from_str::<Costs>(&text).unwrap());
    print(&measured, before.as_ref());
    if record {
        std::fs::write(&file, serde_json::to_string_pretty(&measured).unwrap() + "\n").unwrap();
        println!("written to {}", file.display());
    }
}

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/costs.json")
}

/// The first line of the standard output of a command.
fn said(command: &mut Command) -> String {
    let output = command.output().unwrap();
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .next()
        .unwrap_or_default()
        .to_owned()
}

fn ratios(all: &[Stage], folder: &Path) -> BTreeMap<String, f64> {
    let mut least = vec![f64::INFINITY; all.len()];
    let mut least_loop = f64::INFINITY;
    for round in 1..=ROUNDS {
        for (stage, least) in all.iter().zip(&mut least) {
            least_loop = least_loop.min(fixed_loop_s());
            *least = least.min(user_time_of(|| stage.run(folder)));
        }
        eprintln!("round {round} of {ROUNDS}");
    }
    println!("fixed loop: {:.1} ms", 1e3 * least_loop);
    all.iter()
        .zip(least)
        .map(|(stage, least)| (stage.name.to_owned(), least / least_loop))
        .collect()
}

fn print(measured: &Costs, before: Option<&Costs>) {
    println!("{}, {}", measured.commit, measured.compiler);
    let mut slower = Vec::new();
    for (name, ratio) in &measured.ratios {
        match before.and_then(|costs| costs.ratios.get(name)) {
            Some(then) => {
                println!(
                    "{name:24} {ratio:8.2}   then {then:8.2}   {:+5.1} %",
                    100.0 * (ratio / then - 1.0)
                );
                if *ratio > SLOWER * then {
                    slower.push(name.as_str());
                }
            }
            None => println!("{name:24} {ratio:8.2}"),
        }
    }
    if let Some(before) = before {
        let since = format!("since {} ({})", before.commit, before.compiler);
        if slower.is_empty() {
            println!("nothing is slower by more than 10 % {since}");
        } else {
            println!("SLOWER by more than 10 % {since}: {}", slower.join(", "));
        }
    }
}
