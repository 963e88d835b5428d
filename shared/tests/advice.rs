//! Advice against chatter, with and without a lobe table.
#![allow(clippy::unwrap_used, clippy::panic)]

// Each test file uses its part of it.
#[allow(dead_code)]
mod support;

use proptest::prelude::*;
use quietcut_core::advice::{
    Action, Advice, DEPTH_MARGIN, MAX_LOBE, Obstacle, SPEED_BAND, Source, advise, tooth_passing_speed,
};
use quietcut_core::detector::{Judgement, Reason, Verdict};
use quietcut_core::lobes::{Interval, IntervalKind, LobeTable, NotKnown, TabulatedStability};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Rpm};
use quietcut_core::working_point::{Limits, Tool, WorkingPoint};
use support::{Owned, acetal, interval, table, validity, working_point};

const TOOL: Tool = Tool { teeth: 2 };

/// Largest distance of the found speed from the nearest quiet speed, relative: one step of the search, 1/4 of the speed band.
const SEARCH_STEP: f32 = SPEED_BAND / 4.0;

/// Relative distance of the speeds whose smaller depths are compared: half the width of a speed band.
const DEPTH_SEARCH_STEP: f32 = SPEED_BAND;

fn heard(verdict: Verdict, chatter_hz: f32) -> Judgement {
    Judgement {
        verdict,
        reason: Reason::Growing,
        chatter: Some(Hertz(chatter_hz)),
        multiplier_abs: Some(1.02),
        confidence: 0.95,
    }
}

fn hopf(chatter_hz: f32) -> Judgement {
    heard(Verdict::Hopf, chatter_hz)
}

fn limits(rpm_min: f32, rpm_max: f32) -> Limits {
    Limits {
        rpm_min: Rpm(rpm_min),
        rpm_max: Rpm(rpm_max),
    }
}

/// A table of one layer with depths from 0 to 6 mm and without speed limits.
fn table_of(columns: &[(f32, Vec<Interval>)]) -> Vec<u8> {
    Owned {
        limits: None,
        depth_from_mm: 0.0,
        depth_to_mm: 6.0,
        speeds: columns.iter().map(|(rpm, _)| Rpm(*rpm)).collect(),
        layers: vec![(
            validity(0.15),
            columns.iter().map(|(_, column)| column.clone()).collect(),
        )],
    }
    .encode()
    .unwrap()
}

/// Columns whose Hopf limit rises linearly with the speed: 1 mm at 1 000 rev/min, 3 mm at 2 000 rev/min.
fn ramp() -> Vec<u8> {
    let above = |from_mm| vec![interval(from_mm, 6.0, IntervalKind::Hopf, 30.0)];
    table_of(&[(1000.0, above(1.0)), (2000.0, above(3.0))])
}

fn at_depth(depth_mm: f32) -> WorkingPoint {
    working_point(&validity(0.15), depth_mm)
}

fn ask(bytes: &[u8], judgement: &Judgement, rpm: f32, depth_mm: f32, limits: Option<Limits>) -> Advice {
    let table = LobeTable::parse(bytes).unwrap();
    advise(
        judgement,
        Rpm(rpm),
        Some(&table),
        Some(&at_depth(depth_mm)),
        limits.as_ref(),
        &TOOL,
    )
}

fn assert_near(found: f32, expected: f32, relative: f32) {
    assert!(
        (found / expected - 1.0).abs() <= relative,
        "{found} is not {expected} within {relative}"
    );
}

#[test]
fn without_chatter_speed_and_depth_are_kept() {
    for verdict in [
        Verdict::AirCut,
        Verdict::Stable,
        Verdict::Forced,
        Verdict::Runout,
        Verdict::Indeterminate,
    ] {
        let advice = ask(&ramp(), &heard(verdict, 17.0), 1100.0, 2.0, None);
        assert_eq!(
            (advice.action, advice.speed, advice.depth),
            (Action::Keep, Rpm(1100.0), Some(Millimeters(2.0)))
        );
    }
}

#[test]
fn the_nearest_speed_that_is_stable_with_margin() {
    // A depth of 2.2 mm is stable from 1 600 rev/min on. This speed must be the lower end of the speed band.
    let advice = ask(&ramp(), &hopf(30.0), 1100.0, 2.0, None);
    assert_eq!((advice.action, advice.source), (Action::Speed, Source::Table));
    assert_eq!(
        (advice.depth, advice.assumed, advice.obstacle),
        (Some(Millimeters(2.0)), None, None)
    );
    assert_near(advice.speed.0, 1600.0 / (1.0 - SPEED_BAND), SEARCH_STEP);
}

#[test]
fn the_nearer_of_two_pockets_is_advised() {
    let above = |from_mm| vec![interval(from_mm, 6.0, IntervalKind::Hopf, 30.0)];
    // Pockets with a limit of 3 mm around 1 000 and 1 300 rev/min; the limit is 1 mm elsewhere.
    let pockets = [
        900.0, 949.0, 950.0, 1050.0, 1051.0, 1249.0, 1250.0, 1350.0, 1351.0, 1400.0,
    ];
    let limits_mm = [1.0, 1.0, 3.0, 3.0, 1.0, 1.0, 3.0, 3.0, 1.0, 1.0];
    let columns: Vec<_> = pockets.into_iter().zip(limits_mm.map(above)).collect();
    let bytes = table_of(&columns);
    // Speed ratios from 1 130 rev/min: 1.087 down to 1 050/1.01, 1.117 up to 1 250/0.99.
    let advice = ask(&bytes, &hopf(30.0), 1130.0, 2.0, None);
    assert_near(advice.speed.0, 1050.0 / (1.0 + SPEED_BAND), SEARCH_STEP);
    let advice = ask(&bytes, &hopf(30.0), 1170.0, 2.0, None);
    assert_near(advice.speed.0, 1250.0 / (1.0 - SPEED_BAND), SEARCH_STEP);
    // The speed limits of the machine exclude the nearer pocket.
    let advice = ask(&bytes, &hopf(30.0), 1130.0, 2.0, Some(limits(1045.0, 2000.0)));
    assert_eq!(advice.action, Action::Speed);
    let advice = ask(&bytes, &hopf(30.0), 1130.0, 2.0, Some(limits(1060.0, 2000.0)));
    assert_near(advice.speed.0, 1250.0 / (1.0 - SPEED_BAND), SEARCH_STEP);
}

#[test]
fn at_the_limit_of_the_machine_the_band_ends() {
    let bytes = ramp();
    // A depth of 2.2 mm is stable from 1 600 rev/min on. A machine with a largest speed just above 1 605 may use that speed,
    // because it cannot go beyond.
    let advice = ask(&bytes, &hopf(30.0), 1100.0, 2.0, Some(limits(1000.0, 1617.0)));
    assert_eq!(advice.action, Action::Speed);
    assert!(advice.speed.0 <= 1617.0);
    // At the end of the table the speed band must lie inside: nothing is known beyond. A depth of 2.69 mm is stable from 1 980
    // rev/min on.
    let advice = ask(&bytes, &hopf(30.0), 1100.0, 2.69, None);
    assert_eq!(advice.action, Action::Depth);
}

#[test]
fn a_pocket_narrower_than_the_speed_band_is_not_advised() {
    let above = |from_mm| vec![interval(from_mm, 6.0, IntervalKind::Hopf, 30.0)];
    // A pocket at 1 000 rev/min with a width of 10 rev/min: half of the speed band.
    let speeds = [900.0, 994.0, 995.0, 1005.0, 1006.0, 1100.0];
    let columns: Vec<_> = speeds
        .into_iter()
        .zip([1.0, 1.0, 3.0, 3.0, 1.0, 1.0].map(above))
        .collect();
    let advice = ask(&table_of(&columns), &hopf(30.0), 930.0, 2.0, None);
    assert_eq!(advice.action, Action::Depth);
    assert_near(advice.depth.unwrap().0, 1.0 / (1.0 + DEPTH_MARGIN), 1e-3);
    assert_eq!(advice.speed, Rpm(930.0));
}

#[test]
fn a_pocket_above_a_flip_island_is_used() {
    let island = vec![
        interval(1.5, 2.0, IntervalKind::Flip, 17.0),
        interval(3.0, 6.0, IntervalKind::Hopf, 19.0),
    ];
    let hopf_from = |from_mm| vec![interval(from_mm, 6.0, IntervalKind::Hopf, 19.0)];
    let bytes = table_of(&[
        (900.0, hopf_from(1.0)),
        (1000.0, hopf_from(1.0)),
        (1001.0, island.clone()),
        (1100.0, island),
        (1101.0, hopf_from(1.0)),
        (1200.0, hopf_from(1.0)),
    ]);
    // The margin of 2.5 mm, 2.25 to 2.75 mm, lies between the island and the Hopf limit. That of 2.1 mm begins at 1.89 mm, in
    // the island.
    let advice = ask(&bytes, &hopf(19.0), 950.0, 2.5, None);
    assert_eq!(advice.action, Action::Speed);
    assert_near(advice.speed.0, 1001.0 / (1.0 - SPEED_BAND), SEARCH_STEP);
    let advice = ask(&bytes, &hopf(19.0), 950.0, 2.1, None);
    assert_eq!(advice.action, Action::Depth);
    // Below the island 1.5/1.1 mm are quiet, which is more than 1.0/1.1 mm at 950 rev/min.
    assert_near(advice.depth.unwrap().0, 1.5 / (1.0 + DEPTH_MARGIN), 1e-3);
    assert_near(advice.speed.0, 1001.0 / (1.0 - SPEED_BAND), DEPTH_SEARCH_STEP);
}

#[test]
fn a_smaller_depth_at_another_speed_must_be_larger_by_the_factor_better() {
    let above = |from_mm| vec![interval(from_mm, 6.0, IntervalKind::Hopf, 30.0)];
    let far_limit = |mm| {
        let far = [(1060.0, above(mm)), (1100.0, above(mm))];
        let bytes = table_of(&[&[(1000.0, above(1.0)), (1040.0, above(1.0))], far.as_slice()].concat());
        ask(&bytes, &hopf(30.0), 1020.0, 2.0, None)
    };
    let kept = far_limit(1.05);
    assert_eq!((kept.action, kept.speed), (Action::Depth, Rpm(1020.0)));
    assert_near(kept.depth.unwrap().0, 1.0 / (1.0 + DEPTH_MARGIN), 1e-3);
    let moved = far_limit(1.15);
    assert_eq!(moved.action, Action::Depth);
    assert_near(moved.speed.0, 1060.0 / (1.0 - SPEED_BAND), DEPTH_SEARCH_STEP);
    assert_near(moved.depth.unwrap().0, 1.15 / (1.0 + DEPTH_MARGIN), 1e-3);
}

#[test]
fn undecided_depths_are_not_advised() {
    let bytes = table_of(&[
        (1000.0, vec![interval(1.0, 6.0, IntervalKind::Hopf, 30.0)]),
        (1200.0, vec![interval(0.0, 6.0, IntervalKind::Undecided, 0.0)]),
        (1400.0, vec![interval(0.0, 6.0, IntervalKind::Undecided, 0.0)]),
        (1400.5, vec![]),
        (1600.0, vec![]),
    ]);
    let advice = ask(&bytes, &hopf(30.0), 1000.0, 2.0, None);
    assert_near(advice.speed.0, 1400.5 / (1.0 - SPEED_BAND), SEARCH_STEP);
}

#[test]
fn a_contradicted_table_is_replaced_by_the_rule() {
    // Chatter is detected where the table is stable with margin. The tooth-passing rule gives 60·40/2 = 1 200 rev/min over k.
    let advice = ask(&ramp(), &hopf(40.0), 1700.0, 1.0, None);
    assert_eq!(
        (advice.action, advice.source),
        (Action::Speed, Source::ToothPassingRule)
    );
    assert_eq!(advice.obstacle, Some(Obstacle::Contradicted));
    assert_near(advice.speed.0, 1200.0, 1e-6);
    // A speed of the rule that is unstable in the table is not advised.
    let advice = ask(&ramp(), &hopf(40.0), 1900.0, 2.0, Some(limits(1000.0, 2000.0)));
    assert_eq!(
        (advice.action, advice.source),
        (Action::Depth, Source::ToothPassingRule)
    );
    assert_eq!(
        (advice.depth, advice.obstacle),
        (None, Some(Obstacle::NoSpeedWithinLimits))
    );
}

#[test]
fn a_cut_outside_the_table_gets_advice_from_the_rule_with_the_reason() {
    let bytes = ramp();
    let table = LobeTable::parse(&bytes).unwrap();
    let why = |at: WorkingPoint, tool: Tool| {
        let advice = advise(&hopf(40.0), Rpm(1100.0), Some(&table), Some(&at), None, &tool);
        assert_eq!(advice.source, Source::ToothPassingRule);
        advice.obstacle
    };
    let base = at_depth(2.0);
    let exit = WorkingPoint {
        exit: Degrees(120.0),
        ..base
    };
    assert!(matches!(
        why(exit, TOOL),
        Some(Obstacle::Table(NotKnown::Immersion { .. }))
    ));
    let feed = WorkingPoint {
        feed_per_tooth: Millimeters(0.3),
        ..base
    };
    assert!(matches!(
        why(feed, TOOL),
        Some(Obstacle::Table(NotKnown::Feed { .. }))
    ));
    let posture = WorkingPoint { posture: 3, ..base };
    assert_eq!(
        why(posture, TOOL),
        Some(Obstacle::Table(NotKnown::Posture { asked: 3 }))
    );
    assert!(matches!(
        why(at_depth(7.0), TOOL),
        Some(Obstacle::Table(NotKnown::Depth { .. }))
    ));
    let teeth = NotKnown::Teeth { asked: 3, table: 2 };
    assert_eq!(why(base, Tool { teeth: 3 }), Some(Obstacle::Table(teeth)));
    // A present speed outside of the table does not prevent advice: speeds inside are known.
    let advice = ask(&bytes, &hopf(30.0), 800.0, 1.0, None);
    assert_eq!((advice.action, advice.source), (Action::Speed, Source::Table));
}

#[test]
fn without_a_working_point_the_assumed_one_is_stated() {
    let bytes = acetal().encode().unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    let advice = |judgement, rpm| advise(&judgement, Rpm(rpm), Some(&table), None, None, &TOOL);
    // The smallest depths with chatter at 1 045 rev/min are 1.327 mm for a flip and 4.023 mm for a Hopf bifurcation.
    let flip = advice(heard(Verdict::PeriodDoubling, 17.4), 1045.0);
    assert_eq!(
        (flip.action, flip.source, flip.depth),
        (Action::Speed, Source::Table, None)
    );
    let assumed = flip.assumed.unwrap();
    assert_near(assumed.axial_depth.0, 1.327, 1e-4);
    assert_eq!((assumed.start, assumed.exit), (Degrees(90.0), Degrees(180.0)));
    assert_eq!((assumed.feed_per_tooth, assumed.posture), (Millimeters(0.15), 0));
    let answer = table.lookup(flip.speed, &assumed);
    assert!(
        matches!(answer, TabulatedStability::Stable { margin } if margin.0 >= 0.999 * DEPTH_MARGIN * 1.327),
        "{answer:?}"
    );
    assert_near(
        advice(hopf(19.0), 1045.0).assumed.unwrap().axial_depth.0,
        4.023,
        1e-4,
    );
    // If the table has no chatter of the detected kind, chatter of another kind gives the assumed depth.
    let other = advice(heard(Verdict::PeriodDoubling, 15.0), 900.0);
    assert_near(other.assumed.unwrap().axial_depth.0, 1.723, 1e-4);
    // If the table has no chatter at this speed, it contradicts the detected chatter.
    let none = advice(hopf(40.0), 3000.0);
    assert_eq!(
        (none.source, none.obstacle),
        (Source::ToothPassingRule, Some(Obstacle::Contradicted))
    );
    assert_eq!(none.assumed, None);
    let outside = advice(hopf(40.0), 3001.0);
    assert!(matches!(
        outside.obstacle,
        Some(Obstacle::Table(NotKnown::Speed { .. }))
    ));
}

#[test]
fn the_tooth_passing_rule() {
    let flip = |chatter_hz| heard(Verdict::PeriodDoubling, chatter_hz);
    // Columns: judgement, present speed, limits, advised speed. With two teeth, one wave per tooth is at 30 times the chatter
    // frequency.
    let cases = [
        // Benchmark at 5 000 rev/min: 5.67 waves per tooth, so that six waves are nearer than five.
        (hopf(945.3), 5000.0, None, Some(945.3 * 30.0 / 6.0)),
        (
            hopf(945.3),
            5000.0,
            Some((4800.0, 9000.0)),
            Some(945.3 * 30.0 / 5.0),
        ),
        (hopf(945.3), 5000.0, Some((4800.0, 5600.0)), None),
        (hopf(945.3), 5300.0, None, Some(945.3 * 30.0 / 5.0)),
        // The present speed is a speed of the rule. Only pockets at higher speeds are candidates.
        (hopf(945.3), 4726.5, None, Some(945.3 * 30.0 / 5.0)),
        (hopf(945.3), 4750.0, None, Some(945.3 * 30.0 / 5.0)),
        (hopf(945.3), 28_359.0, None, None),
        // The acetal robot at 900 rev/min has half a wave per tooth. The only speed of the rule is far below.
        (hopf(17.44), 900.0, Some((300.0, 2400.0)), Some(17.44 * 30.0)),
        (hopf(17.44), 900.0, Some((600.0, 2400.0)), None),
        // Flips with 1/2, 3/2 and 5/2 waves per tooth.
        (flip(17.4), 1044.0, None, Some(522.0)),
        (flip(300.0), 6000.0, None, Some(4500.0)),
        (flip(300.0), 6000.0, Some((5000.0, 10_000.0)), Some(9000.0)),
        (flip(250.0), 3000.0, None, Some(2500.0)),
        // At low speed the rule ends at the twentieth pocket.
        (hopf(945.3), 1000.0, None, Some(945.3 * 30.0 / 20.0)),
    ];
    for (judgement, rpm, range, expected) in cases {
        let range = range.map(|(min, max)| limits(min, max));
        for point in [None, Some(at_depth(2.0))] {
            let advice = advise(&judgement, Rpm(rpm), None, point.as_ref(), range.as_ref(), &TOOL);
            assert_eq!(advice.source, Source::ToothPassingRule);
            assert_eq!(advice.assumed, None);
            match expected {
                Some(expected) => {
                    assert_eq!(
                        (advice.action, advice.obstacle),
                        (Action::Speed, Some(Obstacle::NoTable))
                    );
                    assert_near(advice.speed.0, expected, 1e-6);
                    assert_eq!(advice.depth, point.map(|point| point.axial_depth));
                }
                None => {
                    let obstacle = Some(Obstacle::NoSpeedWithinLimits);
                    assert_eq!(
                        (advice.action, advice.obstacle, advice.depth),
                        (Action::Depth, obstacle, None)
                    );
                    assert_eq!(advice.speed, Rpm(rpm));
                }
            }
        }
    }
}

#[test]
fn without_a_chatter_frequency_or_a_speed_there_is_no_advice() {
    for chatter in [None, Some(Hertz(0.0)), Some(Hertz(f32::NAN))] {
        let judgement = Judgement {
            chatter,
            ..hopf(17.0)
        };
        let advice = advise(&judgement, Rpm(900.0), None, None, None, &TOOL);
        assert_eq!(
            (advice.action, advice.obstacle),
            (Action::NotKnown, Some(Obstacle::ChatterFrequency))
        );
    }
    for rpm in [0.0, -900.0, f32::NAN, f32::INFINITY] {
        let advice = ask(&ramp(), &hopf(17.0), rpm, 1.0, None);
        assert_eq!(
            (advice.action, advice.obstacle),
            (Action::NotKnown, Some(Obstacle::Speed))
        );
    }
}

#[test]
fn the_rule_leads_into_no_gap_between_the_gears() {
    // The spindle must not run from 1 100 to 1 300 rev/min: no depth is stable there. Elsewhere 5 mm are.
    let open = || vec![interval(5.0, 6.0, IntervalKind::Hopf, 30.0)];
    let shut = || vec![interval(0.0, 6.0, IntervalKind::Undecided, 0.0)];
    let bytes = table_of(&[
        (600.0, open()),
        (1099.0, open()),
        (1100.0, shut()),
        (1300.0, shut()),
        (1301.0, open()),
        (2000.0, open()),
    ]);
    let table = LobeTable::parse(&bytes).unwrap();
    // The table calls the present speed stable, so that the rule advises: 40 Hz and two teeth give 1 200 rev/min, lobe 1, and
    // 600 rev/min, lobe 2, the nearest that is allowed.
    let of_cut = advise(
        &hopf(40.0),
        Rpm(1000.0),
        Some(&table),
        Some(&at_depth(2.0)),
        None,
        &TOOL,
    );
    assert_eq!(
        (of_cut.source, of_cut.action),
        (Source::ToothPassingRule, Action::Speed)
    );
    assert_near(of_cut.speed.0, 600.0, 1e-5);
    // A cut that the table does not cover: the speeds of the spindle are the same.
    let mut other = at_depth(2.0);
    other.feed_per_tooth = Millimeters(0.4);
    let of_other = advise(&hopf(40.0), Rpm(1000.0), Some(&table), Some(&other), None, &TOOL);
    assert_near(of_other.speed.0, 600.0, 1e-5);
    let without = advise(&hopf(40.0), Rpm(1000.0), None, Some(&other), None, &TOOL);
    assert_near(without.speed.0, 1200.0, 1e-5);
}

#[test]
fn speed_limits_without_a_speed_of_the_table_lead_to_a_smaller_depth() {
    // The speed limits in the table are 600 to 2 400 rev/min.
    let bytes = acetal().encode().unwrap();
    for (from, to) in [
        (3000.0, 4000.0),
        (2000.0, 1000.0),
        (f32::NAN, f32::NAN),
        (0.0, 0.0),
    ] {
        let advice = ask(&bytes, &hopf(17.4), 900.0, 2.0, Some(limits(from, to)));
        assert!(from.is_nan() || advice.action == Action::Depth, "{advice:?}");
    }
}

proptest! {
    #[test]
    fn the_rule_moves_away_from_a_flip(half_waves in 0_u8..8, rpm in 500.0_f32..20_000.0, teeth in 1_u8..9) {
        let waves = f32::from(half_waves) + 0.5;
        let chatter = Hertz(waves * rpm / 60.0 * f32::from(teeth));
        let tool = Tool { teeth };
        let speed = tooth_passing_speed(Rpm(rpm), chatter, &tool, |_| true).unwrap();
        // The number of waves per tooth is whole at the new speed, and odd multiples of 1/2 at the present speed of a flip.
        let new_waves = chatter.0 / (speed.0 / 60.0 * f32::from(teeth));
        prop_assert!((new_waves - new_waves.round()).abs() < 1e-4);
        prop_assert!((speed.0 / rpm - 1.0).abs() > 0.99 / (2.0 * waves + 1.0));
        prop_assert!(new_waves.round() <= f32::from(MAX_LOBE));
    }

    #[test]
    fn advice_is_within_limits_and_never_what_the_table_calls_unstable(
        content in table(), rpm in 400.0_f32..2500.0, depth in 0.0_f32..1.0, chatter_hz in 5.0_f32..300.0,
        range in prop::option::of((400.0_f32..1500.0, 1.0_f32..1500.0)), is_flip in any::<bool>(), is_told in any::<bool>(),
    ) {
        let bytes = content.encode().unwrap();
        let table = LobeTable::parse(&bytes).unwrap();
        let verdict = if is_flip { Verdict::PeriodDoubling } else { Verdict::Hopf };
        let depth_mm = content.depth_from_mm + depth * (content.depth_to_mm - content.depth_from_mm);
        let told = working_point(&validity(0.05), depth_mm);
        let limits = range.map(|(from, width)| limits(from, from + width));
        let working_point = is_told.then_some(&told);
        let advice = advise(&heard(verdict, chatter_hz), Rpm(rpm), Some(&table), working_point, limits.as_ref(), &TOOL);

        let of_table = content.limits;
        for limits in limits.iter().chain(&of_table) {
            let is_inside = advice.speed >= limits.rpm_min && advice.speed <= limits.rpm_max;
            // If the present speed is kept, it equals the given speed.
            prop_assert!(is_inside || advice.speed == Rpm(rpm), "{:?}", advice);
        }
        let Some(mut at) = working_point.copied().or(advice.assumed) else { return Ok(()) };
        prop_assert_eq!(advice.assumed.is_some(), !is_told);
        match advice.action {
            Action::Speed => prop_assert!(advice.speed != Rpm(rpm)),
            Action::Depth => match advice.depth {
                Some(depth) => {
                    prop_assert!(depth <= at.axial_depth);
                    at.axial_depth = depth;
                }
                None => return Ok(()),
            },
            Action::Keep | Action::NotKnown => return Ok(()),
        }
        let answer = table.lookup(advice.speed, &at);
        prop_assert!(!matches!(answer, TabulatedStability::Unstable { .. }), "{advice:?} {answer:?}");
        if advice.source == Source::Table {
            // All depths within the margin and all speeds within the band must be stable, except for rounding. The band is
            // clipped at the speed limits.
            let range = limits.into_iter().chain(of_table).fold((0.0, f32::INFINITY), |(from, to), limits| {
                (f32::max(from, limits.rpm_min.0), f32::min(to, limits.rpm_max.0))
            });
            for step in -10_i8..=10 {
                let rpm = advice.speed.0 * (1.0 + 0.999 * SPEED_BAND * f32::from(step) / 10.0);
                if rpm < range.0 || rpm > range.1 { continue }
                for factor in [1.0 - 0.999 * DEPTH_MARGIN, 1.0, 1.0 + 0.999 * DEPTH_MARGIN] {
                    let near = WorkingPoint { axial_depth: Millimeters(factor * at.axial_depth.0), ..at };
                    let answer = table.lookup(Rpm(rpm), &near);
                    prop_assert!(matches!(answer, TabulatedStability::Stable { .. }), "{rpm} {near:?}: {advice:?} {answer:?}");
                }
            }
        }
    }

    #[test]
    fn no_nearer_speed_is_quiet(content in table(), rpm in 500.0_f32..2500.0, depth in 0.05_f32..0.9) {
        let content = Owned { limits: None, ..content };
        let bytes = content.encode().unwrap();
        let table = LobeTable::parse(&bytes).unwrap();
        let depth_mm = content.depth_from_mm + depth * (content.depth_to_mm - content.depth_from_mm);
        let at = working_point(&validity(0.05), depth_mm);
        let advice = advise(&hopf(17.0), Rpm(rpm), Some(&table), Some(&at), None, &TOOL);
        // Brute force with 1.5 times the margin: the search must find a speed that is quiet by this stricter rule.
        let is_quiet = |centre: f32, factor: f32| {
            (-12_i8..=12).all(|step| {
                let speed = Rpm(centre * (1.0 + factor * SPEED_BAND * f32::from(step) / 12.0));
                table.column(speed, &at).is_ok_and(|column| {
                    let margin = factor * DEPTH_MARGIN;
                    column.is_stable_within(Millimeters(depth_mm * (1.0 - margin)), Millimeters(depth_mm * (1.0 + margin)))
                })
            })
        };
        // If the present cut is quiet, it contradicts the table, and no speed is searched.
        if is_quiet(rpm, 0.99) { return Ok(()) }
        let found = match (advice.action, advice.source) {
            (Action::Speed, Source::Table) => f32::max(advice.speed.0 / rpm, rpm / advice.speed.0),
            _ => f32::INFINITY,
        };
        for step in 1..=600_u16 {
            let ratio = 1.0 + 0.005 * f32::from(step);
            if ratio >= found { break }
            prop_assert!(!is_quiet(rpm * ratio, 1.5) && !is_quiet(rpm / ratio, 1.5), "{ratio} {advice:?}");
        }
    }

    #[test]
    fn the_search_ends_in_a_table_damaged_after_its_check(
        content in table(), damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..30),
        rpm in 400.0_f32..2500.0, depth_mm in 0.0_f32..10.0, is_told in any::<bool>(),
    ) {
        let mut bytes = content.encode().unwrap();
        for (position, byte) in damage {
            let position = position.index(bytes.len());
            bytes[position] = byte;
        }
        if let Ok(table) = LobeTable::reopen(&bytes) {
            let at = working_point(&validity(0.05), depth_mm);
            let tool = Tool { teeth: table.teeth() };
            let _ = advise(&hopf(17.0), Rpm(rpm), Some(&table), is_told.then_some(&at), None, &tool);
        }
    }
}
