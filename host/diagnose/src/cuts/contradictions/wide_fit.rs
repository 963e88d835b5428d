//! Fit of a record by the force of the feed with all that a machine may differ in.
//!
//! Free are cutting and edge coefficients, runout, the angles of entry and exit, the phase of the tachometer, a common
//! factor of the natural frequencies, a mass, a damper and a spring at the tool along each axis, and gain and delay of
//! each channel. With the dynamic stiffness Z of the baseline on the axes along which it moves, the receptance is
//!
//! ```text
//! H(ω)⁻¹ = Z(sω) + diag(δk + iω δc − ω² δm).
//! ```
//!
//! No orbit is computed: the fit takes milliseconds and cannot fail to converge. It leaves out what regeneration makes of
//! runout, loss of contact and nonlinear effects, for which the orders have an allowance.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Vector3};
use num_complex::Complex64;

use super::alternative::Alternative;
use super::feed_forces::COLUMNS;
use super::screen::{LEAST_CUTTING, Screen};
use crate::baseline::derivatives;
use quietcut_recording::Quantity;

/// Standard deviation, and the largest change in standard deviations, of each kind of variable.
#[derive(Clone, Copy)]
struct Width {
    deviation: f64,
    most: f64,
}

const fn width(deviation: f64, most: f64) -> Width {
    Width { deviation, most }
}

/// Coefficients and runout in the units of the screen: up to three deviations.
const LINEAR: Width = width(1.0, 3.0);
/// Logarithm of the common factor of natural frequencies: a stiffness changed by up to a factor of two.
const FREQUENCY: Width = width(0.15, 2.3);
/// Added spring, damper and mass over those of the baseline: from a half to the double.
const ADDED: [Width; 3] = [width(0.3, 1.7), width(0.5, 4.0), width(0.3, 1.7)];
/// Logarithm of a gain: from a half to the double. Data sheets promise a few per cent; a wrong setting of an amplifier is
/// a cause of its own.
const GAIN: Width = width(0.1, 6.9);
/// Delay, in samples.
const DELAY: Width = width(1.0, 6.0);
/// Angles of entry and exit, degrees, if they are given: a radial depth that is off by 2 % of the radius, at 60°. If they
/// are sought, all of the half circle.
const GIVEN_ANGLE: Width = width(1.5, 3.0);
const SOUGHT_ANGLE: Width = width(30.0, 6.0);
/// Least and largest deviation of the phase of the tachometer, rad.
const PHASE: [f64; 2] = [1e-3, 0.05];
/// Steps of the method of Levenberg and Marquardt, and the decrease of the cost below which it has converged.
const STEPS: usize = 25;
const CONVERGED: f64 = 1e-2;
/// Starts of the frequencies, in deviations.
const STARTS: [f64; 3] = [0.0, 1.0, -1.0];

/// Places of the variables after coefficients and runout.
const PLACE_FREQUENCY: usize = COLUMNS;
const PLACE_ADDED: usize = PLACE_FREQUENCY + 1;
const PLACE_ANGLES: usize = PLACE_ADDED + 9;
const PLACE_PHASE: usize = PLACE_ANGLES + 2;
const PLACE_CHANNELS: usize = PLACE_PHASE + 1;

/// A fitted record.
pub(super) struct WideFit {
    /// χ² of the orders, with their allowance, and the sum of squares of the variables.
    pub cost: f64,
    /// Largest |ln gain| of a sensor.
    pub largest_gain: f64,
    /// Fitted entry and exit, degrees.
    pub engagement_deg: [f64; 2],
}

/// The best fit of the orders with an input; `None` if the receptance is singular.
pub(super) fn wide_fit(
    screen: &Screen<'_>,
    alternative: Option<&Alternative>,
    thorough: bool,
) -> Option<WideFit> {
    let problem = Problem::new(screen, alternative);
    let starts = if thorough { &STARTS[..] } else { &STARTS[..1] };
    let fits = starts.iter().filter_map(|start| {
        let mut z = DVector::zeros(problem.widths.len());
        z[PLACE_FREQUENCY] = *start;
        problem.fit(z)
    });
    let (cost, z) = fits.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let gains =
        (0..screen.channels.len()).map(|channel| problem.value(&z, PLACE_CHANNELS + 2 * channel).abs());
    Some(WideFit {
        cost,
        largest_gain: gains.fold(0.0, f64::max),
        engagement_deg: problem.engagement(&z).map(f64::to_degrees),
    })
}

/// Least costs of a record with the structure of the baseline: as it is, with natural frequencies times `ratio`, and with
/// them times any factor. `None` if the receptance is singular.
pub(super) fn frequency_costs(screen: &Screen<'_>, ratio: f64) -> Option<[f64; 3]> {
    let cost = |factor: f64, is_free: bool| {
        let mut problem = Problem::new(screen, None);
        problem.frequency_factor = factor;
        let last = if is_free { PLACE_ADDED } else { PLACE_FREQUENCY };
        for held in &mut problem.widths[last..PLACE_ANGLES] {
            held.most = 0.0;
        }
        Some(problem.fit(DVector::zeros(problem.widths.len()))?.0)
    };
    Some([cost(1.0, false)?, cost(ratio, false)?, cost(ratio, true)?])
}

/// The variables of a record with one input.
struct Problem<'a, 'b> {
    screen: &'a Screen<'b>,
    widths: Vec<Width>,
    /// Entry and exit at z = 0, rad.
    angles_rad: [f64; 2],
    /// Factor of the natural frequencies at z = 0.
    frequency_factor: f64,
    alternative: Option<&'a Alternative>,
}

impl<'a, 'b> Problem<'a, 'b> {
    fn new(screen: &'a Screen<'b>, alternative: Option<&'a Alternative>) -> Self {
        let mut widths = vec![LINEAR; COLUMNS];
        widths.push(FREQUENCY);
        for _ in 0..3 {
            widths.extend(ADDED);
        }
        let angle = match alternative {
            Some(Alternative::Engagement(_)) => SOUGHT_ANGLE,
            _ => GIVEN_ANGLE,
        };
        widths.extend([angle; 2]);
        let phase_rad = screen
            .record
            .orders
            .angle
            .phase_deviation_rad
            .clamp(PHASE[0], PHASE[1]);
        widths.push(width(phase_rad, 3.0));
        for _ in &screen.channels {
            widths.extend([GAIN, DELAY]);
        }
        let engagement = screen.engagement_of(alternative);
        Self {
            screen,
            widths,
            angles_rad: [engagement.start_rad, engagement.exit_rad],
            frequency_factor: 1.0,
            alternative,
        }
    }

    fn value(&self, z: &DVector<f64>, place: usize) -> f64 {
        self.widths[place].deviation * z[place]
    }

    /// Entry and exit, rad.
    fn engagement(&self, z: &DVector<f64>) -> [f64; 2] {
        let at = |index: usize| self.angles_rad[index] + self.value(z, PLACE_ANGLES + index).to_radians();
        let [start, exit] = [at(0).max(0.0), at(1)];
        [start, exit.max(start)]
    }

    /// Receptances of the baseline at the orders, its natural frequencies times a factor.
    fn receptances(&self, z: &DVector<f64>) -> Option<Vec<Matrix3<Complex64>>> {
        let factor = self.frequency_factor * self.value(z, PLACE_FREQUENCY).exp();
        let hertz = self.screen.record.conditions.spindle_hz / factor;
        let at = |order: usize| self.screen.structure.receptance(TAU * hertz * order as f64);
        (0..self.screen.orders).map(at).collect()
    }

    /// Measured minus predicted orders in standard deviations.
    fn residual(&self, z: &DVector<f64>, receptances: &[Matrix3<Complex64>]) -> Option<DVector<f64>> {
        let screen = self.screen;
        let engagement = screen.engagement_of(self.alternative).between(self.engagement(z));
        let coefficients: Vec<f64> = (0..COLUMNS)
            .map(|column| screen.mean[column] + screen.deviation[column] * z[column])
            .collect();
        let sources = screen.sources(self.alternative);
        let phase_rad = self.value(z, PLACE_PHASE);
        let mut residual = Vec::with_capacity(screen.count());
        for (order, receptance) in receptances.iter().enumerate().skip(1) {
            let columns = screen.forces.at(&engagement, order);
            let sum: Vector3<Complex64> = columns
                .iter()
                .zip(&coefficients)
                .map(|(column, coefficient)| column * Complex64::from(*coefficient))
                .sum();
            let force = sum * Complex64::cis(order as f64 * phase_rad);
            let omega = TAU * screen.record.conditions.spindle_hz * order as f64;
            let moved = self.with_added(receptance, omega, z)? * force;
            for (channel, (source, factor)) in sources.iter().enumerate() {
                let predicted = self.read(channel, omega, &force, &moved, z);
                let measured = screen.record.orders.amplitudes[(order, *source)] * *factor;
                let error = (measured - predicted) / screen.deviation_of(order, *source, *factor);
                residual.extend([error.re, error.im].map(|part| part * 2.0_f64.sqrt()));
            }
        }
        Some(DVector::from_vec(residual))
    }

    /// Receptance with a mass, a damper and a spring at the tool.
    fn with_added(
        &self,
        receptance: &Matrix3<Complex64>,
        omega: f64,
        z: &DVector<f64>,
    ) -> Option<Matrix3<Complex64>> {
        let axes = &self.screen.axes;
        let block = DMatrix::from_fn(axes.len(), axes.len(), |i, j| receptance[(axes[i], axes[j])]);
        let mut stiffness = block.try_inverse()?;
        for (index, axis) in axes.iter().enumerate() {
            let [spring, damper, mass] =
                std::array::from_fn(|kind| self.value(z, PLACE_ADDED + 3 * axis + kind));
            let [k, c, m] = self.screen.at_tool[*axis];
            stiffness[(index, index)] +=
                Complex64::new(spring * k - omega * omega * mass * m, omega * damper * c);
        }
        let changed = stiffness.try_inverse()?;
        let mut whole = Matrix3::zeros();
        for (i, row) in axes.iter().enumerate() {
            for (j, column) in axes.iter().enumerate() {
                whole[(*row, *column)] = changed[(i, j)];
            }
        }
        Some(whole)
    }

    /// Order of a channel under a force and a displacement of the tool.
    fn read(
        &self,
        channel: usize,
        omega: f64,
        force: &Vector3<Complex64>,
        moved: &Vector3<Complex64>,
        z: &DVector<f64>,
    ) -> Complex64 {
        let pickup = &self.screen.pickups[channel];
        let s = Complex64::new(0.0, omega);
        let value = match pickup.quantity {
            Quantity::Force => *force,
            quantity => moved * s.powi(derivatives(quantity)),
        };
        let sum: Complex64 = pickup
            .weights
            .iter()
            .zip(value.iter())
            .map(|(weight, value)| value * *weight)
            .sum();
        let place = PLACE_CHANNELS + 2 * channel;
        let gain = self.value(z, place).exp();
        let delay_s = pickup.delay_s + self.value(z, place + 1) / self.screen.record.rate_hz;
        sum * gain * pickup.dynamics(s) * (-s * delay_s).exp()
    }

    fn bounded(&self, mut z: DVector<f64>) -> DVector<f64> {
        for (place, value) in z.iter_mut().enumerate() {
            let most = self.widths[place].most;
            *value = value.clamp(-most, most);
            if place < COLUMNS {
                // A coefficient keeps the sign that the case gives it.
                let [mean, deviation] = [self.screen.mean[place], self.screen.deviation[place]];
                if place < 3 && mean > 0.0 {
                    *value = value.max((LEAST_CUTTING - 1.0) * mean / deviation);
                }
            }
        }
        z
    }

    /// Least cost, with its variables, from a start.
    fn fit(&self, start: DVector<f64>) -> Option<(f64, DVector<f64>)> {
        let mut z = self.bounded(start);
        let mut receptances = self.receptances(&z)?;
        let mut residual = self.residual(&z, &receptances)?;
        let mut cost = residual.norm_squared() + z.norm_squared();
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let jacobian = self.jacobian(&z, &receptances, &residual)?;
            let gradient = jacobian.tr_mul(&residual) + &z;
            let normal = jacobian.tr_mul(&jacobian);
            let mut gained = 0.0;
            while gained <= 0.0 && damping < 1e6 {
                let mut matrix = normal.clone();
                for place in 0..z.len() {
                    matrix[(place, place)] += 1.0 + damping * normal[(place, place)];
                }
                let moved = self.bounded(&z - Cholesky::new(matrix)?.solve(&gradient));
                let tried = self.receptances(&moved)?;
                let left = self.residual(&moved, &tried)?;
                let new = left.norm_squared() + moved.norm_squared();
                gained = cost - new;
                if gained > 0.0 {
                    (z, receptances, residual, cost) = (moved, tried, left, new);
                    damping = (0.1 * damping).max(1e-9);
                } else {
                    damping *= 10.0;
                }
            }
            if gained < CONVERGED * (1.0 + 1e-3 * cost) {
                break;
            }
        }
        Some((cost, z))
    }

    /// Derivatives of the residual by differences.
    fn jacobian(
        &self,
        z: &DVector<f64>,
        receptances: &[Matrix3<Complex64>],
        residual: &DVector<f64>,
    ) -> Option<DMatrix<f64>> {
        const STEP: f64 = 1e-4;
        let columns: Option<Vec<DVector<f64>>> = (0..z.len())
            .map(|place| {
                let mut moved = z.clone();
                moved[place] += STEP;
                let after = if place == PLACE_FREQUENCY {
                    self.residual(&moved, &self.receptances(&moved)?)?
                } else {
                    self.residual(&moved, receptances)?
                };
                Some((after - residual) / STEP)
            })
            .collect();
        Some(DMatrix::from_columns(&columns?))
    }
}
