//! The machine and its sensors, for the simulation of proposed tests.

use std::f64::consts::TAU;

use nalgebra::Matrix3;
use num_complex::Complex64;

use super::reading::SimulatedReading;
use crate::baseline::{Baseline, derivatives};
use crate::conclusion::residual_views::ResidualView;
use crate::criteria::ASSUMED_NOISE;
use crate::motion::recorded_cut::cut_of;
use crate::signal::noise::rms;
use quietcut_model::case::Case;
use quietcut_model::milling::Cut;
use quietcut_recording::{Channel, Quantity, Recording, TestKind};

/// Largest number of samples per channel in the standard duration of a proposed test. Some tests last longer, up to a
/// factor of four, and cuts begin with a transient.
const SAMPLES: f64 = 8192.0;
/// Smallest and largest standard duration of a proposed test, in periods of the lowest natural frequency, unless
/// [`SAMPLES`] shortens it.
const PERIODS: [f64; 2] = [20.0, 60.0];
/// Samples of a simulated test per period of the highest natural frequency of the baseline.
const SAMPLES_PER_PERIOD: f64 = 24.0;
/// Duration of the transient that is simulated before a proposed cut is compared, in multiples of the longest time
/// constant of the structure, unless [`WAITED`] shortens it.
const SETTLED: f64 = 12.0;
/// Largest duration of the simulated transient of a proposed cut, as a multiple of the standard duration of a test.
const WAITED: f64 = 4.0;

/// A channel of motion that the records contain and the baseline predicts.
pub(super) struct MeasuredChannel {
    pub(super) name: String,
    quantity: Quantity,
    /// Standard deviation of the channel's noise in the records, in the SI unit of the channel; 0 if unknown.
    deviation: f64,
}

/// Working point of the first recorded cut whose sidecar gives speed and depth.
#[derive(Clone)]
pub(super) struct CutSoFar {
    pub(super) rpm: f64,
    pub(super) depth_mm: f64,
    /// Immersion and feed: from the cut's sidecar, otherwise from the case.
    pub(super) cut: Cut,
}

/// The machine, the sensors of its records, and the force, duration and sample rate of the tests that suit it.
pub(super) struct Bench<'a> {
    pub(super) case: &'a Case,
    pub(super) baseline: Baseline<'a>,
    pub(super) channels: Vec<MeasuredChannel>,
    /// Lowest and highest natural frequency of the baseline, Hz.
    pub(super) modes_hz: [f64; 2],
    /// True if a recorded cut has a channel of force.
    pub(super) has_force: bool,
    /// Force of level 1 in proposed tests of the structure, N: the largest force in records other than cuts. Without
    /// such a force, the one that causes the displacement `largest_m` at the lowest natural frequency along the axis
    /// with the largest receptance there.
    pub(super) force_n: f64,
    /// Largest displacement of the tool in the records, m. Peaks of velocity and acceleration are converted to
    /// displacement at the lowest natural frequency.
    pub(super) largest_m: f64,
    /// Standard duration of a proposed test, s.
    pub(super) seconds: f64,
    pub(super) rate_hz: f64,
    pub(super) cut: Option<CutSoFar>,
}

impl<'a> Bench<'a> {
    /// Prepares the simulation of tests that may be proposed.
    ///
    /// # Errors
    /// The case cannot be simulated, has no oscillating mode, or the records contain no motion; the error is a
    /// sentence.
    pub(super) fn new(
        case: &'a Case,
        recordings: &[Recording],
        views: &[ResidualView],
    ) -> Result<Self, String> {
        let baseline = Baseline::new(case).map_err(|error| error.to_string())?;
        let (Some(first_hz), Some(last_hz)) = (baseline.lowest_hz(), highest_hz(&baseline)) else {
            return Err("the structure has no oscillating mode".into());
        };
        let modes_hz = [first_hz, last_hz];
        let [lowest_hz, highest_hz] = modes_hz;
        let channels = measured(&baseline, recordings, views);
        let rate_hz = SAMPLES_PER_PERIOD * highest_hz;
        let longest_s = recordings
            .iter()
            .map(|recording| recording.len() as f64 / recording.sample_rate_hz)
            .fold(0.0, f64::max);
        let seconds = longest_s.clamp(PERIODS[0] / lowest_hz, PERIODS[1] / lowest_hz);
        let of_motion = |channel: &&Channel| is_motion(channel.quantity);
        let largest_m = channels_of(recordings.iter())
            .filter(of_motion)
            .map(|channel| peak(channel) / (TAU * lowest_hz).powi(derivatives(channel.quantity)))
            .fold(0.0, f64::max);
        let of_force = |channel: &&Channel| channel.quantity == Quantity::Force;
        let of_rigs = recordings.iter().filter(|recording| !is_cut(recording));
        let measured_n = channels_of(of_rigs)
            .filter(of_force)
            .map(peak)
            .fold(0.0, f64::max);
        let force_n = match measured_n {
            0.0 => largest_m / compliance(&baseline, lowest_hz),
            measured_n => measured_n,
        };
        let cuts = || recordings.iter().filter(|recording| is_cut(recording));
        if channels.is_empty() || !force_n.is_finite() || force_n <= 0.0 {
            return Err("the records contain no motion".into());
        }
        Ok(Self {
            has_force: channels_of(cuts()).any(|channel| of_force(&channel)),
            cut: cuts().find_map(|recording| cut_so_far(case, recording)),
            case,
            baseline,
            channels,
            modes_hz,
            force_n,
            largest_m,
            seconds: seconds.min(SAMPLES / rate_hz),
            rate_hz,
        })
    }

    /// Static compliance of the baseline along its most compliant axis, m/N.
    pub(super) fn static_compliance(&self) -> f64 {
        compliance(&self.baseline, 0.0)
    }

    /// Standard deviation of each reading's noise: that of the same channel in the records, otherwise an assumed share
    /// of the reading's root mean square.
    pub(super) fn deviations(&self, readings: &[SimulatedReading]) -> Vec<f64> {
        let of = |reading: &SimulatedReading| {
            let measured = self
                .channels
                .iter()
                .find(|measured| measured.name == reading.name);
            let known = measured
                .map(|measured| measured.deviation)
                .filter(|deviation| *deviation > 0.0);
            known.unwrap_or_else(|| (ASSUMED_NOISE * rms(&reading.samples)).max(f64::MIN_POSITIVE))
        };
        readings.iter().map(of).collect()
    }

    /// Duration of the transient that is simulated before a proposed cut is compared, s.
    pub(super) fn settled_s(&self) -> f64 {
        (SETTLED * self.baseline.slowest_decay_s()).min(WAITED * self.seconds)
    }

    /// The quantities of the mounted sensors of motion, each once.
    pub(super) fn quantities(&self) -> Vec<Quantity> {
        let mut all: Vec<Quantity> = Vec::new();
        for measured in &self.channels {
            if !all.contains(&measured.quantity) {
                all.push(measured.quantity);
            }
        }
        all
    }
}

fn is_motion(quantity: Quantity) -> bool {
    matches!(
        quantity,
        Quantity::Displacement | Quantity::Velocity | Quantity::Acceleration
    )
}

fn is_cut(recording: &Recording) -> bool {
    recording.sidecar.kind == Some(TestKind::Cutting)
}

fn channels_of<'r>(recordings: impl Iterator<Item = &'r Recording>) -> impl Iterator<Item = &'r Channel> {
    recordings.flat_map(|recording| &recording.channels)
}

fn peak(channel: &Channel) -> f64 {
    channel
        .samples
        .iter()
        .fold(0.0, |most: f64, value| value.abs().max(most))
}

/// The channels of motion in the recordings that the baseline predicts, each name once.
fn measured(
    baseline: &Baseline<'_>,
    recordings: &[Recording],
    views: &[ResidualView],
) -> Vec<MeasuredChannel> {
    let mut all: Vec<MeasuredChannel> = Vec::new();
    for channel in channels_of(recordings.iter()) {
        let is_known = all.iter().any(|measured| measured.name == channel.name);
        if is_motion(channel.quantity) && !is_known && baseline.pickup(&channel.name).is_some() {
            all.push(MeasuredChannel {
                name: channel.name.clone(),
                quantity: channel.quantity,
                deviation: deviation(views, &channel.name),
            });
        }
    }
    all
}

fn cut_so_far(case: &Case, recording: &Recording) -> Option<CutSoFar> {
    let given = recording.sidecar.cut?;
    Some(CutSoFar {
        rpm: given.spindle_rpm?,
        depth_mm: given.axial_depth_mm?,
        // A case without a cut cannot come here: the preparation of the records has refused it.
        cut: cut_of(case, recording).ok()?,
    })
}

/// Standard deviation of a channel's noise: the root mean square of its values in the records; 0 if no record has the
/// channel.
fn deviation(views: &[ResidualView], name: &str) -> f64 {
    let known: Vec<f64> = views
        .iter()
        .filter(|view| view.channel == name)
        .map(|view| view.deviation)
        .collect();
    rms(&known)
}

fn highest_hz(baseline: &Baseline<'_>) -> Option<f64> {
    let poles = baseline.first_order.poles();
    let modes = poles.iter().filter(|pole| pole.im > 0.0);
    modes.map(|pole| pole.norm() / TAU).max_by(f64::total_cmp)
}

/// The largest |receptance| of the baseline along one of its axes at `frequency_hz`, m/N.
fn compliance(baseline: &Baseline<'_>, frequency_hz: f64) -> f64 {
    let receptance: Matrix3<Complex64> = baseline.receptance.at(TAU * frequency_hz);
    let along = baseline.axes.iter().map(|axis| receptance[(*axis, *axis)].norm());
    along.fold(0.0, f64::max)
}
