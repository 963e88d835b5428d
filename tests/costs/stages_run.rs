//! Every stage whose cost is measured runs: its commands are the command's own.

#![allow(clippy::unwrap_used, clippy::panic)]

mod stage;

#[test]
fn every_measured_stage_runs() {
    let folder = tempfile::tempdir().unwrap();
    for stage in stage::stages() {
        println!("{}", stage.name);
        stage.prepare(folder.path());
        stage.run(folder.path());
    }
}
