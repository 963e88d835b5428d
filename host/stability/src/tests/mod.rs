//! Tests across the rooms, with the oracle of Taylor series that shares no code with them.

mod agreement;
mod between_speeds;
mod cells;
mod extensions;
mod fitted;
mod frequency;
mod line;
mod multipliers;
mod properties;
mod random;
mod scan;
mod sensitivity;
mod speed_dependence;
mod taylor;
mod uncertainty;
mod variable_pitch;

use num_complex::Complex64;

use crate::{CubicTerms, Problem};
use quietcut_model::case::Case;
use quietcut_testkit::case;

pub(crate) fn problem(name: &str) -> Problem {
    Problem::new(&case(name), CubicTerms::Refuse).unwrap()
}

/// Spindle speed, rev/min, of a tooth period τ in the dimensionless units of chapter 6.
pub(crate) fn rpm_of(tau: f64) -> f64 {
    30.0 * 109.6416 / tau
}
/// Case with random modes (1 to 4), tool (1 to 8 teeth), material and cut (any immersion).
pub(crate) fn random_case(rng: &mut impl rand::Rng) -> Case {
    use quietcut_model::milling::{Cut, Material, Tool};
    use quietcut_model::structure::{Direction, Form, Mode, Structure};
    use rand::RngExt;

    let mut case = case("kuka-kr90-acetal");
    let modes = (0..rng.random_range(1..=4))
        .map(|_| {
            let frequency_hz = 10.0_f64.powf(rng.random_range(1.0..3.0));
            let omega = std::f64::consts::TAU * frequency_hz;
            let stiffness = 10.0_f64.powf(rng.random_range(5.5..7.5));
            // With mode shape ψ the residue ψψᵀ ω/(2ik) belongs to a mode of stiffness k; a random phase of ψ makes the
            // mode complex.
            let size = (omega / (2.0 * stiffness)).sqrt();
            let shape: Vec<Complex64> = (0..3)
                .map(|_| {
                    Complex64::from_polar(size * rng.random_range(-1.0..1.0), rng.random_range(-0.2..0.2))
                })
                .collect();
            Mode {
                frequency_hz,
                damping_ratio: 10.0_f64.powf(rng.random_range(-2.5..-0.7)),
                left: shape.iter().map(|entry| entry * -Complex64::I).collect(),
                right: shape,
            }
        })
        .collect();
    case.structure = Some(Structure {
        directions: vec![Direction::X, Direction::Y, Direction::Z],
        form: Form::Modes(modes),
    });
    let teeth = rng.random_range(1..=8);
    let start_deg: f64 = rng.random_range(0.0..170.0);
    case.tool = Some(Tool {
        teeth,
        edge_angle_deg: rng.random_range(30.0..90.0),
        diameter_mm: None,
        pitch_deg: vec![360.0 / teeth as f64; teeth],
        runout: None,
    });
    let ktc_mpa = 10.0_f64.powf(rng.random_range(1.8..3.3));
    case.material = Some(Material {
        ktc_mpa,
        krc_mpa: ktc_mpa * rng.random_range(0.0..0.8),
        kac_mpa: ktc_mpa * rng.random_range(0.0..0.4),
        kte_n_per_mm: 20.0,
        kre_n_per_mm: 20.0,
        kae_n_per_mm: 5.0,
    });
    case.cut = Some(Cut {
        start_deg,
        exit_deg: rng.random_range(start_deg + 1.0..180.0),
        feed_per_tooth_mm: 0.1,
        feed_direction_deg: rng.random_range(0.0..360.0),
    });
    if rng.random_bool(0.7) {
        case.extensions.clear();
    }
    case
}
