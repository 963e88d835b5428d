//! Plausibility of the structure of a case: warnings, before limits are computed, about a stiffness at the tool that no
//! machine has.

use std::f64::consts::TAU;

use crate::case::Case;
use crate::criteria::{LEAST_DYNAMIC_STIFFNESS, PLAUSIBLE_STIFFNESS};
use crate::report::digits::significant;

/// Warns about each direction x, y, z of the tool whose static stiffness lies outside [`PLAUSIBLE_STIFFNESS`], or whose
/// dynamic stiffness at a resonance is below [`LEAST_DYNAMIC_STIFFNESS`].
pub(super) fn warn(case: &Case) {
    for warning in warnings(case) {
        tracing::warn!("{warning}");
    }
}

/// The warnings of [`warn()`], at most one for each direction; none if the case has no structure, or if the first-order
/// form of the structure cannot be computed.
fn warnings(case: &Case) -> Vec<String> {
    let Some(first_order) = case
        .structure
        .as_ref()
        .and_then(|structure| structure.first_order().ok())
    else {
        return Vec::new();
    };
    let mut omegas = vec![0.0];
    omegas.extend(
        first_order
            .poles()
            .iter()
            .map(|pole| pole.im)
            .filter(|omega| *omega > 0.0),
    );
    let receptances: Vec<_> = omegas
        .iter()
        .filter_map(|&omega| Some((omega, first_order.receptance(omega)?)))
        .collect();
    (0..3)
        .zip(["x", "y", "z"])
        .filter_map(|(axis, name)| {
            let compliances = receptances
                .iter()
                .map(|(omega, receptance)| (*omega, receptance[(axis, axis)].norm()))
                .filter(|(_, m_per_n)| *m_per_n > 0.0 && m_per_n.is_finite());
            compliances
                .filter_map(|(omega, m_per_n)| implausible(omega, 1.0 / m_per_n))
                .next()
                .map(|reason| {
                    format!(
                        "{}: the structure in {name} is implausible: {reason}; mode shapes (left, right) or matrices may be wrong by a factor such \
                         as 1000: shapes are in SI units (√(1/kg) for real modes); limits may take long and mean nothing",
                        case.path.display()
                    )
                })
        })
        .collect()
}

/// Reason why no machine has the stiffness `n_per_m` at the angular frequency `omega`, rad/s; static at 0. `None` if it
/// is plausible.
fn implausible(omega: f64, n_per_m: f64) -> Option<String> {
    let [softest, stiffest] = PLAUSIBLE_STIFFNESS;
    let is_static = omega == 0.0;
    let least = if is_static {
        softest
    } else {
        LEAST_DYNAMIC_STIFFNESS
    };
    let what = if is_static {
        "its static stiffness is".into()
    } else {
        format!("its dynamic stiffness at {} Hz is", significant(omega / TAU, 4))
    };
    let shown = |n_per_m: f64| format!("{} N/µm", significant(1e-6 * n_per_m, 3));
    if n_per_m < least {
        Some(format!("{what} {}, less than {}", shown(n_per_m), shown(least)))
    } else if is_static && n_per_m > stiffest {
        Some(format!(
            "{what} {}, more than {}",
            shown(n_per_m),
            shown(stiffest)
        ))
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn of(scale: f64) -> Vec<String> {
        let text = format!(
            "[structure]\nkind = \"matrices\"\ndirections = [\"x\"]\nmass = [[{}]]\ndamping = [[{}]]\nstiffness = [[{}]]\n",
            10.0 * scale,
            300.0 * scale,
            1e7 * scale
        );
        warnings(&Case::parse(Path::new("case.toml"), &text).unwrap())
    }

    #[test]
    fn a_structure_that_is_a_thousand_times_too_soft_is_named() {
        assert_eq!(of(1.0), Vec::<String>::new());
        let soft = of(1e-6);
        assert!(soft.len() == 1 && soft[0].contains("less than"), "{soft:?}");
        assert!(of(1e6)[0].contains("more than"));
    }
}
