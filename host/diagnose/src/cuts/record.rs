//! A recorded cut, reduced.

use std::f64::consts::TAU;
use std::path::PathBuf;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::amplitude_errors::AmplitudeErrors;
use super::conditions::Conditions;
use super::jumps::OfJumps;
use super::machine::Machine;
use super::no_tachometer;
use super::scatter;
use super::wander;
use crate::baseline::{Baseline, derivatives, pickup_of};
use crate::error::DiagnoseError;
use crate::orders::circle::Circle;
use crate::orders::reduction::{Orders, ReductionSettings};
use crate::orders::spindle_angle::SpindleAngle;
use crate::orders::trend::Trend;
use crate::signal::noise::rms;
use quietcut_model::structure::FirstOrder;
use quietcut_numerics::eigenvalues::eigenvector;
use quietcut_recording::{Quantity, Recording};
use quietcut_stability::cut_orbit::CutOrbit;

/// Range of the highest order of a prediction over that at half the sample rate. Jumps of the force have orders far
/// above, which fold; each unit takes one cell of the spectrum between two lines, of as many cells as there are
/// revolutions, from the estimate of the noise.
const ALIAS_FACTOR: [f64; 2] = [2.0, 8.0];
/// Time after which a record is taken as settled, in slowest decays of the structure, and at most this share of it. What
/// is left of the free decay is fitted.
const SETTLED_DECAYS: f64 = 3.0;
const SETTLED_SHARE: f64 = 0.25;
/// Mains frequencies, Hz, whose harmonics are no chatter, and their deviation in a grid.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
const MAINS_WANDER: f64 = 1e-3;
/// Share of the cells between two lines that aliases may take.
const ALIASED_CELLS: f64 = 0.25;

/// A recorded cut as amplitudes with their errors.
pub(crate) struct ReducedCut {
    /// File of the recording.
    pub path: PathBuf,
    pub orders: Orders,
    pub conditions: Conditions,
    pub errors: AmplitudeErrors,
    /// Where the force jumps.
    pub(super) jumps: OfJumps,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Highest order of a prediction.
    pub highest: usize,
}

impl ReducedCut {
    /// Reduces a recording.
    ///
    /// # Errors
    /// The recording lacks a channel or a value of the cut, or is too short; or the baseline has an undamped mode at an order.
    pub(crate) fn new(baseline: &Baseline<'_>, recording: &Recording) -> Result<Self, DiagnoseError> {
        let names: Vec<&str> = recording
            .channels
            .iter()
            .filter(|channel| {
                let pickup = baseline.pickup(&channel.name);
                pickup.is_some_and(|pickup| {
                    (0..3).all(|axis| pickup.weights[axis] == 0.0 || baseline.axes.contains(&axis))
                })
            })
            .map(|channel| channel.name.as_str())
            .collect();
        let duration_s = recording.len() as f64 / recording.sample_rate_hz;
        let settled_s = (SETTLED_DECAYS * baseline.slowest_decay_s()).min(SETTLED_SHARE * duration_s);
        let [least, most] = ALIAS_FACTOR;
        let settings = |revolutions: f64| ReductionSettings {
            highest_hz: f64::INFINITY,
            alias_factor: (ALIASED_CELLS * revolutions).clamp(least, most),
            slowest_decay_s: baseline.slowest_decay_s(),
            settled_s,
        };
        let angle = match recording.channel("tacho") {
            Some(_) => SpindleAngle::new(recording, settled_s)?,
            None => {
                let rpm = recording.sidecar.cut.and_then(|cut| cut.spindle_rpm);
                let revolutions = (duration_s - settled_s) * rpm.unwrap_or_default() / 60.0;
                no_tachometer::spindle_angle(baseline, recording, &names, &settings(revolutions.floor()))?
            }
        };
        let settings = settings(angle.count() as f64);
        let orders = Orders::with_angle(recording, &names, angle, &settings)?;
        let samples = Sampled::new(recording, &orders);
        let conditions = Conditions::of_record(baseline.case, recording, &orders)?;
        let rate_hz = recording.sample_rate_hz;
        let no_orders = || {
            DiagnoseError::record(
                &recording.path,
                "the case has no orders of this cut: it has an undamped mode at one of them".to_owned(),
            )
        };
        let highest = orders.kernel().aliases();
        let mut machine = Machine::of_baseline(baseline, &conditions, &orders.channels, highest, rate_hz)
            .ok_or_else(no_orders)?;
        // Without an orbit, as of a case with another engagement, errors are those of a rigid tool.
        let orbit = CutOrbit::along_depth(&mut machine.model).ok();
        let jumps = OfJumps::new(&machine, orbit.as_ref(), rate_hz, &orders, &samples.revolutions);
        // Directions in which all orders err together: by slow changes, by a motion that has not settled, where the force
        // jumps, by the spindle angle and speed, and as tooth forces scatter.
        let mut directions = orders.common.directions.clone();
        directions.extend(decays(baseline, recording, &orders, &samples));
        directions.extend_from_slice(&jumps.directions);
        directions.push(smeared(&orders));
        let of_speed = orbit
            .as_ref()
            .and_then(|orbit| wander::directions(baseline, &conditions, &orders, rate_hz, (&machine, orbit)));
        let (mut of_angle, of_trend): (Vec<_>, Vec<_>) = shifted(&orders, &samples)
            .into_iter()
            .map(|[mean, trend]| (mean, trend))
            .unzip();
        if let Some([moved, wandering]) = of_speed {
            of_angle[0] += moved;
            directions.push(wandering);
        }
        directions.extend(of_angle);
        let of_teeth = scatter::directions(&machine, &orders);
        let mut trend_directions = Vec::new();
        if orders.trend.is_some() {
            trend_directions = of_blocks(&orders);
            trend_directions.extend_from_slice(&jumps.trends);
            trend_directions.extend(of_trend);
            trend_directions.extend_from_slice(&of_teeth);
        }
        directions.extend(of_teeth);
        let forces = orbit.map_or_else(
            || scatter::rigid_forces(&machine.model.cutter, highest),
            |orbit| orbit.force_orders(&orbit.order_weights(highest)),
        );
        let coefficients = machine.reading.orders(&forces);
        let errors = AmplitudeErrors::new(&orders, &coefficients, directions, &trend_directions);
        let errors = errors.ok_or_else(|| {
            DiagnoseError::record(
                &recording.path,
                "the noise of a channel is not a number".to_owned(),
            )
        })?;
        Ok(Self {
            path: recording.path.clone(),
            highest,
            rate_hz,
            orders,
            conditions,
            errors,
            jumps,
        })
    }

    /// Times of the record, s, whose half difference in the prediction is that of the trend.
    pub(crate) fn ends_s(&self, trend: &Trend) -> [f64; 2] {
        [-1.0, 1.0].map(|sign| self.conditions.time_s + sign * trend.scale_s)
    }

    /// True if a spectral line of a channel of motion that is no order exceeds the share `of_order` of the largest order,
    /// and its displacement the share `of_feed` of the feed per tooth.
    pub(crate) fn chatters(&self, [of_order, of_feed]: [f64; 2]) -> bool {
        let feed_m = 1e-3 * self.conditions.cut.feed_per_tooth_mm;
        self.orders.lines.iter().any(|line| {
            let pickup = pickup_of(&self.orders.channels[line.channel]);
            let Some(quantity) = pickup
                .map(|pickup| pickup.quantity)
                .filter(|of| *of != Quantity::Force)
            else {
                return false;
            };
            let displacement_m = line.amplitude / (TAU * line.frequency_hz).powi(derivatives(quantity));
            let is_hum = MAINS_HZ.iter().any(|mains_hz| {
                let harmonic = (line.frequency_hz / mains_hz).round();
                let nearest_hz = harmonic * mains_hz;
                harmonic >= 1.0
                    && (line.frequency_hz - nearest_hz).abs()
                        < MAINS_WANDER * nearest_hz + self.resolution_hz()
            });
            let orders = self.orders.amplitudes.column(line.channel);
            let largest = orders
                .iter()
                .skip(1)
                .map(|amplitude| 2.0 * amplitude.norm())
                .fold(0.0, f64::max);
            !is_hum && displacement_m > of_feed * feed_m && line.amplitude > of_order * largest
        })
    }

    /// Distance of two lines that the reduced part of the record separates, Hz.
    fn resolution_hz(&self) -> f64 {
        self.conditions.spindle_hz / self.orders.angle.count() as f64
    }
}

/// The reduced samples.
struct Sampled {
    times_s: Vec<f64>,
    /// Spindle angle, revolutions.
    revolutions: Vec<f64>,
}

impl Sampled {
    fn new(recording: &Recording, orders: &Orders) -> Self {
        let (times_s, revolutions) = orders.sampled(recording);
        Self { times_s, revolutions }
    }
}

/// Directions in which the trend errs as its deviations from block to block show.
fn of_blocks(orders: &Orders) -> Vec<DMatrix<Complex64>> {
    let Some(trend) = &orders.trend else {
        return Vec::new();
    };
    let scale = Complex64::from(trend.variance.sqrt());
    let directions = trend.common.directions.iter();
    directions.map(|direction| direction * scale).collect()
}

/// What the mean over errors of the spindle angle with the variance σ² takes from the orders: Y_k k² σ²/2.
fn smeared(orders: &Orders) -> DMatrix<Complex64> {
    let variance = orders.angle.angle_deviation_rad.powi(2);
    let mut smeared = orders.amplitudes.clone();
    for (order, mut row) in smeared.row_iter_mut().enumerate() {
        row *= Complex64::from(0.5 * variance * (order * order) as f64);
    }
    smeared
}

/// What errors of the spindle angle leave in the orders of a record and in their trend, if they go over it as the
/// Legendre polynomials of the degrees 1 to 4: one standard deviation of the mean speed, then of the angle. The signal at
/// the angle θ + ε(t) differs by ε dy/dθ.
fn shifted(orders: &Orders, Sampled { times_s, revolutions }: &Sampled) -> [[DMatrix<Complex64>; 2]; 4] {
    let circle = Circle::new(orders.amplitudes.nrows() - 1);
    let slopes: Vec<Vec<f64>> = orders
        .amplitudes
        .column_iter()
        .map(|column| {
            let by_angle: Vec<Complex64> = column
                .iter()
                .enumerate()
                .map(|(order, amplitude)| amplitude * Complex64::new(0.0, order as f64))
                .collect();
            let series = circle.series(&by_angle);
            revolutions
                .iter()
                .map(|revolution| series.at(*revolution))
                .collect()
        })
        .collect();
    let (first_s, last_s) = (times_s[0], times_s[times_s.len() - 1]);
    let angle = &orders.angle;
    let tilt = 0.5 * TAU * angle.frequency_deviation_hz * (last_s - first_s);
    std::array::from_fn(|index| {
        let size = if index == 0 {
            tilt
        } else {
            angle.angle_deviation_rad
        };
        let columns: Vec<[DVector<Complex64>; 2]> = slopes
            .iter()
            .map(|slopes| {
                let moved = |(slope, time_s): (&f64, &f64)| {
                    let x = 2.0 * (time_s - first_s) / (last_s - first_s) - 1.0;
                    size * legendre(index + 1, x) * slope
                };
                let samples: Vec<f64> = slopes.iter().zip(times_s).map(moved).collect();
                [
                    orders.of_samples(samples.iter().copied(), revolutions),
                    orders.trend_of(&samples, revolutions),
                ]
                .map(DVector::from_vec)
            })
            .collect();
        [0, 1].map(|part| {
            let columns: Vec<_> = columns.iter().map(|column| column[part].clone()).collect();
            DMatrix::from_columns(&columns)
        })
    })
}

fn legendre(degree: usize, x: f64) -> f64 {
    match degree {
        0 => 1.0,
        1 => x,
        2 => 0.5 * (3.0 * x * x - 1.0),
        3 => 0.5 * (5.0 * x * x - 3.0) * x,
        _ => 0.125 * ((35.0 * x * x - 30.0) * x * x + 3.0),
    }
}

/// Orders that free decays of the structure leave in a reduction: by mode its real and imaginary part, as large at the
/// start as the motion.
fn decays(
    baseline: &Baseline<'_>,
    recording: &Recording,
    orders: &Orders,
    Sampled { times_s, revolutions }: &Sampled,
) -> Vec<DMatrix<Complex64>> {
    let first_s = orders.angle.edges_s()[0];
    let poles = baseline.first_order.poles().into_iter();
    let mut all = Vec::new();
    for pole in poles.filter(|pole| pole.im > 0.0 && pole.re < 0.0) {
        let Some(shape) = mode_shape(&baseline.first_order, pole) else {
            continue;
        };
        // Amplitude of the decay in each channel, over the size of the channel.
        let amplitudes: Vec<Complex64> = orders
            .channels
            .iter()
            .map(|name| amplitude_of(baseline, name, pole, shape))
            .collect();
        let share = orders
            .channels
            .iter()
            .zip(&amplitudes)
            .filter_map(|(name, amplitude)| {
                let size = rms(&recording.channel(name)?.samples);
                Some(amplitude.norm() / size.max(f64::MIN_POSITIVE))
            })
            .fold(0.0, f64::max);
        if share == 0.0 {
            continue;
        }
        for part in [Complex64::ONE, Complex64::i()] {
            let columns: Vec<_> = amplitudes
                .iter()
                .map(|amplitude| {
                    let samples = times_s
                        .iter()
                        .map(|time_s| (amplitude * part / share * (pole * (time_s - first_s)).exp()).re);
                    DVector::from_vec(orders.of_samples(samples, revolutions))
                })
                .collect();
            all.push(DMatrix::from_columns(&columns));
        }
    }
    all
}

/// Amplitude in a channel of the motion of the tool in the mode of a pole.
fn amplitude_of(baseline: &Baseline<'_>, name: &str, pole: Complex64, shape: [Complex64; 3]) -> Complex64 {
    let Some(pickup) = baseline
        .pickup(name)
        .filter(|pickup| pickup.quantity != Quantity::Force)
    else {
        return Complex64::ZERO;
    };
    let moved: Complex64 = pickup
        .weights
        .iter()
        .zip(&shape)
        .map(|(weight, shape)| shape * *weight)
        .sum();
    moved * pole.powi(derivatives(pickup.quantity))
}

/// Motion of the tool along x, y, z in the mode of a pole.
fn mode_shape(structure: &FirstOrder, pole: Complex64) -> Option<[Complex64; 3]> {
    let vector = eigenvector(&structure.a.map(Complex64::from), pole)?;
    let moved = structure.c.map(Complex64::from) * vector;
    Some(std::array::from_fn(|axis| moved[axis]))
}
