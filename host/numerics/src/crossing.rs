//! Where a smooth function of a step first goes below zero.

/// Places that are looked at: dense at the start, where contact that has just changed may change back.
const LOOKED_AT: [f64; 7] = [0.03, 0.12, 0.3, 0.5, 0.7, 0.85, 1.0];

/// The last u in [0, 1] before `f` is first negative, to 1e-12; `None` where it stays at or above zero.
///
/// Found are all stretches below zero that contain a place looked at, and those between two such places into which a
/// parabola through three of them dips. A value below zero at 0 itself counts as zero: contact that has just changed.
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

/// Where a parabola through three points, the middle one lowest, comes down to less than half of the middle one: there
/// the function itself may be below zero.
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

/// The change of sign between `above`, where `f` is not negative, and `below`, where it is, by bisection.
fn last_not_below(f: &impl Fn(f64) -> f64, mut above: f64, mut below: f64) -> f64 {
    while below - above > 1e-12 {
        let u = 0.5 * (above + below);
        if f(u) < 0.0 { below = u } else { above = u }
    }
    above
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
    fn a_dip_between_two_places_is_found() {
        // Below zero from 0.605 to 0.615 only.
        let found = first_below_zero(|u| (u - 0.61).powi(2) - 2.5e-5).unwrap();
        assert!((found - 0.605).abs() < 1e-9, "{found}");
    }

    #[test]
    fn what_has_just_changed_is_not_changed_back_by_rounding() {
        assert_eq!(first_below_zero(|u| u - 1e-18), None);
        // But where it really goes on below, it changes at once.
        assert_eq!(first_below_zero(|u| -1e-18 - u), Some(0.0));
    }
}
