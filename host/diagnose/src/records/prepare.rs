//! Builds records, in three stages.
//!
//! 1. [`opened`]: channels, transforms and transfer functions of a recording that passed its checks.
//! 2. The prediction of the baseline, and with it the motion: [`response_prediction`] for a test of the structure,
//!    [`cut_prediction`] for a cut, [`motion_estimate`] if forces are compared.
//! 3. [`checked`], unless forces are compared: refuses a record if the amplitude of its channels shows a wrong unit.

use crate::baseline::Baseline;
use crate::baseline::dynamic_stiffness;
use crate::baseline::receptance::{Receptance, response};
use crate::criteria::{LARGEST_FORCE_NOISE, MOTION_BAND_SHARE};
use crate::error::DiagnoseError;
use crate::motion::free_decay::Decays;
use crate::records::channel::{Observed, main_axis};
use crate::records::domain::Domain;
use crate::records::record::{Known, Record};
use crate::records::{checks, cut_prediction, motion_estimate, response_prediction};
use crate::signal::grid::Grid;
use crate::signal::noise::{BANDS, floor_between_impacts, rms, white_floor};
use quietcut_recording::{Quantity, Recording, TestKind};
use quietcut_simulate::path::SampledMotion;

/// Oversampling factor of the time grid on which the cutting force and the motion of a recorded cut are computed. It is
/// high because the force jumps when teeth enter and leave the workpiece.
const FINER_IN_CUTS: usize = 8;

/// Prepares a recording for comparison: a record with the prediction of the baseline.
///
/// # Errors
/// The recording cannot be compared. It is, for example, too short, clipped, without a required channel, in a wrong
/// unit, or of a kind without a known excitation.
pub(super) fn prepare(
    baseline: &Baseline<'_>,
    recording: &Recording,
    known: Known,
) -> Result<Record, DiagnoseError> {
    let amplifies = known.amplifies;
    let record = opened(baseline, recording, known)?;
    match record.domain {
        Domain::Response if is_cut(recording) => {
            let record = cut_prediction::predicted(record, baseline, recording, amplifies)?;
            checked(record)
        }
        Domain::Response => checked(response_prediction::predicted(record, baseline)),
        Domain::Force => {
            let mut record = record;
            motion_estimate::compare_forces(&mut record, baseline, recording)?;
            Ok(record)
        }
    }
}

fn is_cut(recording: &Recording) -> bool {
    recording.sidecar.kind == Some(TestKind::Cutting)
}

/// Starts a record: channels, transforms and transfer functions, still without the prediction of the baseline.
fn opened(baseline: &Baseline<'_>, recording: &Recording, known: Known) -> Result<Record, DiagnoseError> {
    let domain = Domain::of(baseline, recording)?;
    let is_cut = recording.sidecar.kind == Some(TestKind::Cutting);
    // In a cut the baseline predicts the force; a measured force is compared with it and is no input.
    let force_n = if is_cut {
        std::array::from_fn(|_| Vec::new())
    } else {
        forces(baseline, recording)
    };
    let mut channels = channels(baseline, recording, domain);
    checks::record(baseline, recording, &channels)?;
    let highest_hz = highest_hz(recording);
    let rate_hz = recording.sample_rate_hz;
    // The upsampled grid must represent harmonics of nonlinear restoring forces up to 16 times `highest_hz`, the upper
    // end of the band of the measured motion: they lie below half the upsampled rate. The oversampling factor does not
    // exceed 8, even if fewer harmonics are then represented.
    let finer = ((32.0 * highest_hz / rate_hz).ceil() as usize)
        .clamp(if is_cut { FINER_IN_CUTS } else { 1 }, 8)
        .next_power_of_two();
    // Duration of the zero padding of a record, in longest time constants of the structure. In a cut it may be shorter:
    // the circular convolution wraps the decay after the end of the record around to its beginning, where the fitted
    // free decay contains it.
    let decays = if is_cut { 2.0 } else { 8.0 };
    let room_s = decays * baseline.slowest_decay_s();
    let grid = Grid::new(recording.len(), rate_hz, room_s, finer);
    let transfer = match domain {
        Domain::Response => response(&baseline.receptance, &grid),
        Domain::Force => {
            dynamic_stiffness::table(&baseline.altered, &baseline.first_order, &baseline.axes, &grid)
        }
    };
    for channel in channels
        .iter_mut()
        .filter(|channel| !channel.pickup.modes.is_empty())
    {
        let seen = baseline.first_order.at_sensor(&channel.pickup.modes);
        channel.seen = Some(response(&Receptance::new(&seen), &grid));
    }
    let count = channels.len();
    let mut record = Record {
        path: recording.path.clone(),
        kind: recording.sidecar.kind,
        domain,
        elsewhere: elsewhere(recording),
        grid,
        channels,
        force_deviation_n: force_n
            .each_ref()
            .map(|force| floor_n(force, recording.sidecar.kind)),
        force_n,
        motion: SampledMotion::default(),
        displacement: std::array::from_fn(|_| Vec::new()),
        readings: Vec::new(),
        closed: None,
        highest_hz,
        lowest_hz: baseline.lowest_hz().unwrap_or(0.0),
        // The harmonics of a cutting force reach up to half the sample rate and beyond.
        band_hz: if is_cut {
            0.5 * rate_hz
        } else {
            (6.0 * highest_hz).min(0.5 * rate_hz)
        },
        transfer,
        responses: Vec::new(),
        compared: 0..recording.len(),
        skipped: vec![Vec::new(); count],
        decays: Decays::default(),
        cut: None,
        clean: known.clean,
        amplifies: false,
        measured_share: std::array::from_fn(|_| Vec::new()),
    };
    if domain == Domain::Response {
        let of = |channel| record.responses_by(channel, record.seen_by(channel), &baseline.axes);
        record.responses = record.channels.iter().map(of).collect();
    }
    Ok(record)
}

/// Returns the record unless the amplitude of a checked channel shows a wrong unit; a cut is returned if one checked
/// channel passes, or if none is checked. In a cut only channels of motion are checked here; its forces were checked
/// when its channels were first predicted.
fn checked(record: Record) -> Result<Record, DiagnoseError> {
    let is_cut = record.kind == Some(TestKind::Cutting);
    let checked = |(index, channel): (usize, &Observed)| {
        // A channel along an axis without force is not checked: a small cross-axis sensitivity of its sensor may exceed
        // the predicted motion.
        let axis = main_axis(channel)?;
        if record.force_n[axis].is_empty() || is_cut && channel.pickup.quantity == Quantity::Force {
            return None;
        }
        let range = record.compared.clone();
        let response = record.decays.without(index, &channel.predicted);
        let (response, measured) = (&response[range.clone()], &channel.measured[range]);
        let by_noise = energy_by_force_noise(&record, index);
        let name = &channel.pickup.name;
        let path = &record.path;
        if record.kind == Some(TestKind::Hammer)
            && let Err(inverted) = checks::sign(path, name, response, measured)
        {
            return Some(Err(inverted));
        }
        Some(checks::unit(path, name, response, measured, by_noise))
    };
    let mut checked = record.channels.iter().enumerate().filter_map(checked);
    if is_cut {
        checks::unless_one_is_right(checked)?;
    } else {
        checked.try_for_each(|checked| checked)?;
    }
    Ok(record)
}

/// Expected energy Σ y² of a channel's response y to force-sensor noise, over the samples of the record.
fn energy_by_force_noise(record: &Record, channel: usize) -> f64 {
    let power = record.power_by_force_noise(channel);
    power.iter().sum::<f64>() / BANDS as f64 * record.grid.count() as f64
}

/// Measured forces along the axes of the baseline, N, divided by the gains of the force sensors in the baseline; empty
/// along an axis without force channel, or along which the structure does not move.
fn forces(baseline: &Baseline<'_>, recording: &Recording) -> [Vec<f64>; 3] {
    std::array::from_fn(|axis| {
        let name = ["fx", "fy", "fz"][axis];
        let Some(channel) = recording.channel(name).filter(|_| baseline.axes.contains(&axis)) else {
            return Vec::new();
        };
        let weight = baseline.pickup(name).map_or(1.0, |pickup| pickup.weights[axis]);
        channel.samples.iter().map(|force| force / weight).collect()
    })
}

fn floor_n(force_n: &[f64], kind: Option<TestKind>) -> f64 {
    let size = rms(force_n);
    let between_impacts_n = if kind == Some(TestKind::Hammer) {
        floor_between_impacts(force_n)
    } else {
        f64::INFINITY
    };
    if size > 0.0 {
        white_floor(force_n, size)
            .min(between_impacts_n)
            .min(LARGEST_FORCE_NOISE * size)
    } else {
        0.0
    }
}

/// Values of `at` in a sidecar, in lower case, that mean the tool tip.
const TOOL_TIP: [&str; 5] = ["tool-tip", "tool tip", "tip", "tcp", "tool"];

fn elsewhere(recording: &Recording) -> Vec<String> {
    recording
        .sidecar
        .channels
        .iter()
        .filter(|(_, known)| {
            known
                .at
                .as_deref()
                .is_some_and(|at| !TOOL_TIP.contains(&at.to_lowercase().as_str()))
        })
        .map(|(name, known)| known.name.clone().unwrap_or_else(|| name.clone()))
        .collect()
}

fn channels(baseline: &Baseline<'_>, recording: &Recording, domain: Domain) -> Vec<Observed> {
    recording
        .channels
        .iter()
        .filter_map(|channel| {
            let pickup = baseline.pickup(&channel.name)?;
            let axes_known = (0..3).all(|axis| pickup.weights[axis] == 0.0 || baseline.axes.contains(&axis));
            let is_force = pickup.quantity == Quantity::Force;
            // Channels of force are compared in the force domain, and in cuts, where the cutting force is predicted
            // too; channels of motion are compared in the response domain.
            let compared =
                is_force == (domain == Domain::Force) || recording.sidecar.kind == Some(TestKind::Cutting);
            let velocity_jumps = if pickup.modes.is_empty() {
                baseline.velocity_jumps
            } else {
                baseline.first_order.at_sensor(&pickup.modes).velocity_jumps()
            };
            let is_mean = velocity_jumps && pickup.quantity == Quantity::Acceleration;
            (axes_known && compared).then(|| Observed {
                mean_s: if is_mean {
                    1.0 / recording.sample_rate_hz
                } else {
                    0.0
                },
                pickup,
                measured: channel.samples.clone(),
                predicted: Vec::new(),
                deviation: 0.0,
                seen: None,
            })
        })
        .collect()
}

/// Frequency up to which at least the share [`MOTION_BAND_SHARE`] of the power of every channel of motion about its
/// mean lies, Hz; at least three times the frequency resolution 1/duration of the recording.
fn highest_hz(recording: &Recording) -> f64 {
    let grid = Grid::new(recording.len(), recording.sample_rate_hz, 0.0, 1);
    let of_motion = recording.channels.iter().filter(|channel| {
        matches!(
            channel.quantity,
            Quantity::Displacement | Quantity::Velocity | Quantity::Acceleration
        )
    });
    let least = 3.0 * recording.sample_rate_hz / recording.len() as f64;
    of_motion
        .map(|channel| {
            let mean = channel.samples.iter().sum::<f64>() / channel.samples.len().max(1) as f64;
            let centered: Vec<f64> = channel.samples.iter().map(|x| x - mean).collect();
            let power: Vec<f64> = grid
                .continued_spectrum(&centered)
                .iter()
                .map(|bin| bin.norm_sqr())
                .collect();
            let whole: f64 = power.iter().sum();
            let mut sum = 0.0;
            let bin = power
                .iter()
                .position(|power| {
                    sum += power;
                    sum >= MOTION_BAND_SHARE * whole
                })
                .unwrap_or(0);
            grid.omega(bin) / std::f64::consts::TAU
        })
        .fold(least, f64::max)
}
