//! The error of a method of some order in its step (Richardson).

use num_complex::Complex64;

use crate::criteria::STEP_ROOM;

/// An estimate of |error| of a multiplier from a method of an order p in its step, by comparison with a half and a
/// quarter of the step (Richardson).
///
/// Of what changes with the k-th halving 2^{kp}/(2^{kp} − 1) is the error, by its leading term; the larger of both counts,
/// since with one halving terms may cancel, and three times that, since p holds for small steps only. It is not
/// below `least`, which says what the numbers can hold, relative to max(1, |μ|).
pub(crate) fn step_error(
    whole: Complex64,
    half: Complex64,
    quarter: Complex64,
    order: u32,
    least: f64,
) -> f64 {
    let by_change = |finer: Complex64, halvings: u32| {
        let power = f64::from(halvings * order).exp2();
        (whole - finer).norm() * power / (power - 1.0)
    };
    let change = by_change(half, 1).max(by_change(quarter, 2));
    (STEP_ROOM * change).max(least * whole.norm().max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_step_is_that_of_its_leading_term_with_room() {
        let exact = Complex64::new(0.3, -0.9);
        for order in 1..=4 {
            let with = |step: f64| exact + Complex64::new(0.2, 0.1) * step.powi(order);
            let error = (with(0.1) - exact).norm();
            let stated = step_error(with(0.1), with(0.05), with(0.025), order as u32, 1e-12);
            // The leading term alone is exact: what is stated is three times the error, to rounding.
            assert!((stated - 3.0 * error).abs() < 1e-12, "{order}");
        }
        assert_eq!(step_error(exact, exact, exact, 2, 1e-9), 1e-9);
    }
}
