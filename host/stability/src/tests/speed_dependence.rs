//! Limits of a structure that depends on the spindle speed.

use std::path::Path;

use quietcut_model::case::Case;

use crate::lobe_table::{TableRequest, build_table};
use crate::orbit::collocation_of;
use crate::{CubicTerms, Problem};

/// Residue −i·r with r = 1/(2ωm) of a mode with the modal mass m = 0.04 kg, to first order in the damping ratio.
fn residue(frequency_hz: f64) -> f64 {
    1.0 / (2.0 * std::f64::consts::TAU * frequency_hz * 0.04)
}

/// A tool with one mode in x, of frequency in Hz and residue; the second one holds at 20 000 rev/min.
fn tool(modes: &[(f64, f64)]) -> Case {
    let mode = |(frequency_hz, residue): (f64, f64)| {
        let half = residue.sqrt();
        format!(
            "frequency_hz = {frequency_hz}\ndamping_ratio = 0.02\nleft = [[0.0, {}]]\nright = [[{half}, 0.0]]\n",
            -half
        )
    };
    let fast = modes.get(1).map_or_else(String::new, |fast| {
        format!(
            "[[structure.at_speed]]\nrpm = 20000.0\n[[structure.at_speed.mode]]\n{}",
            mode(*fast)
        )
    });
    let text = format!(
        "[structure]\nkind = \"modes\"\ndirections = [\"x\"]\nrpm = 0.0\n[[structure.mode]]\n{}{fast}[tool]\nteeth = 2\n\
         edge_angle_deg = 90.0\n[material]\nktc_mpa = 600.0\nkrc_mpa = 200.0\nkac_mpa = 0.0\n[cut]\nstart_deg = 90.0\nexit_deg = 180.0\n\
         feed_per_tooth_mm = 0.1\n",
        mode(modes[0])
    );
    Case::parse(Path::new("spindle.toml"), &text).unwrap()
}

/// Constant modal mass: 900 Hz at standstill, 700 Hz at 20 000 rev/min.
fn softening() -> Case {
    tool(&[(900.0, residue(900.0)), (700.0, residue(700.0))])
}

#[test]
fn limits_at_a_speed_are_those_of_the_structure_there() {
    let method = collocation_of(&softening()).unwrap();
    let standstill = collocation_of(&tool(&[(900.0, residue(900.0))])).unwrap();
    for (rpm, share) in [(5000.0, 0.25), (10_000.0, 0.5), (20_000.0, 1.0), (30_000.0, 1.0)] {
        let limit = |method: &dyn crate::Method| method.line(rpm, 20.0, 60).unwrap().first_limit.unwrap();
        let found = limit(method.as_ref());
        let between = |a: f64, b: f64| a + (b - a) * share;
        let there = tool(&[(between(900.0, 700.0), between(residue(900.0), residue(700.0)))]);
        let alone = limit(collocation_of(&there).unwrap().as_ref());
        // Both limits state an error of 1e-6 mm.
        assert!(
            (found.depth_mm / alone.depth_mm - 1.0).abs() < 2e-6,
            "{rpm}: {found:?} {alone:?}"
        );
        if share == 1.0 {
            let fixed = limit(standstill.as_ref());
            assert!(
                (fixed.depth_mm / alone.depth_mm - 1.0).abs() > 0.1,
                "{fixed:?} {alone:?}"
            );
        }
    }
}

#[test]
fn a_table_has_the_limits_of_each_speed_and_one_structure_is_refused() {
    let case = softening();
    let error = Problem::new(&case, CubicTerms::Refuse).unwrap_err().to_string();
    assert!(error.contains("structure.at_speed"), "{error}");
    let request = TableRequest {
        rpm: Some((8000.0, 20_000.0)),
        depth_mm: Some(4.0),
        speeds: Some(30),
        ..TableRequest::default()
    };
    let built = build_table(std::slice::from_ref(&case), &request).unwrap();
    let table = quietcut_core::lobes::LobeTable::parse(&built.bytes).unwrap();
    let method = collocation_of(&case).unwrap();
    for (index, rpm) in table.speeds().enumerate().step_by(7) {
        let limit = method.line(f64::from(rpm.0), 4.0, 60).unwrap().first_limit;
        let tabulated = table
            .entry(0, index)
            .unwrap()
            .first_limit()
            .map(|interval| interval.from.0);
        let (Some(limit), Some(tabulated)) = (limit, tabulated) else {
            continue;
        };
        // Entries are rounded to 16 bits of 4 mm, and shallower where the guard of the table lowered them.
        assert!(f64::from(tabulated) < limit.depth_mm + 1e-3, "{rpm:?}");
        assert!(
            f64::from(tabulated) > 0.7 * limit.depth_mm,
            "{rpm:?} {tabulated} {limit:?}"
        );
    }
    let with_derivatives = TableRequest {
        derivatives: true,
        ..request
    };
    let error = build_table(&[case], &with_derivatives).unwrap_err().to_string();
    assert!(error.contains("the same at all speeds"), "{error}");
}
