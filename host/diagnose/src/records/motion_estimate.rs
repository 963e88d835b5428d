//! The motion as far as it is known.

use nalgebra::Vector3;
use num_complex::Complex64;

use crate::baseline::{Baseline, derivatives};
use crate::error::DiagnoseError;
use crate::motion::mean_slopes::MeanSlopes;
use crate::records::channel::{Observed, main_axis};
use crate::records::record::Record;
use crate::signal::noise::{rms, white_floor};
use quietcut_recording::{Quantity, Recording, TestKind};
use quietcut_simulate::path::{SampledMotion, restoring_along};

/// Bins over which power is averaged before it is compared with the noise, to either side.
const AVERAGED: usize = 4;
/// Share of the lowest natural frequency from which on velocity and acceleration are integrated.
const INTEGRATED: f64 = 0.25;
/// Power over noise below which a bin tells nothing.
const HEARD: f64 = 3.0;

/// The motion of a record whose forces drive the model: x̂ = x_model + W·(x_measured − x_model).
///
/// W = 1 − noise/power where what is left of the channels stands out of their noise, else 0 (Wiener): measured where that
/// tells more than the model does. Several channels of an axis are weighted by the noise they mean in displacement.
///
/// Of a cut, whose force hangs on the motion, `slopes` say what the motion is in closed loop: that is what the model predicts, and
/// where the motion is that of a model, to be followed next.
pub(crate) fn learn(
    record: &mut Record,
    baseline: &Baseline<'_>,
    force: &[Option<Vec<Complex64>>; 3],
    slopes: Option<&MeanSlopes>,
) {
    let grid = &record.grid;
    let bins = grid.bins();
    let rate = grid.finer() as f64 * grid.rate_hz();
    let mut motion = SampledMotion {
        step_s: 1.0 / rate,
        ..SampledMotion::default()
    };
    let mut displacement: [Vec<Complex64>; 3] = std::array::from_fn(|_| Vec::new());
    let decay = fine_decay(record, baseline, rate);
    let mut corrections: [Vec<Complex64>; 3] = std::array::from_fn(|_| Vec::new());
    let mut speed_noise = [0.0; 3];
    let mut shares: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::new());
    for &axis in &baseline.axes {
        let correction = correction(record, axis);
        corrections[axis] = correction.spectrum;
        shares[axis] = correction.share;
        speed_noise[axis] = correction.speed_noise;
    }
    let closed = slopes.map(|slopes| in_closed_loop(record, slopes, &corrections));
    if let Some(closed) = closed.as_ref().filter(|_| record.clean.is_some()) {
        corrections.clone_from(closed);
    }
    for &axis in &baseline.axes {
        let x: Vec<Complex64> = (0..bins)
            .map(|bin| {
                let model: Complex64 = force
                    .iter()
                    .enumerate()
                    .filter_map(|(from, force)| {
                        Some(record.transfer[bin][(axis, from)] * force.as_ref()?[bin])
                    })
                    .sum();
                model + corrections[axis][bin]
            })
            .collect();
        let mut v: Vec<Complex64> = x
            .iter()
            .enumerate()
            .map(|(bin, x)| x * Complex64::new(0.0, grid.omega(bin)))
            .collect();
        v[bins - 1] = Complex64::ZERO;
        let with = |mut signal: Vec<f64>, decay: &[f64]| {
            for (signal, decay) in signal.iter_mut().zip(decay) {
                *signal += decay;
            }
            signal
        };
        motion.x[axis] = with(grid.fine_samples(&x), &decay[axis][0]);
        motion.v[axis] = with(grid.fine_samples(&v), &decay[axis][1]);
        motion.rest_m_per_s[axis] = speed_noise[axis] + 0.003 * rms(&motion.v[axis]);
        let coarse: Vec<f64> = motion.x[axis].iter().copied().step_by(grid.finer()).collect();
        displacement[axis] = grid.continued_spectrum(&coarse);
    }
    if record.kind == Some(TestKind::Cutting) {
        let read = |corrections: &[Vec<Complex64>; 3]| -> Vec<Vec<f64>> {
            (0..record.channels.len())
                .map(|channel| reading(record, channel, corrections))
                .collect()
        };
        let readings = read(&corrections);
        let closed = closed.map(|closed| read(&closed));
        record.readings = readings;
        if let Some(closed) = closed {
            record.close(closed);
        }
    }
    record.motion = motion;
    record.displacement = displacement;
    record.measured_share = shares;
}

/// What corrects the motion to that of the closed loop, by axis, where `corrections` make it that of the record.
fn in_closed_loop(
    record: &Record,
    slopes: &MeanSlopes,
    corrections: &[Vec<Complex64>; 3],
) -> [Vec<Complex64>; 3] {
    let mut closed = corrections.clone();
    for bin in 0..record.grid.bins() {
        let off = Vector3::from_fn(|axis, _| corrections[axis].get(bin).copied().unwrap_or_default());
        let step = slopes.closed(record.grid.omega(bin), &record.transfer[bin], off);
        for (axis, closed) in closed.iter_mut().enumerate() {
            if let Some(closed) = closed.get_mut(bin) {
                *closed -= step[axis];
            }
        }
    }
    closed
}

/// What a channel reads: as predicted, with what corrects the motion.
fn reading(record: &Record, channel: usize, corrections: &[Vec<Complex64>; 3]) -> Vec<f64> {
    let grid = &record.grid;
    let observed = &record.channels[channel];
    if observed.pickup.quantity == Quantity::Force {
        return observed.predicted.clone();
    }
    let spectrum: Vec<Complex64> = (0..grid.bins())
        .map(|bin| {
            let corrected: Complex64 = corrections
                .iter()
                .zip(observed.pickup.weights)
                .filter_map(|(correction, weight)| Some(correction.get(bin)? * weight))
                .sum();
            corrected * observed.factor(grid.omega(bin))
        })
        .collect();
    let corrected = grid.samples(&spectrum);
    observed
        .predicted
        .iter()
        .zip(corrected)
        .map(|(predicted, corrected)| predicted + corrected)
        .collect()
}

struct Correction {
    spectrum: Vec<Complex64>,
    /// W.
    share: Vec<f64>,
    /// Noise that it leaves in the velocity, m/s.
    speed_noise: f64,
}

/// W·(x_measured − x_model) along an axis.
fn correction(record: &Record, axis: usize) -> Correction {
    let grid = &record.grid;
    let bins = grid.bins();
    let of_axis: Vec<(&Observed, Vec<Complex64>)> = record
        .channels
        .iter()
        .enumerate()
        .filter(|(_, channel)| channel.pickup.quantity != Quantity::Force && main_axis(channel) == Some(axis))
        .map(|(index, channel)| (channel, grid.continued_spectrum(&record.to_correct(index))))
        .collect();
    let mut spectrum = vec![Complex64::ZERO; bins];
    let mut precision = vec![0.0; bins];
    for (channel, residual) in &of_axis {
        for bin in 0..bins {
            let Some((factor, gain)) = weighed(channel, axis, grid.omega(bin), record.lowest_hz) else {
                continue;
            };
            spectrum[bin] += residual[bin] / factor * gain;
            precision[bin] += gain;
        }
    }
    // Power in units of the noise: of white noise of deviation 1 over the length with its continuation.
    let noise = 0.5 * (grid.count() + grid.length()) as f64;
    let power: Vec<f64> = spectrum
        .iter()
        .zip(&precision)
        .map(|(sum, precision)| {
            if *precision > 0.0 {
                sum.norm_sqr() / precision / noise
            } else {
                0.0
            }
        })
        .collect();
    let mut weights = match record.clean {
        None if !record.amplifies => heard(&power),
        _ => vec![1.0; bins],
    };
    let mut speed_noise = 0.0;
    for bin in 0..bins {
        if weights[bin] > 0.0 && precision[bin] > 0.0 {
            spectrum[bin] *= weights[bin] / precision[bin];
            speed_noise += grid.omega(bin).powi(2) * weights[bin] * weights[bin] / precision[bin];
        } else {
            spectrum[bin] = Complex64::ZERO;
            weights[bin] = 0.0;
        }
    }
    Correction {
        spectrum,
        share: weights,
        speed_noise: (2.0 * speed_noise / grid.length() as f64).sqrt(),
    }
}

/// What becomes of a displacement along an axis in a channel that reads it, and the precision with which the channel then tells of it,
/// 1/m²; `None` where it tells nothing.
pub(crate) fn weighed(
    channel: &Observed,
    axis: usize,
    omega: f64,
    lowest_hz: f64,
) -> Option<(Complex64, f64)> {
    // Integrals of what leaks to low frequencies would bury the motion: there the model is the better witness.
    let is_integral = derivatives(channel.pickup.quantity) > 0;
    if is_integral && omega < INTEGRATED * std::f64::consts::TAU * lowest_hz {
        return None;
    }
    let factor = channel.factor(omega) * channel.pickup.weights[axis];
    let gain = factor.norm_sqr() / (channel.deviation * channel.deviation);
    (gain > 0.0).then_some((factor, gain))
}

/// Wiener's weight of each bin from its power in units of the noise.
fn heard(power: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0; power.len() + 1];
    for (bin, power) in power.iter().enumerate() {
        sums[bin + 1] = sums[bin] + power;
    }
    (0..power.len())
        .map(|bin| {
            let from = bin.saturating_sub(AVERAGED);
            let to = (bin + AVERAGED + 1).min(power.len());
            let mean = (sums[to] - sums[from]) / (to - from) as f64;
            if mean > HEARD { 1.0 - 1.0 / mean } else { 0.0 }
        })
        .collect()
}

/// Displacement and velocity of the record's free decay at the finer samples, by axis.
fn fine_decay(record: &Record, baseline: &Baseline<'_>, rate_hz: f64) -> [[Vec<f64>; 2]; 3] {
    let first_order = &baseline.first_order;
    let count = record.grid.count() * record.grid.finer();
    let step = (&first_order.a / rate_hz).exp();
    let mut state = nalgebra::DVector::from_column_slice(&record.decays.start);
    let velocity = &first_order.c * &first_order.a;
    let mut found: [[Vec<f64>; 2]; 3] = std::array::from_fn(|_| [Vec::new(), Vec::new()]);
    for _ in 0..count {
        for &axis in &baseline.axes {
            found[axis][0].push((first_order.c.row(axis) * &state)[0]);
            found[axis][1].push((velocity.row(axis) * &state)[0]);
        }
        state = &step * state;
    }
    found
}

/// The motion of a record that is judged by its force, and the force that the baseline says it needs.
///
/// Displacement is preferred, then velocity, then acceleration. Bins in which the motion does not stand out of its noise are
/// left out, and so is all beyond the first wide gap of such bins: there derivatives carry no information.
pub(crate) fn compare_forces(
    record: &mut Record,
    baseline: &Baseline<'_>,
    recording: &Recording,
) -> Result<(), DiagnoseError> {
    let grid = record.grid.clone();
    let bins = grid.bins();
    let rate = grid.finer() as f64 * grid.rate_hz();
    let mut motion = SampledMotion {
        step_s: 1.0 / rate,
        ..SampledMotion::default()
    };
    let mut band_hz: f64 = 0.0;
    let mut spectra: [Vec<Complex64>; 3] = std::array::from_fn(|_| Vec::new());
    for &axis in &baseline.axes {
        let channel = [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration]
            .into_iter()
            .map(|quantity| quietcut_simulate::effect::Pickup::of_axis(quantity, axis))
            .find_map(|pickup| Some((derivatives(pickup.quantity), recording.channel(&pickup.name)?)))
            .ok_or_else(|| {
                recording.lacks(format!(
                    "channel of the motion along {}, which a record judged by its force needs",
                    crate::baseline::direction_of(axis)
                ))
            })?;
        let (order, samples) = (channel.0, &channel.1.samples);
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let centered: Vec<f64> = samples.iter().map(|x| x - mean).collect();
        let deviation = white_floor(&centered, rms(&centered));
        let spectrum = grid.continued_spectrum(&centered);
        let noise = 0.5 * (grid.count() + grid.length()) as f64 * deviation * deviation;
        let weights = heard(
            &spectrum
                .iter()
                .map(|bin| bin.norm_sqr() / noise)
                .collect::<Vec<_>>(),
        );
        let last = last_heard(&weights, (bins / 50).max(20));
        band_hz = band_hz.max(grid.omega(last) / std::f64::consts::TAU);
        let x: Vec<Complex64> = (0..bins)
            .map(|bin| {
                let omega = Complex64::new(0.0, grid.omega(bin));
                if bin > last || (bin == 0 && order > 0) {
                    Complex64::ZERO
                } else {
                    spectrum[bin] * weights[bin].max(0.0) / omega.powi(order)
                }
            })
            .collect();
        let v: Vec<Complex64> = x
            .iter()
            .enumerate()
            .map(|(bin, x)| x * Complex64::new(0.0, grid.omega(bin)))
            .collect();
        motion.x[axis] = grid.fine_samples(&x);
        if order == 0 {
            for x in &mut motion.x[axis] {
                *x += mean;
            }
        }
        motion.v[axis] = grid.fine_samples(&v);
        motion.rest_m_per_s[axis] = 0.01 * rms(&motion.v[axis]);
        spectra[axis] = x;
    }
    record.band_hz = band_hz.min(0.5 * grid.rate_hz());
    record.motion = motion;
    record.displacement = spectra;
    predict_forces(record, baseline);
    Ok(())
}

/// The last bin before the first gap of `gap` bins in which nothing is heard.
fn last_heard(weights: &[f64], gap: usize) -> usize {
    let mut last = 0;
    for (bin, weight) in weights.iter().enumerate() {
        if *weight > 0.0 {
            last = bin;
        } else if bin > last + gap {
            break;
        }
    }
    last
}

fn predict_forces(record: &mut Record, baseline: &Baseline<'_>) {
    let grid = record.grid.clone();
    let mut needed: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; grid.count()]);
    for (axis, needed) in needed.iter_mut().enumerate() {
        if baseline.axes.contains(&axis) {
            let spectrum: Vec<Complex64> = (0..grid.bins())
                .map(|bin| {
                    baseline
                        .axes
                        .iter()
                        .map(|from| record.transfer[bin][(axis, *from)] * record.displacement[*from][bin])
                        .sum()
                })
                .collect();
            *needed = grid.samples(&spectrum);
        }
    }
    for term in &baseline.terms {
        let restoring = restoring_along(&**term, &record.motion);
        for (needed, restoring) in needed.iter_mut().zip(&restoring) {
            let coarse = grid.samples_of_fine(&grid.spectrum_of_fine(restoring));
            for (needed, restoring) in needed.iter_mut().zip(coarse) {
                *needed += restoring;
            }
        }
    }
    for channel in &mut record.channels {
        channel.predicted = (0..grid.count())
            .map(|sample| {
                (0..3)
                    .map(|axis| channel.pickup.weights[axis] * needed[axis][sample])
                    .sum()
            })
            .collect();
        channel.deviation = white_floor(&channel.residual(), rms(&channel.measured));
    }
}
