//! The rooms of a crate have an order. Each room uses only rooms before it.

use std::path::Path;

use crate::crates::all;
use crate::graph::arrows;

/// Crates with their rooms, lowest first. A room is a file or folder beside `lib.rs`.
const ROOMS: &[(&str, &[&str])] = &[
    (
        "quietcut-diagnose",
        &[
            "criteria",
            "error",
            "progress",
            "signal",
            "baseline",
            "motion",
            "orders",
            "records",
            "candidates",
            "fit",
            "selection",
            "conclusion",
            "cuts",
            "next_test",
            "lib",
        ],
    ),
    (
        "quietcut-stability",
        &[
            "criteria",
            "error",
            "process",
            "problem",
            "spectrum",
            "limits",
            "frequency",
            "methods",
            "orbit",
            "cut_orbit",
            "lobe_table",
            "trial_cuts",
            "rescaling",
            "lib",
        ],
    ),
    (
        "quietcut-identify",
        &[
            "criteria",
            "least_squares",
            "modes",
            "dwells",
            "nonlinear",
            "cutting",
            "robot",
            "ambient",
            "case_uncertainty",
            "case_file",
            "plan",
            "lib",
        ],
    ),
];

/// The room of a file: its first folder, or its own name without a folder.
fn room(file: &Path) -> &str {
    let first = file.iter().next().unwrap().to_str().unwrap();
    first.trim_end_matches(".rs")
}

#[test]
fn rooms_use_only_those_before_them() {
    let mut upward = String::new();
    for member in all() {
        let Some((_, rooms)) = ROOMS.iter().find(|(name, _)| *name == member.name) else {
            continue;
        };
        let rank = |file: &Path| {
            let room = room(file);
            rooms
                .iter()
                .position(|name| *name == room)
                .unwrap_or_else(|| panic!("{}: {} is in no room of the table", member.name, file.display()))
        };
        for ((from, to), names) in arrows(&member.roots()[0]) {
            if rank(&from) < rank(&to) {
                upward += &format!(
                    "{}: {} -> {}: {names:?}\n",
                    member.name,
                    from.display(),
                    to.display()
                );
            }
        }
    }
    assert!(upward.is_empty(), "upward arrows:\n{upward}");
}
