//! `doctor` beside devices that are right, missing, in use and without a table, and beside the folder of a machine.
#![allow(clippy::unwrap_used)]

use quietcut::device::port::SerialLine;
use quietcut_tests::command::{cases, done, folder, quietcut};
use quietcut_tests::monitor_page::Machine;
use serde_json::Value;

/// State of the findings about a subject, those of the ports included.
fn state(answer: &Value, subject: &str) -> Vec<String> {
    let ports = answer["ports"].as_array().unwrap().iter();
    ports
        .flat_map(|port| port["findings"].as_array().unwrap())
        .chain(answer["findings"].as_array().unwrap())
        .filter(|finding| finding["subject"] == subject)
        .map(|finding| {
            assert_eq!(
                finding["to_do"].is_null(),
                finding["state"] == "good",
                "{finding}"
            );
            finding["state"].as_str().unwrap().into()
        })
        .collect()
}

#[test]
fn a_missing_device_is_a_finding_with_what_to_check() {
    let folder = folder();
    let outcome = done(folder.path(), "doctor /dev/no-such-port");
    assert!(
        outcome.stdout.contains("PROBLEM") && outcome.stdout.contains("cable"),
        "{outcome:?}"
    );
    // Whatever ports this computer has, the command ends well.
    let answer = quietcut(folder.path(), &["doctor", "--json"]).json();
    assert!(answer["problems"].is_u64(), "{answer}");
    quietcut(folder.path(), &["doctor", "simulated", "--machine", "nowhere"]).refused(&["nowhere", "setup"]);
}

#[test]
fn a_port_in_use_is_blamed_on_its_holder() {
    let machine = Machine::start();
    let _holder = SerialLine::open(machine.path()).unwrap();
    let text = done(folder().path(), &format!("doctor {}", machine.path())).stdout;
    assert!(
        text.contains(&format!("(process {})", std::process::id())),
        "{text}"
    );
}

#[test]
fn the_table_of_the_device_is_compared_with_that_of_the_machine() {
    let folder = folder();
    let mill = folder.path().join("mill");
    std::fs::create_dir(&mill).unwrap();
    std::fs::copy(cases().join("kuka-kr90-acetal.toml"), mill.join("case.toml")).unwrap();
    let doctor = || {
        let line = "doctor simulated --state device.bin --machine mill --json";
        done(folder.path(), line).json()
    };
    let without = doctor();
    assert_eq!(state(&without, "firmware"), ["good"]);
    assert_eq!(state(&without, "table"), ["note"]);
    assert_eq!(state(&without, "table file"), ["note"]);
    done(
        folder.path(),
        "table mill/case.toml --rpm 900:1000:2 --out mill/table.qct",
    );
    assert_eq!(state(&doctor(), "machine"), ["problem"]);
    done(
        folder.path(),
        "upload simulated mill/table.qct --state device.bin",
    );
    let same = doctor();
    assert_eq!(state(&same, "machine"), ["good"], "{same}");
    assert_eq!(state(&same, "table age"), ["good"]);
    assert_eq!(state(&same, "working point"), ["note"]);
    done(
        folder.path(),
        "table mill/case.toml --rpm 900:1100:2 --out mill/table.qct",
    );
    assert_eq!(state(&doctor(), "machine"), ["problem"]);
    std::fs::copy(cases().join("kuka-kr90-acetal.toml"), mill.join("case.toml")).unwrap();
    let text = done(
        folder.path(),
        "doctor simulated --state device.bin --machine mill",
    )
    .stdout;
    assert!(
        text.contains("case.toml is newer") && text.contains("problems found"),
        "{text}"
    );
}
