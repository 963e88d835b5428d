use std::path::Path;

use quietcut_model::case::Case;

use super::*;
use crate::limits::method::Method;
use crate::orbit::collocation_of;
use crate::spectrum::stability_loss::StabilityLoss;
use crate::spectrum::verdict::Verdict;
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
    // They are (0.008/0.003)²/2 = 3.6 of χ²: less than the 3.84 that stated errors let expect.
    let expected = both.factor_std;
    assert!(
        (apart.modes[0].factor_std / expected - 1.0).abs() < 0.1,
        "{apart:?} {expected}"
    );
    // With half the stated error they are four times as much, and the interval is that of two values: Student's quantile for one degree
    // of freedom, 6.314, times the deviation |a − b|/2 of their mean.
    let apart = rescaling(&case, &method_of, &cuts, 0.0015).unwrap();
    let expected = 6.314 * 0.5 * (factors[0] - factors[1]).abs();
    // Weights differ by the slope of the lobe.
    assert!(
        (1.645 * apart.modes[0].factor_std / expected - 1.0).abs() < 0.1,
        "{apart:?} {expected}"
    );
}

/// Whether a cut that chattered is predicted to chatter is asked with the factors of all cuts together.
#[test]
fn predictions_of_the_cuts_have_the_factors_of_the_result() {
    let case = tool(&[('x', 900.0)]);
    let running = tool(&[('x', 837.0)]);
    let mut cuts = [check_cut(&running, 10_500.0), check_cut(&running, 11_500.0)];
    cuts[1].chatter_hz = cuts[1].chatter_hz.map(|hertz| 1.02 * hertz);
    let found = rescaling(&case, &method_of, &cuts, 0.003).unwrap();
    let together = tool(&[('x', 900.0 * found.modes[0].factor)]);
    let method = collocation_of(&together).unwrap();
    for cut in &found.cuts {
        let expected = method.point(cut.rpm, cut.depth_mm).unwrap().multiplier_abs;
        assert!(
            (cut.multiplier_abs.unwrap() / expected - 1.0).abs() < 1e-3,
            "{cut:?} {expected}"
        );
        assert!(
            (cut.factor.unwrap() / found.modes[0].factor - 1.0).abs() > 1e-3,
            "{found:?}"
        );
    }
}

/// At low speed half orders of the tooth-passing frequency lie as close as the error of a frequency, but nothing doubles its period there.
#[test]
fn a_cut_near_half_an_order_is_no_period_doubling_where_none_is_predicted() {
    const ERROR: f64 = 0.01;
    let case = tool(&[('x', 900.0)]);
    let running = collocation_of(&tool(&[('x', 890.0)])).unwrap();
    let depth_mm = 3.0;
    let near = (3000..3600).step_by(10).map(f64::from).find_map(|rpm| {
        let chatter_hz = running.point(rpm, depth_mm).unwrap().chatter_hz?;
        let half_hz = rpm / 60.0;
        let order = (chatter_hz / half_hz - 1.0) / 2.0;
        let off_hz = 2.0 * (order - order.round()).abs() * half_hz;
        (off_hz < ERROR * chatter_hz).then_some(TrialCut {
            rpm,
            depth_mm,
            outcome: Outcome::Chatter,
            chatter_hz: Some(chatter_hz),
        })
    });
    let found = rescaling(&case, &method_of, &[near.unwrap()], ERROR).unwrap();
    assert!(
        (found.modes[0].factor / (890.0 / 900.0) - 1.0).abs() < 1e-6,
        "{found:?}"
    );
}

/// A cut that is predicted to double its period.
fn doubled_cut(case: &Case) -> TrialCut {
    let method = collocation_of(case).unwrap();
    for rpm in (20_000..40_000).step_by(500).map(f64::from) {
        for depth_mm in [1.0, 2.0, 3.0, 4.0, 6.0] {
            let point = method.point(rpm, depth_mm).unwrap();
            if point.kind == StabilityLoss::Flip && point.verdict == Verdict::Unstable {
                return TrialCut {
                    rpm,
                    depth_mm,
                    outcome: Outcome::Chatter,
                    chatter_hz: point.chatter_hz,
                };
            }
        }
    }
    panic!("no cut doubles its period")
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
    let said = refused(&case, doubled_cut(&case));
    assert!(said.contains("double its period"), "{said}");
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
