//! The example programs in `host/examples` run and print correct results.
#![allow(clippy::expect_used, clippy::panic, dead_code, missing_docs, unreachable_pub)]

use std::time::Duration;

use quietcut_tests::command::{cases, folder, quietcut};

#[path = "../host/examples/diagnose_a_folder.rs"]
mod diagnose_a_folder;
#[path = "../host/examples/frf_of_a_hammer_test.rs"]
mod frf_of_a_hammer_test;
#[path = "../host/examples/lobes_of_a_case.rs"]
mod lobes_of_a_case;
#[path = "../host/examples/read_the_device.rs"]
mod read_the_device;

#[test]
fn lobes_of_a_case() {
    let text = lobes_of_a_case::limits(&cases().join("kuka-kr90-acetal.toml")).expect("limits");
    assert!(
        text.contains("1058 rev/min: stable up to 1.484 mm, then Flip at 17.63 Hz"),
        "{text}"
    );
    assert!(
        text.contains("1045 rev/min, 2 mm: |Floquet multiplier| = 1."),
        "{text}"
    );
}

#[test]
fn frf_of_a_hammer_test() {
    let folder = folder();
    let case = cases().join("kuka-kr90-acetal.toml");
    let case = case.to_str().expect("a path in UTF-8");
    let line = "--experiment hammer --direction y --force-n 300 --sample-rate-hz 512 --noise-percent 1 --out tap.csv";
    let arguments: Vec<_> = ["simulate", case].into_iter().chain(line.split(' ')).collect();
    assert_eq!(quietcut(folder.path(), &arguments).status, Some(0));
    let text = frf_of_a_hammer_test::peaks(&[folder.path().join("tap.csv")]).expect("receptances");
    let peak = text
        .lines()
        .find(|line| line.starts_with("Hyy: 15."))
        .unwrap_or_else(|| panic!("{text}"));
    assert!(peak.contains("µm/N at 16.9"), "{text}");
}

#[test]
fn diagnose_a_folder() {
    let folder = folder();
    let case = cases().join("kuka-kr90-acetal.toml");
    let case = case.to_str().expect("a path in UTF-8");
    let line = "--rpm 900 --depth-mm 1 --seconds 6 --sample-rate-hz 1000 --ideal --noise-percent 1 --effect runout=15 --out cut.csv";
    let arguments: Vec<_> = ["simulate", case].into_iter().chain(line.split(' ')).collect();
    assert_eq!(quietcut(folder.path(), &arguments).status, Some(0));
    let text = diagnose_a_folder::causes(case.as_ref(), folder.path()).expect("a diagnosis");
    assert!(
        text.contains("1 recordings: Cause") && text.contains("  runout (confidence"),
        "{text}"
    );
}

#[test]
fn read_the_device() {
    let text = read_the_device::reports("simulated", Duration::from_millis(300)).expect("reports");
    assert!(text.contains("with firmware"), "{text}");
}
