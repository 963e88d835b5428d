//! The commands of the guide from tap test to stable cut run and print the outputs of the page.
#![allow(clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::Path;
use std::process::Command;

use quietcut_tests::command::binary;
use quietcut_tests::documents::{Block, blocks, root, run};

#[test]
fn the_guide_leads_to_a_stable_cut() {
    let (folder, printed) = run("host/GUIDE.md");
    let said = |part: &str| {
        let (_, stdout) = printed
            .iter()
            .find(|(command, _)| command.contains(part))
            .unwrap_or_else(|| panic!("no command with {part}"));
        stdout.as_str()
    };
    assert!(said("--method modes").contains("mode at 16.9"));
    let points = said("--at 1045,2");
    assert!(points.contains("1045 rev/min, 2 mm: unstable"), "{points}");
    assert!(points.contains("1380 rev/min, 2 mm: stable"), "{points}");
    let chatter = said("replay cut.csv");
    assert!(
        chatter.contains("CHATTER at 17.4 Hz") && chatter.contains("go to 138"),
        "{chatter}"
    );
    let advised = said("replay advised.csv");
    assert!(!advised.contains("CHATTER"), "{advised}");
    let diagnosis = said("diagnose tests/cases/kuka-kr90-acetal.toml");
    assert!(
        diagnosis.contains("runout_um = 15.0") || diagnosis.contains("runout_um = 14.99"),
        "{diagnosis}"
    );
    assert!(said("diagnose tests/cases/kuka-kr90-full.toml").contains("cubic-stiffness"));
    // The limits of the robot in the pocket, without and with cubic terms, and the share of cubic damping that a cut needs.
    assert!(said("lobes tests/cases/kuka-kr90-half.toml").contains("6.98"));
    assert!(said("lobes tests/cases/kuka-kr90-half-cubic.toml").contains("12.46"));
    let branch = said("--strobe");
    assert!(
        branch.contains("12.46") && branch.contains("first loss of stability"),
        "{branch}"
    );
    let stiffness = said("--vary kappa");
    assert!(stiffness.contains("0 bifurcations"), "{stiffness}");
    let damping = said("--vary nu");
    assert!(
        damping.contains("0.5979") && damping.contains("stable again"),
        "{damping}"
    );
    assert!(said("--curve torus").contains("torus curve:"));
    // The bistable zone of the hardening spring: from the fold of the doubled vibration to the limit.
    let doubled = said("--doubled");
    assert!(
        doubled.contains("bistable (depth_mm): 1.3169–1.5858"),
        "{doubled}"
    );
    assert!(said("lobes tests/cases/hardening-flip.toml").contains("bistable 1.317–1.586"));

    let drawn = fs::read_to_string(folder.path().join("host/pictures/lobes.svg")).expect("a picture");
    let kept = fs::read_to_string(root().join("host/pictures/lobes.svg")).expect("the picture of the README");
    assert_same_picture(&drawn, &kept);
    run_examples(folder.path());
}

/// Runs the example programs with the command lines of the page, in a folder with the files of the page.
fn run_examples(folder: &Path) {
    let records = folder.join("records");
    fs::create_dir(&records).expect("a folder can be made");
    for name in ["runout.csv", "runout.toml"] {
        fs::copy(folder.join(name), records.join(name)).expect("the page wrote a recording");
    }
    let mut printed = String::new();
    for block in blocks("host/GUIDE.md") {
        let Block::Commands { commands, .. } = block else {
            continue;
        };
        for (line, command) in commands {
            let Some(words) = command.strip_prefix("cargo run --release -p quietcut --example ") else {
                continue;
            };
            let mut words = words.split_whitespace().filter(|word| *word != "--");
            let name = words.next().expect("the name of an example");
            let program = binary().with_file_name("examples").join(name);
            let output = Command::new(&program)
                .args(words)
                .current_dir(folder)
                .output()
                .unwrap_or_else(|error| panic!("{error}: cargo build --release -p quietcut --examples"));
            assert!(output.status.success(), "{line}: {command}: {output:?}");
            printed += &String::from_utf8_lossy(&output.stdout);
        }
    }
    for said in [
        "1045 rev/min, 2 mm: |Floquet multiplier|",
        "Hyy: ",
        "1 recordings: Cause",
        "with firmware",
    ] {
        assert!(printed.contains(said), "{said}: {printed}");
    }
}

/// Asserts that two pictures have the same words in the same order, and numbers that differ by at most one hundredth of a point.
fn assert_same_picture(drawn: &str, kept: &str) {
    let words = |text: &str| -> Vec<String> {
        text.split(|c: char| c.is_whitespace() || ['"', ',', '<', '>', '/'].contains(&c))
            .filter(|word| !word.is_empty())
            .map(str::to_owned)
            .collect()
    };
    let (drawn, kept) = (words(drawn), words(kept));
    assert_eq!(
        drawn.len(),
        kept.len(),
        "host/pictures/lobes.svg is not what its command draws"
    );
    for (drawn, kept) in drawn.iter().zip(&kept) {
        let same = match (drawn.parse::<f64>(), kept.parse::<f64>()) {
            (Ok(drawn), Ok(kept)) => (drawn - kept).abs() <= 0.01,
            _ => drawn == kept,
        };
        assert!(
            same,
            "host/pictures/lobes.svg: {kept} where its command draws {drawn}"
        );
    }
}
