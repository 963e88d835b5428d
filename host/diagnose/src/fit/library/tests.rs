//! The library of regressors.

use super::*;

#[test]
fn a_cause_without_regressors_is_reported_once() {
    let library = Library {
        causes: candidates::all(),
        candidates: Vec::new(),
        unexamined: Vec::new(),
    };
    let failed = |location: Location| (0, location, "a reason".to_owned());
    let sentences = library.unexamined(vec![
        failed(Location::Axis(0)),
        failed(Location::Axis(0)),
        failed(Location::Axis(1)),
    ]);
    let expected = ["x", "y"].map(|axis| format!("mass ({axis}) is not examined: a reason"));
    assert_eq!(sentences, expected);
}
