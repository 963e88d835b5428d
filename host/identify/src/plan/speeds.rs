//! Spindle speeds at which a plan computes limits.

/// Largest relative distance of neighbouring speeds of a plan. A choice: lobes of a low order are resolved, and a test
/// at the nearest speed of the plan differs little from one in between.
const SPEED_STEP: f64 = 0.025;

/// Largest number of speeds of a plan: a limit on computing time. A choice.
const SPEEDS_MAX: f64 = 80.0;

/// Speeds at which a plan computes limits over a range, rev/min: a geometric sequence from its first to its last speed.
///
/// It depends on the range alone, so that plans for different grids of the same range are the same.
pub fn speeds_of_range([first_rpm, last_rpm]: [f64; 2]) -> Vec<f64> {
    let (from, to) = (first_rpm.min(last_rpm), first_rpm.max(last_rpm));
    let gaps = ((to / from).ln() / SPEED_STEP.ln_1p())
        .ceil()
        .min(SPEEDS_MAX - 1.0);
    if gaps.is_nan() || gaps < 1.0 {
        return vec![from];
    }
    (0..=gaps as u32)
        .map(|gap| {
            if f64::from(gap) == gaps {
                to
            } else {
                from * (to / from).powf(f64::from(gap) / gaps)
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_lie_within_the_range_and_are_as_close_as_stated() {
        for (range, count) in [
            ([700.0, 2000.0], 44),
            ([2000.0, 700.0], 44),
            ([100.0, 30_000.0], 80),
        ] {
            let speeds = speeds_of_range(range);
            assert_eq!(speeds.len(), count, "{range:?}");
            assert_eq!(speeds[0], range[0].min(range[1]));
            assert_eq!(*speeds.last().unwrap(), range[0].max(range[1]));
            let steps: Vec<f64> = speeds.windows(2).map(|pair| pair[1] / pair[0] - 1.0).collect();
            // All steps are equal to rounding, and at most the stated one unless their number is bounded.
            assert!(
                steps.iter().all(|step| (step - steps[0]).abs() < 1e-12),
                "{steps:?}"
            );
            assert!(steps[0] <= SPEED_STEP || count == 80, "{steps:?}");
        }
        assert_eq!(speeds_of_range([900.0, 900.0]), [900.0]);
    }
}
