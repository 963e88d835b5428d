//! First change of a function to negative values within a time step.

use crate::roots::bisection;

/// Fractions of the time step, after its start, at which a function is evaluated in the search for negative values.
/// They are dense at the start of the step, where a state that has just changed, such as a contact, may change back.
/// Unfounded.
const LOOKED_AT: [f64; 7] = [0.03, 0.12, 0.3, 0.5, 0.7, 0.85, 1.0];

/// Last fraction u in [0, 1] of a time step, to 1e-12, before the first detected negative value of the function `f` of
/// u; `None` if none is detected.
///
/// An interval of negative values is detected if it contains one of seven fixed fractions, or the argument of the
/// minimum of the parabola through three successive evaluated points, of which the middle one is lowest; this minimum
/// must be below half the middle value. A negative value at u = 0 counts as zero, since the state has just changed
/// there.
pub fn first_below_zero(f: impl Fn(f64) -> f64) -> Option<f64> {
    let (mut before, mut last) = ((0.0, f64::NAN), (0.0, f(0.0).max(0.0)));
    for u in LOOKED_AT {
        let here = (u, f(u));
        if here.1 < 0.0 {
            return Some(last_not_below(&f, last.0, u));
        }
        if let Some(dip) = dip(before, last, here)
            && f(dip) < 0.0
        {
            let above = if dip > last.0 { last.0 } else { before.0 };
            return Some(last_not_below(&f, above, dip));
        }
        (before, last) = (last, here);
    }
    None
}

/// Argument of the minimum of the parabola through three points (u, f), of which the middle one is lowest. `None` if
/// another point is lower, a value is not a number, all three values are equal, or the minimum is not below half the
/// middle value, so that f is unlikely to be negative there.
fn dip(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> Option<f64> {
    if a.1.is_nan() || b.1 > a.1 || b.1 > c.1 {
        return None;
    }
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let bend = (right - left) / (c.0 - a.0);
    let u = 0.5 * (a.0 + b.0) - 0.5 * left / bend;
    let lowest = a.1 + left * (u - a.0) + bend * (u - a.0) * (u - b.0);
    (bend > 0.0 && lowest < 0.5 * b.1 && (a.0..c.0).contains(&u)).then_some(u)
}

/// The end nearer to `above` of an interval of 1e-12 in which the sign of `f` changes, by bisection between `above`,
/// where `f` counts as not negative, and `below`, where `f` is negative.
fn last_not_below(f: &impl Fn(f64) -> f64, above: f64, below: f64) -> f64 {
    let [last, _] = bisection([above, below], 1e-12, |u| {
        let is_below = f(u) < 0.0;
        !is_below
    });
    last
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plain_crossing_is_found_and_no_crossing_is_not() {
        let found = first_below_zero(|u| 0.637 - u).unwrap();
        assert!((found - 0.637).abs() < 1e-11);
        assert_eq!(first_below_zero(|u| 1.0 + (9.0 * u).sin()), None);
        assert_eq!(first_below_zero(|u| u), None);
    }

    #[test]
    fn a_minimum_between_two_evaluated_points_is_found() {
        // The function is negative from 0.605 to 0.615 only.
        let found = first_below_zero(|u| (u - 0.61).powi(2) - 2.5e-5).unwrap();
        assert!((found - 0.605).abs() < 1e-9, "{found}");
    }

    #[test]
    fn rounding_at_the_start_is_no_crossing() {
        assert_eq!(first_below_zero(|u| u - 1e-18), None);
        // A function that is negative at 0 and stays negative crosses at once.
        assert_eq!(first_below_zero(|u| -1e-18 - u), Some(0.0));
    }
}
