use std::cell::Cell;

use super::*;
use crate::limits::speed_line::Switch;
use crate::spectrum::stability_loss::StabilityLoss;

/// Line up to 10 mm that is stable between 0 and the first of these depths, between the next two, and so on.
fn line(ends_mm: &[f64]) -> SpeedLine {
    let switches = ends_mm.iter().enumerate().map(|(index, &depth_mm)| Switch {
        depth_mm,
        error_mm: Some(0.0),
        kind: StabilityLoss::Hopf,
        gain: index % 2 == 1,
        chatter_hz: None,
    });
    SpeedLine::of_switches(1000.0, 10.0, 0, switches.collect())
}

#[test]
fn limits_between_the_computed_machines_are_those_of_the_machines() {
    // A cusp of two lobes at 0.3 standard deviations, and an island of stability that vanishes at 1.1.
    let exact = |value: f64| {
        let first = (2.0 / (1.0 + 0.1 * value)).min(2.0 + 0.5 * (0.3 - value));
        if value < 1.1 {
            let half = 0.4 * (1.1_f64 - value).sqrt();
            line(&[first, 5.0 - half, 5.0 + half])
        } else {
            line(&[first])
        }
    };
    let count = Cell::new(0);
    let along = LinesAlong::new(|value| {
        count.set(count.get() + 1);
        Ok(Ok(exact(value)))
    })
    .unwrap();
    // Fewer than a tenth of the 256 machines that are drawn.
    assert!(count.get() < 60, "{}", count.get());
    for step in -290..=290 {
        let value = 0.01 * f64::from(step);
        let (found, exact) = (along.at(value).unwrap(), exact(value));
        if (value - 1.1).abs() < 1.1 * ALONG_GAP {
            continue;
        }
        assert_eq!(found.stable_mm.len(), exact.stable_mm.len(), "{value}");
        for (found, exact) in found
            .stable_mm
            .iter()
            .flatten()
            .zip(exact.stable_mm.iter().flatten())
        {
            // The miss in the middle of a gap is that of the whole gap; next to a kink both halves may miss as much.
            assert!(
                (found - exact).abs() <= 2.0 * ALONG_MISS * exact,
                "{value} {found} {exact}"
            );
        }
    }
}

#[test]
fn machines_that_are_not_valid_stay_so() {
    let along = LinesAlong::new(|value| {
        Ok(if value > -1.3 {
            Ok(line(&[2.0]))
        } else {
            Err("negative".into())
        })
    })
    .unwrap();
    assert!(along.at(-2.9).is_err() && along.at(-1.33).is_err() && along.at(-5.0).is_err());
    assert!(along.at(-1.27).is_ok() && along.at(4.0).is_ok());
}
