use std::path::Path;

use quietcut_model::case::Case;

use super::*;
use crate::limits::method::Method;
use crate::orbit::collocation_of;
use crate::trial_cuts::Outcome;

/// A tool with modes of 0.04 kg and a damping ratio of 0.02: direction and frequency, Hz.
fn tool(modes: &[(char, f64)]) -> Case {
    let modes: String = modes
        .iter()
        .map(|(direction, frequency_hz)| {
            // Residue −i/(2ωm) of a real mode, to first order in the damping ratio.
            let half = (1.0 / (2.0 * std::f64::consts::TAU * frequency_hz * 0.04)).sqrt();
            let shape = |entry: String| match direction {
                'x' => format!("[{entry}, [0.0, 0.0]]"),
                _ => format!("[[0.0, 0.0], {entry}]"),
            };
            format!(
                "[[structure.mode]]\nfrequency_hz = {frequency_hz:?}\ndamping_ratio = 0.02\nleft = {}\nright = {}\n",
                shape(format!("[0.0, {}]", -half)),
                shape(format!("[{half}, 0.0]"))
            )
        })
        .collect();
    let text = format!(
        "[structure]\nkind = \"modes\"\ndirections = [\"x\", \"y\"]\n{modes}[tool]\nteeth = 2\nedge_angle_deg = 90.0\n[material]\n\
         ktc_mpa = 600.0\nkrc_mpa = 200.0\nkac_mpa = 0.0\n[cut]\nstart_deg = 90.0\nexit_deg = 180.0\nfeed_per_tooth_mm = 0.1\n"
    );
    Case::parse(Path::new("tool.toml"), &text).unwrap()
}

fn method_of(case: &Case) -> Result<Box<dyn Method>, String> {
    collocation_of(case).map_err(|error| error.to_string())
}

/// A cut 5 % above the limit of the case, with the chatter frequency of its dominant multiplier.
fn check_cut(case: &Case, rpm: f64) -> TrialCut {
    let method = collocation_of(case).unwrap();
    let limit = method.line(rpm, 20.0, 60).unwrap().first_limit.unwrap();
    let depth_mm = 1.05 * limit.depth_mm;
    let point = method.point(rpm, depth_mm).unwrap();
    TrialCut {
        rpm,
        depth_mm,
        outcome: Outcome::Chatter,
        chatter_hz: point.chatter_hz,
    }
}

#[test]
fn the_mode_that_chatters_is_found_and_its_factor() {
    let case = tool(&[('x', 900.0), ('y', 2200.0)]);
    for (factor, speeds) in [
        (0.93, [10_500.0, 11_500.0]),
        (1.0, [11_500.0, 12_500.0]),
        (1.06, [11_500.0, 12_500.0]),
    ] {
        let running = tool(&[('x', factor * 900.0), ('y', 2200.0)]);
        for rpm in speeds {
            let cut = check_cut(&running, rpm);
            let found = rescaling(&case, &method_of, &[cut], 0.003).unwrap();
            let [only] = &found.modes[..] else {
                panic!("{found:?}")
            };
            assert_eq!(only.mode, 1);
            // The root is found to 1e-8 of the factor, and frequencies move less than ten times as fast.
            assert!((only.factor / factor - 1.0).abs() < 1e-6, "{rpm} {found:?}");
            // The deviation is that of the frequency by a difference of the predictions.
            let other = TrialCut {
                chatter_hz: cut.chatter_hz.map(|hertz| hertz * 1.001),
                ..cut
            };
            let moved = rescaling(&case, &method_of, &[other], 0.003).unwrap().modes[0].factor;
            let expected = 3.0 * (moved - only.factor).abs();
            // Of a step of 0.1 % the second derivative of the lobe makes a few percent.
            assert!(
                (only.factor_std / expected - 1.0).abs() < 0.1,
                "{rpm} {expected} {found:?}"
            );
        }
    }
}

#[test]
fn cuts_of_one_mode_are_averaged_and_their_scatter_counts() {
    let case = tool(&[('x', 900.0)]);
    let running = tool(&[('x', 837.0)]);
    let mut cuts = [check_cut(&running, 10_500.0), check_cut(&running, 10_500.0)];
    let one = rescaling(&case, &method_of, &cuts[..1], 0.003).unwrap().modes[0].clone();
    let both = rescaling(&case, &method_of, &cuts, 0.003).unwrap().modes[0].clone();
    assert!((both.factor_std * 2.0_f64.sqrt() / one.factor_std - 1.0).abs() < 1e-9);
    for (cut, share) in cuts.iter_mut().zip([0.996, 1.004]) {
        cut.chatter_hz = cut.chatter_hz.map(|hertz| share * hertz);
    }
    let apart = rescaling(&case, &method_of, &cuts, 0.003).unwrap();
    let factors: Vec<f64> = apart.cuts.iter().filter_map(|cut| cut.factor).collect();
    // Two values have the deviation |a − b|/2 of their mean; weights differ by the slope of the lobe.
    let expected = 0.5 * (factors[0] - factors[1]).abs();
    assert!(
        (apart.modes[0].factor_std / expected - 1.0).abs() < 0.1,
        "{apart:?} {expected}"
    );
}

#[test]
fn a_cut_that_identifies_no_mode_is_refused_with_the_reason() {
    let case = tool(&[('x', 900.0), ('y', 2200.0)]);
    let cut = check_cut(&tool(&[('x', 837.0), ('y', 2200.0)]), 9000.0);
    let refused = |case: &Case, cut: TrialCut| {
        let error = rescaling(case, &method_of, &[cut], 0.003).unwrap_err();
        error.to_string()
    };
    let said = refused(
        &case,
        TrialCut {
            outcome: Outcome::Stable,
            chatter_hz: None,
            ..cut
        },
    );
    assert!(said.contains("did not chatter"), "{said}");
    let said = refused(
        &case,
        TrialCut {
            chatter_hz: None,
            ..cut
        },
    );
    assert!(said.contains("was not measured"), "{said}");
    // Three halves of the tooth-passing frequency of 300 Hz.
    let said = refused(
        &case,
        TrialCut {
            chatter_hz: Some(450.2),
            ..cut
        },
    );
    assert!(said.contains("period doubling"), "{said}");
    let said = refused(
        &case,
        TrialCut {
            chatter_hz: Some(250.0),
            ..cut
        },
    );
    assert!(said.contains("20 % lower"), "{said}");
    // Either mode may have fallen by some 14 %.
    let alike = tool(&[('x', 900.0), ('y', 800.0)]);
    let between = TrialCut {
        rpm: 12_500.0,
        depth_mm: 1.6,
        outcome: Outcome::Chatter,
        chatter_hz: Some(780.0),
    };
    let said = refused(&alike, between);
    assert!(said.contains("does so as well"), "{said}");
    let error = rescaling(&case, &method_of, &[], 0.003).unwrap_err();
    assert_eq!(error, RescalingError::NoCut);
    let matrices = quietcut_testkit::case("insperger-2dof-ad0.5");
    let error = rescaling(&matrices, &method_of, &[cut], 0.003).unwrap_err();
    assert!(matches!(error, RescalingError::NoModes { .. }), "{error}");
}
