//! Further springs, dampers and friction along an axis, couplings of two axes, and missing modes, as candidates of cuts.
//!
//! Microslip of joints is not among them: its memory of turning points has no derivative.

use super::candidate::{Candidate, Coordinate};
use super::fit::Fit;
use super::record::ReducedCut;
use crate::baseline::Baseline;
use crate::candidates::cause::Location;
use quietcut_model::effects::EffectName;

/// Force of a nonlinear spring or damper over that of the linear one, at the largest motion of the records.
const NONLINEAR: f64 = 0.3;
/// Damping ratio of a damper with which nonlinear dampers are compared.
pub(super) const DAMPING_RATIO: f64 = 0.05;
/// Compliance of a missing mode over the static compliance of its direction.
const COMPLIANCE: f64 = 0.3;
/// Lowest coordinate of the yield of a hysteresis loop: at a twenty-seventh of the motion, where it is friction.
const EARLIEST_YIELD: f64 = -2.0;
/// Size of an effect with a shape at which it is compared with the records to first order.
pub(super) const FAINT: f64 = 0.01;

/// Sizes of the motion of the baseline along an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Along {
    pub(super) axis: usize,
    /// Static stiffness, N/m.
    stiffness: f64,
    /// Damping that gives the lowest mode the ratio [`DAMPING_RATIO`], N s/m.
    damping: f64,
    /// Largest half range of the displacement, m, and of the velocity, m/s.
    moved_m: f64,
    velocity_m_per_s: f64,
}

/// Sizes along an axis; `None` if the baseline does not move there.
pub(super) fn of_axis(baseline: &Baseline<'_>, fit: &Fit, axis: usize) -> Option<Along> {
    let stiffness = baseline.first_order.receptance(0.0)?[(axis, axis)].re.recip();
    let omega = std::f64::consts::TAU * baseline.lowest_hz()?;
    let [moved, velocity] = fit.half_ranges();
    let is_moved = stiffness.is_finite() && moved[axis] > 0.0;
    is_moved.then(|| Along {
        axis,
        stiffness: stiffness.abs(),
        damping: 2.0 * DAMPING_RATIO * stiffness.abs() / omega,
        moved_m: moved[axis],
        velocity_m_per_s: velocity[axis],
    })
}

pub(super) fn of_restoring_force(along: Along, all: &mut Vec<Candidate>) {
    let place = Location::Axis(along.axis);
    let (x, v) = (along.moved_m, along.velocity_m_per_s);
    let spring_n = NONLINEAR * along.stiffness * x;
    let damper_n = NONLINEAR * along.damping * v;
    let mut one = |effect, key: &'static str, width: f64| {
        let of = move |z: &[f64]| vec![(key, width * z[0])];
        all.push(Candidate::new(effect, place.clone(), vec![Coordinate::FREE], of));
    };
    one(EffectName::CubicStiffness, "k3_n_per_m3", spring_n / x.powi(3));
    one(
        EffectName::QuadraticStiffness,
        "k2_n_per_m2",
        spring_n / x.powi(2),
    );
    one(EffectName::QuinticStiffness, "k5_n_per_m5", spring_n / x.powi(5));
    one(EffectName::CubicDamping, "c3_ns3_per_m3", damper_n / v.powi(3));
    one(
        EffectName::QuadraticDamping,
        "c2_ns2_per_m2",
        damper_n / v.powi(2),
    );
    let regimes = move |z: &[f64]| {
        vec![
            ("k3_n_per_m3", -spring_n / x.powi(3) * z[0]),
            ("k5_n_per_m5", spring_n / x.powi(5) * z[1]),
        ]
    };
    let positive = vec![Coordinate::POSITIVE; 2];
    all.push(
        Candidate::new(EffectName::SofteningHardening, place.clone(), positive, regimes)
            .started_at(vec![vec![FAINT, FAINT], vec![0.3, 0.3]]),
    );
    let friction = move |z: &[f64]| vec![("fc_n", damper_n * z[0])];
    all.push(
        Candidate::new(
            EffectName::CoulombFriction,
            place.clone(),
            vec![Coordinate::POSITIVE],
            friction,
        )
        .vanishing_at_zero(),
    );
    let gap = move |z: &[f64]| vec![("gap_mm", 2e3 * x * z[0])];
    all.push(
        Candidate::new(
            EffectName::Backlash,
            place.clone(),
            vec![Coordinate::POSITIVE],
            gap,
        )
        .vanishing_at_zero()
        .started_at(vec![vec![0.1], vec![0.5]]),
    );
    // One of parallel springs has the gap.
    let partial = move |z: &[f64]| {
        vec![
            ("gap_mm", 1e3 * x * (3.0_f64.ln() * z[1]).exp()),
            ("stiffness_fraction", 1.0 - (-NONLINEAR * z[0]).exp()),
        ]
    };
    let coordinates = vec![Coordinate::POSITIVE, Coordinate::FREE];
    let gaps = [-1.5, -0.5, 0.5].map(|width| vec![FAINT, width]);
    all.push(
        Candidate::new(EffectName::Backlash, place.clone(), coordinates, partial)
            .vanishing_at_zero()
            .started_at(gaps.to_vec()),
    );
    // Yields at a third of the motion; a loop that yields much later is linear, one that yields much earlier is friction.
    let loops = move |z: &[f64]| {
        vec![
            ("hysteretic_stiffness_n_per_m", NONLINEAR * along.stiffness * z[0]),
            ("yield_m", x / 3.0 * (3.0_f64.ln() * z[1]).exp()),
            ("exponent", 1.0 + z[2]),
        ]
    };
    let late = Coordinate {
        lower: EARLIEST_YIELD,
        start: 0.0,
    };
    let coordinates = vec![Coordinate::POSITIVE, late, Coordinate::POSITIVE];
    let yields = [-1.5, 0.0, 1.0].map(|place| vec![FAINT, place, 0.0]);
    all.push(
        Candidate::new(EffectName::Hysteresis, place, coordinates, loops)
            .vanishing_at_zero()
            .started_at(yields.to_vec()),
    );
}

pub(super) fn of_missing_mode(along: Along, records: &[ReducedCut], all: &mut Vec<Candidate>) {
    let lowest_hz = records
        .iter()
        .map(|record| record.conditions.spindle_hz)
        .fold(f64::INFINITY, f64::min);
    let highest_hz = records
        .iter()
        .map(|record| record.conditions.spindle_hz * (record.orders.amplitudes.nrows() - 1) as f64)
        .fold(0.0, f64::max);
    let middle_hz = (lowest_hz * highest_hz).sqrt();
    let half = 0.5 * (highest_hz / lowest_hz).ln();
    let stiffness = along.stiffness;
    let mode = move |z: &[f64]| {
        let hertz = middle_hz * (half * z[1]).exp();
        let omega = std::f64::consts::TAU * hertz;
        let compliance = (COMPLIANCE * z[0]).max(f64::MIN_POSITIVE) / stiffness;
        vec![
            ("frequency_hz", hertz),
            ("damping_ratio", (DAMPING_RATIO * z[2].exp()).min(0.9)),
            ("modal_mass_kg", 1.0 / (compliance * omega * omega)),
        ]
    };
    let coordinates = vec![Coordinate::POSITIVE, Coordinate::FREE, Coordinate::FREE];
    // Neighbouring starts are a third of an octave apart.
    let count = (2.0 * half / (2.0_f64.ln() / 3.0)).ceil().max(2.0) as usize;
    let grid = (0..=count).map(|index| vec![0.0, 2.0 * index as f64 / count as f64 - 1.0, 0.0]);
    all.push(
        Candidate::new(
            EffectName::MissingMode,
            Location::Axis(along.axis),
            coordinates,
            mode,
        )
        .vanishing_at_zero()
        .started_at(grid.collect()),
    );
}

pub(super) fn of_coupling(along: &[Along], all: &mut Vec<Candidate>) {
    for (index, one) in along.iter().enumerate() {
        for other in &along[index + 1..] {
            let place = Location::Axes(one.axis, other.axis);
            let work = NONLINEAR * (one.stiffness * other.stiffness).sqrt();
            let quartic = work / (one.moved_m * other.moved_m);
            let of = move |z: &[f64]| vec![("kxyy_n_per_m3", quartic * z[0])];
            all.push(Candidate::new(
                EffectName::ModeCoupling,
                place.clone(),
                vec![Coordinate::FREE],
                of,
            ));
            let cubic = work / one.moved_m.max(other.moved_m);
            let of = move |z: &[f64]| vec![("kxxy_n_per_m2", cubic * z[0])];
            all.push(Candidate::new(
                EffectName::ModeCoupling,
                place,
                vec![Coordinate::FREE],
                of,
            ));
        }
    }
}
