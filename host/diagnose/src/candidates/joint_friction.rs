//! Microslip of a joint along an axis: f_r += F_J(x) − K_T·x, below slip with the backbone −s·x·(|x|/x_ref)^e and
//! Masing's rules.
//!
//! Shows: with rising amplitude, softening and loss cω that grow with its power e, in the ratio 4e/(π(e + 2)). Does not
//! show: even harmonics, or a dependence on speed. At one level it cannot be told from reduced stiffness and more
//! damping. It is not dry friction, whose damping falls as 1/amplitude, nor a cubic damper, which does not soften, nor
//! a cubic spring, which dissipates nothing. Fit: linear in s; e is a nonlinear parameter, and so are slip_m and β where
//! the whole joint slips; x_ref is a scale and fixed. Source: Segalman, J. Appl. Mech. 72 (2005); Iwan, J. Appl. Mech.
//! 33 (1966).

use super::restoring::{Restoring, largest_m, plain};
use quietcut_model::effects::EffectName;

pub(super) const MICROSLIP: Restoring = Restoring {
    nonlinear_parameters: &["exponent"],
    nonlinear_grid: |_, _| [0.3, 0.6, 1.0].map(|exponent| vec![exponent]).to_vec(),
    bounds: |_, _| vec![EXPONENT],
    // The largest displacement, rounded down to a power of ten.
    fixed: |study, axis| {
        let largest_m = largest_m(study, axis).max(f64::MIN_POSITIVE);
        vec![("reference_m", 10.0_f64.powf(largest_m.log10().floor()))]
    },
    physical: |s| s[0] > 0.0,
    ..plain(EffectName::JointFriction, &["softening_n_per_m"])
};

pub(super) const SLIP: Restoring = Restoring {
    nonlinear_parameters: &["exponent", "slip_m", "beta"],
    nonlinear_grid: |study, axis| {
        let largest_m = largest_m(study, axis);
        [0.1, 0.3, 0.7]
            .map(|slip| vec![0.5, slip * largest_m, 0.5])
            .to_vec()
    },
    bounds: |study, axis| {
        let largest_m = largest_m(study, axis);
        vec![EXPONENT, [0.01 * largest_m, largest_m], [0.0, 10.0]]
    },
    ..MICROSLIP
};

const EXPONENT: [f64; 2] = [0.05, 1.0];
