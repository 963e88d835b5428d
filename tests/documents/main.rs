//! The project's pages are correct: their commands run, their links and paths exist.
#![allow(clippy::expect_used, clippy::panic)]

mod case_keys;
mod faults;
mod generated;
mod outputs;
mod snapshots;

use quietcut_tests::documents::{Block, Handling, PAGES, blocks, dead_ends, missing, root, run};

#[test]
fn links_and_paths_lead_somewhere() {
    let dead: Vec<_> = PAGES.iter().flat_map(|page| dead_ends(page)).collect();
    assert!(dead.is_empty(), "{dead:#?}");
}

/// The commands of all pages run, except those of the guide, which has its own test of the output.
#[test]
fn commands_run() {
    for page in PAGES.iter().filter(|page| **page != "host/GUIDE.md") {
        run(page);
    }
}

#[test]
fn commands_that_no_test_runs_name_what_exists() {
    let mut wrong = Vec::new();
    for page in PAGES {
        for block in blocks(page) {
            let Block::Commands { handling, commands } = block else {
                continue;
            };
            if handling == Handling::Run {
                continue;
            }
            for (line, command) in commands {
                let missing = missing(handling, &command);
                wrong.extend(missing.iter().map(|what| format!("{page}:{line}: {what}")));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn filters_of_campaigns_select_tests_of_their_target() {
    let missing_of = |command: &str| missing(Handling::Campaign, command);
    let right =
        "cargo test --release -p quietcut-identify --lib -- --ignored --nocapture coverage_of_output_only";
    assert!(missing_of(right).is_empty());
    for wrong in [
        right.replace("identify", "stability"),
        right.replace("--ignored ", ""),
        right.replace("output_only", "outputs_only"),
        "cargo test --release -p quietcut-tests --test detector_rates -- --ignored coverage_of_output_only"
            .into(),
        "cargo test --release -p quietcut-stability --lib coverage_of_output_only -- --ignored".into(),
    ] {
        assert_eq!(missing_of(&wrong).len(), 1, "{wrong}");
    }
}

#[test]
fn every_page_is_followed() {
    let folders = ["", ".ci", "firmware", "host", "shared", "tests"];
    for folder in folders {
        let folder = root().join(folder);
        for entry in std::fs::read_dir(&folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.extension().is_some_and(|ending| ending == "md") {
                let page = path.strip_prefix(root()).expect("below the root");
                let page = page.to_str().expect("a path in UTF-8");
                assert!(PAGES.contains(&page), "{page} is not in the list of pages");
            }
        }
    }
}

#[test]
fn the_readme_is_short() {
    let length = std::fs::metadata(root().join("README.md"))
        .expect("a README")
        .len();
    assert!(
        length <= 6 * 1024,
        "README.md has {length} bytes; 6 KB are allowed"
    );
}
