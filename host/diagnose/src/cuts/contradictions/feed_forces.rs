//! Orders of the cutting force of the feed alone, for any engagement and number of teeth.
//!
//! With evenly pitched teeth and without runout the forced motion repeats with the teeth, so that every tooth cuts the
//! surface of one that moved alike: the chip is that of the feed, and the force does not depend on the structure. It is
//! linear in the cutting and edge coefficients c_b,
//!
//! ```text
//! F_k = Σ_b c_b Σ_j e^{ikψ_j} · 1/2π ∫ f_b(φ) e^{−ikφ} dφ, φ from entry to exit,
//! ```
//!
//! with the angle ψ_j of tooth j. Runout adds the chip (r_j − r_i) sin γ behind the tooth i ahead; how the motion follows
//! from it is left out. Integrals from 0° on are tabulated, so that any engagement is a difference of two.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use num_complex::Complex64;
use quietcut_model::Cutter;
use quietcut_model::milling::Material;

/// Number of coefficients: cutting and edge coefficients along three directions.
const COEFFICIENTS: usize = 6;
/// Number of columns: the coefficients, then the cosine and the sine of the runout.
pub(super) const COLUMNS: usize = COEFFICIENTS + 2;
/// Runout of one unit of its columns, m (tool holders: 3 to 20 µm).
const RUNOUT_M: f64 = 10e-6;
/// Steps of the table, at whose middle the forces are taken: half a degree.
const STEPS: usize = 720;

/// Entry and exit, rad, and the angles of the teeth.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Engagement {
    pub start_rad: f64,
    pub exit_rad: f64,
    /// Angle of each tooth and of the one ahead of it, rad, and its feed over the mean feed per tooth.
    pub teeth: Vec<[f64; 3]>,
}

impl Engagement {
    /// That of a tool in a cut.
    pub(super) fn of(cutter: &Cutter) -> Self {
        let tooth = |tooth: &quietcut_model::cutter::Tooth| {
            let ahead = cutter.teeth[tooth.ahead].angle_rad;
            [tooth.angle_rad, ahead, tooth.feed_m / cutter.feed_per_tooth_m]
        };
        Self {
            start_rad: cutter.start_rad,
            exit_rad: cutter.exit_rad,
            teeth: cutter.teeth.iter().map(tooth).collect(),
        }
    }

    /// The same with evenly pitched teeth of another number.
    pub(super) fn with_teeth(&self, teeth: usize) -> Self {
        let pitch_rad = TAU / teeth as f64;
        let tooth = |tooth: usize| {
            let angle_rad = pitch_rad * tooth as f64;
            [angle_rad, angle_rad + pitch_rad, 1.0]
        };
        Self {
            teeth: (0..teeth).map(tooth).collect(),
            ..self.clone()
        }
    }

    /// The same between other angles, rad.
    pub(super) fn between(&self, [start_rad, exit_rad]: [f64; 2]) -> Self {
        Self {
            start_rad,
            exit_rad,
            ..self.clone()
        }
    }
}

/// Tabulated integrals of a tool in a cut.
pub(super) struct FeedForces {
    orders: usize,
    /// By angle of the table, order and part (coefficients, then runout): the integral from 0° on.
    table: Vec<Complex64>,
}

/// Number of tabulated parts: the coefficients, and the chip of the runout.
const PARTS: usize = COEFFICIENTS + 1;

impl FeedForces {
    /// Integrals up to an order; one unit of each coefficient is that of `scale`.
    pub(super) fn new(cutter: &Cutter, scale: &Material, orders: usize) -> Self {
        let width = 3 * PARTS;
        let laws = units(scale).map(|material| cutter.force.with_material(material));
        let step_rad = TAU / STEPS as f64;
        let mut table = vec![Complex64::ZERO; (STEPS + 1) * orders * width];
        for step in 0..STEPS {
            let phi_rad = (step as f64 + 0.5) * step_rad;
            let at = cutter.immersion(phi_rad);
            let chip_m = cutter.recession_m(at, cutter.feed_per_tooth_m).max(0.0);
            let mut values = [[0.0; 3]; PARTS];
            for (value, law) in values.iter_mut().zip(&laws) {
                *value = law.force_n(at, chip_m, cutter.depth_m);
            }
            let slope = cutter.force.slope_n_per_m(at, chip_m.max(1e-9), cutter.depth_m);
            values[COEFFICIENTS] = slope.map(|slope| slope * RUNOUT_M);
            let turn = Complex64::cis(-phi_rad);
            let mut factor = Complex64::from(1.0 / STEPS as f64);
            for order in 0..orders {
                let here = (step * orders + order) * width;
                let next = ((step + 1) * orders + order) * width;
                for (place, value) in values.as_flattened().iter().enumerate() {
                    table[next + place] = table[here + place] + factor * *value;
                }
                factor *= turn;
            }
        }
        Self { orders, table }
    }

    /// Force along x, y, z of one unit of each column at an order.
    pub(super) fn at(&self, engagement: &Engagement, order: usize) -> [Vector3<Complex64>; COLUMNS] {
        let [start, exit] = [engagement.start_rad, engagement.exit_rad].map(|rad| self.integral(rad, order));
        let part = |part: usize| Vector3::from_fn(|axis, _| exit[3 * part + axis] - start[3 * part + axis]);
        let turn = |rad: f64| Complex64::cis(order as f64 * rad);
        let sum = |of: &dyn Fn(&[f64; 3]) -> f64| -> Complex64 {
            engagement
                .teeth
                .iter()
                .map(|tooth| turn(tooth[0]) * of(tooth))
                .sum()
        };
        let by_feed = sum(&|[_, _, feed]| *feed);
        let all = sum(&|_| 1.0);
        let cosine = sum(&|[own, ahead, _]| own.cos() - ahead.cos());
        let sine = sum(&|[own, ahead, _]| own.sin() - ahead.sin());
        std::array::from_fn(|column| match column {
            0..3 => part(column) * by_feed,
            3..COEFFICIENTS => part(column) * all,
            COEFFICIENTS => part(COEFFICIENTS) * cosine,
            _ => part(COEFFICIENTS) * sine,
        })
    }

    /// Integral from 0° to an angle, rad, by part and axis.
    fn integral(&self, rad: f64, order: usize) -> [Complex64; 3 * PARTS] {
        let place = (rad.rem_euclid(TAU) / TAU * STEPS as f64).min(STEPS as f64);
        // A full revolution ends at the last angle of the table.
        let place = if place == 0.0 && rad > 0.0 {
            STEPS as f64
        } else {
            place
        };
        let first = (place as usize).min(STEPS - 1);
        let share = place - first as f64;
        let at = |step: usize| (step * self.orders + order) * 3 * PARTS;
        let (low, high) = (at(first), at(first + 1));
        std::array::from_fn(|index| {
            self.table[low + index] * (1.0 - share) + self.table[high + index] * share
        })
    }
}

/// Materials with one coefficient each.
fn units(scale: &Material) -> [Material; COEFFICIENTS] {
    let none = Material {
        ktc_mpa: 0.0,
        krc_mpa: 0.0,
        kac_mpa: 0.0,
        kte_n_per_mm: 0.0,
        kre_n_per_mm: 0.0,
        kae_n_per_mm: 0.0,
    };
    let mut all = [none; COEFFICIENTS];
    all[0].ktc_mpa = scale.ktc_mpa;
    all[1].krc_mpa = scale.krc_mpa;
    all[2].kac_mpa = scale.kac_mpa;
    all[3].kte_n_per_mm = scale.kte_n_per_mm;
    all[4].kre_n_per_mm = scale.kre_n_per_mm;
    all[5].kae_n_per_mm = scale.kae_n_per_mm;
    all
}
