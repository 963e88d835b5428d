//! A file holds one noun. A file above 500 lines gives the reason in its head.

use std::path::{Path, PathBuf};

use crate::crates::all;

/// Largest number of lines of a file that needs no reason.
const LONGEST: usize = 500;

/// Number of lines at the head of a file in which the reason is searched.
const HEAD: usize = 15;

/// All source files below a folder, without tests.
pub(crate) fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap();
        if stem == "tests" || stem.ends_with("_tests") {
            continue;
        }
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Files that may exceed the limit for now. The test requires the removal of entries that are not needed.
const STILL_LONG: &[&str] = &[];

#[test]
fn long_files_say_why_they_are_one_noun() {
    let (mut long, mut excused) = (Vec::new(), Vec::new());
    for member in all()
        .into_iter()
        .filter(|member| member.folder.join("src").exists())
    {
        for path in sources(&member.folder.join("src")) {
            let text = std::fs::read_to_string(&path).unwrap();
            let says_why = text.lines().take(HEAD).any(|line| line.contains("one noun"));
            if text.lines().count() <= LONGEST || says_why {
                continue;
            }
            match STILL_LONG.iter().find(|file| path.ends_with(file)) {
                Some(excuse) => excused.push(*excuse),
                None => long.push(format!("{}: {} lines", path.display(), text.lines().count())),
            }
        }
    }
    assert!(long.is_empty(), "{}", long.join("\n"));
    let not_needed: Vec<_> = STILL_LONG
        .iter()
        .filter(|excuse| !excused.contains(excuse))
        .collect();
    assert!(not_needed.is_empty(), "short enough, remove: {not_needed:?}");
}
