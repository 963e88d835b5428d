//! Richardson's error estimate of a Floquet multiplier (characteristic multiplier), for a method of known order in its
//! step.

use num_complex::Complex64;

use crate::criteria::STEP_ROOM;

/// Error estimate |error| of a multiplier from a method of order p in its step, from the results with half and a
/// quarter of the step (Richardson).
///
/// By the leading term, the error with the whole step is 2^{kp}/(2^{kp} − 1) times the change after k halvings. The
/// larger of the estimates for k = 1 and 2 is used, since terms may cancel after one halving, times three, since the
/// order holds for small steps only. The result is at least `least` (rounding), relative to max(1, |μ|).
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
    fn the_error_of_a_step_is_that_of_its_leading_term_with_a_safety_factor() {
        let exact = Complex64::new(0.3, -0.9);
        for order in 1..=4 {
            let with = |step: f64| exact + Complex64::new(0.2, 0.1) * step.powi(order);
            let error = (with(0.1) - exact).norm();
            let stated = step_error(with(0.1), with(0.05), with(0.025), order as u32, 1e-12);
            // The error has the leading term alone, so that the stated error is three times the true one.
            assert!((stated - 3.0 * error).abs() < 1e-12, "{order}");
        }
        assert_eq!(step_error(exact, exact, exact, 2, 1e-9), 1e-9);
    }
}
