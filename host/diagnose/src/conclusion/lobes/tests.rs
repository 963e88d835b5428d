//! Tests of the effect of an extension on stability limits.

use super::*;
use quietcut_stability::trial_cuts::Outcome;

/// The robot's case with an extension that changes all stiffness by this share.
fn stiffened(change: f64) -> Case {
    let mut case = quietcut_testkit::case("kuka-kr90-acetal");
    let mut table = toml::Table::new();
    table.insert("relative_change".into(), change.into());
    case.extensions.insert("stiffness".into(), table);
    case
}

#[test]
fn intervals_of_limits_follow_from_intervals_of_parameters() {
    let case = quietcut_testkit::case("kuka-kr90-acetal");
    let between = |low: f64, high: f64| {
        lobes(
            &case,
            &stiffened(0.1),
            &[[stiffened(low), stiffened(high)]],
            &[],
            &[],
        )
        .unwrap()
    };
    let [low, high] = [0.06, 0.14].map(|change| between(change, change));
    let found = between(0.06, 0.14);
    for (at, change) in found.speeds.iter().enumerate() {
        let center_mm = change.limit_after_mm.unwrap_or(found.searched_mm);
        // If both ends of the parameters lie on one side of the estimate, the interval extends to that side only.
        let [one, other] = [&low, &high].map(|ends| ends.speeds[at].limit_after_ci90_mm.unwrap());
        let [from_mm, to_mm] = change.limit_after_ci90_mm.unwrap();
        assert!(from_mm.unwrap() <= center_mm && to_mm.is_none_or(|to_mm| to_mm >= center_mm));
        assert_eq!(from_mm, [one[0], other[0]].into_iter().flatten().reduce(f64::min));
        let last = |limit_mm: Option<f64>| limit_mm.unwrap_or(f64::INFINITY);
        assert_eq!(last(to_mm), last(one[1]).max(last(other[1])));
    }
    // Two independent principal directions with equal changes give an interval √2 as wide.
    let moved = [stiffened(0.06), stiffened(0.14)];
    let twice = lobes(&case, &stiffened(0.1), &[moved.clone(), moved], &[], &[]).unwrap();
    let reach = |lobes: &Lobes| {
        let Some([Some(from_mm), _]) = lobes.at.limit_after_ci90_mm else {
            return 0.0;
        };
        lobes.at.limit_after_mm.unwrap_or(lobes.searched_mm) - from_mm
    };
    assert!(reach(&found) > 0.0);
    assert!((reach(&twice) / reach(&found) - 2.0_f64.sqrt()).abs() < 1e-9);
}

#[test]
fn limits_without_an_interval_say_why() {
    let case = quietcut_testkit::case("kuka-kr90-acetal");
    let mut broken = stiffened(0.1);
    broken.material = None;
    let lobes = lobes(&case, &stiffened(0.1), &[[broken.clone(), broken]], &[], &[]).unwrap();
    assert_eq!(lobes.at.limit_after_ci90_mm, None);
    assert!(
        lobes.warnings[0].starts_with("the 90 % intervals"),
        "{:?}",
        lobes.warnings
    );
}

#[test]
fn without_an_extension_the_case_predicts_the_cuts() {
    let case = quietcut_testkit::case("kuka-kr90-acetal");
    // Chapter 7: the limit is 3.174 mm at 600 rev/min.
    let cut = |depth_mm, outcome| TrialCut {
        rpm: 600.0,
        depth_mm,
        outcome,
        chatter_hz: None,
    };
    let cuts = [cut(2.5, Outcome::Stable), cut(3.0, Outcome::Chatter)];
    let chart = baseline_lobes(&case, &[], &cuts).unwrap();
    let calls: Vec<Call> = chart.cuts.iter().map(|(_, call)| *call).collect();
    assert_eq!(calls, [Call::Right, Call::MissedChatter]);
    assert_eq!(chart.searched_mm, BELOW_CUTS * 3.0);
}
