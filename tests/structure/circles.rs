//! No file imports itself through other files.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::crates::all;
use crate::graph::{Arrows, arrows};

/// Circles that are allowed for now: the crate, and a file of the circle. The test requires the removal of entries that are not
/// needed.
const STILL_THERE: &[(&str, &str)] = &[];

/// Groups of files that import each other in a circle.
fn circles(arrows: &Arrows) -> Vec<Vec<PathBuf>> {
    let files: BTreeSet<&PathBuf> = arrows.keys().flat_map(|(from, to)| [from, to]).collect();
    let reach = |start: &PathBuf| {
        let mut reached = BTreeSet::new();
        let mut open = vec![start.clone()];
        while let Some(file) = open.pop() {
            for (_, to) in arrows.keys().filter(|(from, _)| *from == file) {
                if reached.insert(to.clone()) {
                    open.push(to.clone());
                }
            }
        }
        reached
    };
    let reached: Vec<(&PathBuf, BTreeSet<PathBuf>)> = files.iter().map(|file| (*file, reach(file))).collect();
    let mut circles: Vec<Vec<PathBuf>> = Vec::new();
    for (file, own) in &reached {
        if !own.contains(*file) || circles.iter().flatten().any(|known| known == *file) {
            continue;
        }
        let circle = reached
            .iter()
            .filter(|(other, theirs)| own.contains(*other) && theirs.contains(*file));
        circles.push(circle.map(|(other, _)| (*other).clone()).collect());
    }
    circles
}

fn described(circle: &[PathBuf], arrows: &Arrows) -> String {
    let mut text = String::new();
    for ((from, to), names) in arrows {
        if circle.contains(from) && circle.contains(to) {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            text += &format!("  {} -> {}: {}\n", from.display(), to.display(), names.join(", "));
        }
    }
    text
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let mut found = String::new();
    let mut excused = Vec::new();
    for member in all() {
        for root in member.roots() {
            let arrows = arrows(&root);
            for circle in circles(&arrows) {
                let excuse = STILL_THERE
                    .iter()
                    .find(|(name, file)| *name == member.name && circle.contains(&PathBuf::from(file)));
                match excuse {
                    Some(excuse) => excused.push(*excuse),
                    None => found += &format!("{}\n{}", member.name, described(&circle, &arrows)),
                }
            }
        }
    }
    assert!(found.is_empty(), "import circles:\n{found}");
    let not_needed: Vec<_> = STILL_THERE
        .iter()
        .filter(|excuse| !excused.contains(excuse))
        .collect();
    assert!(
        not_needed.is_empty(),
        "no circle any more, remove: {not_needed:?}"
    );
}

/// Creates a crate in a temporary folder, from names and contents of files.
fn small_crate(files: &[(&str, &str)]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let root = folder.path().join("lib.rs");
    (folder, root)
}

/// The images of the firmware, the support library of the tests, and tests of several files are read too.
#[test]
fn programs_and_tests_of_several_files_have_roots() {
    let roots: Vec<PathBuf> = all().iter().flat_map(|member| member.roots()).collect();
    for end in [
        "firmware/src/bin/nucleo_g474re/main.rs",
        "firmware/src/bin/qemu_mps2/main.rs",
        "tests/support/lib.rs",
        "tests/hidden_effects/main.rs",
    ] {
        assert!(roots.iter().any(|root| root.ends_with(end)), "{end}: {roots:?}");
    }
}

#[test]
fn a_circle_is_found_through_a_parent_that_hands_names_on() {
    let (_folder, root) = small_crate(&[
        ("lib.rs", "mod a; mod b; pub use a::A;"),
        ("a.rs", "use crate::b::B; pub struct A(B);"),
        ("b.rs", "pub struct B; fn f() { let _ = vec![crate::A::new()]; }"),
    ]);
    let found = circles(&arrows(&root));
    assert_eq!(found, [[PathBuf::from("a.rs"), PathBuf::from("b.rs")]]);
}

#[test]
fn a_parent_that_uses_its_child_and_is_used_by_it_is_a_circle() {
    let (_folder, root) = small_crate(&[
        ("lib.rs", "mod a;"),
        ("a/mod.rs", "mod b; use b::B; pub struct A(B);"),
        ("a/b.rs", "use super::A; pub struct B; fn f(_: A) {}"),
    ]);
    assert_eq!(circles(&arrows(&root)).len(), 1);
}

#[test]
fn re_exports_and_tests_are_no_circle() {
    let (_folder, root) = small_crate(&[
        ("lib.rs", "mod a; pub use a::{A, B};"),
        ("a/mod.rs", "mod b; mod c; pub use b::B; pub use c::A;"),
        (
            "a/b.rs",
            "pub struct B; #[cfg(test)] mod tests { use super::super::A; fn f(_: A) {} }",
        ),
        ("a/c.rs", "use super::B; pub struct A(B);"),
    ]);
    let arrows = arrows(&root);
    assert!(circles(&arrows).is_empty(), "{arrows:?}");
    let arrow = (Path::new("a/c.rs").to_owned(), Path::new("a/b.rs").to_owned());
    assert!(arrows.contains_key(&arrow), "{arrows:?}");
}
