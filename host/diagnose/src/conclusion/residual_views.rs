//! The residuals of a study, for pictures and tables.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::conclusion::missing_force::MissingForce;
use crate::fit::candidate_model::CandidateModel;
use crate::fit::library::Library;
use crate::motion::recorded_cut::RecordedCut;
use crate::records::domain::Domain;
use crate::records::record::Record;
use crate::records::study::Study;
use crate::signal::grid::Grid;
use crate::signal::noise::rms;

/// One channel of one record: measured samples, and the residuals of the baseline and of the extended case.
#[derive(Clone, Debug)]
pub struct ResidualView {
    /// Number of the record, from 1 in the order in which they were given.
    pub number: usize,
    /// File of the recording.
    pub record: String,
    /// Name of the channel.
    pub channel: String,
    /// Unit of the channel.
    pub unit: &'static str,
    /// Sample rate of the channel, Hz.
    pub rate_hz: f64,
    /// Highest frequency at which the channel is compared, Hz.
    pub highest_hz: f64,
    /// Standard deviation of the channel's noise, in the unit of the channel.
    pub deviation: f64,
    /// Measured samples, in the unit of the channel.
    pub measured: Vec<f64>,
    /// Measured samples minus those that the baseline (the case file with its extensions) predicts along the measured
    /// motion, free decay included, in the unit of the channel.
    pub residual: Vec<f64>,
    /// `residual` minus the contribution of the extension along the measured motion, with the free decay fitted again
    /// unless forces are compared; empty without an extension.
    pub left: Vec<f64>,
    /// The restoring force that would explain the residual of the baseline in this channel; `None` for a channel of
    /// force if motion is compared, if the channel reads no axis, or if its axis has no motion.
    pub missing: Option<MissingForce>,
    /// The channel and its baseline residual, interpolated at the tooth passings of a cut; `None` for other tests.
    pub spindle_motion: Option<SpindleMotionView>,
}

/// A channel of a cut and its baseline residual, interpolated at the tooth passings.
#[derive(Clone, Debug)]
pub struct SpindleMotionView {
    /// Mean spindle speed, rev/min.
    pub rpm: f64,
    /// Number of teeth of the tool.
    pub teeth: usize,
    /// For each passage of a tooth through immersion angle 0 (teeth taken as equally pitched): its number, and the
    /// measured value of the channel at that instant.
    pub measured: Vec<(u32, f64)>,
    /// For each passage of a tooth through immersion angle 0 (teeth taken as equally pitched): its number, and the
    /// baseline residual of the channel at that instant.
    pub residual: Vec<(u32, f64)>,
}

impl ResidualView {
    /// Amplitude spectrum of `samples`, a signal of this channel: (frequency in Hz, amplitude of a sinusoid per
    /// spectral line, in the unit of the channel). Neighbouring lines are averaged by power to at most `points` points.
    pub fn spectrum(&self, samples: &[f64], points: usize) -> Vec<(f64, f64)> {
        if samples.is_empty() {
            return Vec::new();
        }
        let grid = Grid::new(samples.len(), self.rate_hz, 0.0, 1);
        let bins: Vec<Complex64> = grid.spectrum(samples);
        let per = bins.len().div_ceil(points.max(1)).max(1);
        let scale = 2.0 / samples.len() as f64;
        bins.chunks(per)
            .enumerate()
            .map(|(index, chunk)| {
                let middle = index * per + chunk.len() / 2;
                let power: f64 = chunk.iter().map(|bin| bin.norm_sqr()).sum::<f64>() / chunk.len() as f64;
                (grid.omega(middle) / TAU, scale * power.sqrt())
            })
            .collect()
    }

    /// The residual of the extended case, or of the baseline if there is no extension.
    pub(crate) fn unexplained(&self) -> &[f64] {
        if self.left.is_empty() {
            &self.residual
        } else {
            &self.left
        }
    }

    /// Root mean squares over the whole record, in the unit of the channel: of the measured samples, of the baseline's
    /// residual, and of the extended case's residual (0 without an extension).
    pub fn sizes(&self) -> [f64; 3] {
        [rms(&self.measured), rms(&self.residual), rms(&self.left)]
    }
}

/// Views of every channel of every record, by record and then by channel, with the residual of the candidate model
/// `best` if there is one.
pub(crate) fn residual_views(
    study: &Study<'_>,
    library: &Library,
    best: Option<&CandidateModel>,
) -> Vec<ResidualView> {
    let mut all = Vec::new();
    for (number, record) in study.records.iter().enumerate() {
        let left_by_best = best.map(|best| left_by(study, library, record, best));
        for (index, channel) in record.channels.iter().enumerate() {
            let residual = channel.residual();
            let left = left_by_best
                .as_ref()
                .map_or_else(Vec::new, |left| left[index].clone());
            let spindle_motion = record.cut.as_ref().map(|cutting| {
                let passes = passes(record, &cutting.cut);
                let at = |samples: &[f64]| strobe(&passes, samples);
                SpindleMotionView {
                    rpm: cutting.cut.spindle_motion.rpm(),
                    teeth: cutting.cut.cutter.teeth.len(),
                    measured: at(&channel.measured),
                    residual: at(&residual),
                }
            });
            all.push(ResidualView {
                number: number + 1,
                record: record.path.display().to_string(),
                channel: channel.pickup.name.clone(),
                unit: channel.pickup.quantity.unit(),
                rate_hz: record.grid.rate_hz(),
                highest_hz: record.band_hz,
                deviation: channel.deviation,
                measured: channel.measured.clone(),
                missing: MissingForce::of(&study.baseline, record, channel, &residual),
                spindle_motion,
                residual,
                left,
            });
        }
    }
    all
}

/// Residual of each channel of a record after subtracting the contribution of the candidate model `best` and, if motion
/// is compared, the free decay of the baseline that then fits best.
fn left_by(study: &Study<'_>, library: &Library, record: &Record, best: &CandidateModel) -> Vec<Vec<f64>> {
    let explained = library.explained(study, record, best);
    let left: Vec<Vec<f64>> = record
        .channels
        .iter()
        .zip(&explained)
        .map(|(channel, explained)| {
            let residual = channel.residual();
            residual.iter().zip(explained).map(|(a, b)| a - b).collect()
        })
        .collect();
    if record.domain == Domain::Force {
        return left;
    }
    record.without_decay(&left)
}

/// Instants at which a tooth passes through immersion angle 0, the teeth taken as equally pitched: number of the tooth
/// passing from 0, and time in samples.
fn passes(record: &Record, cut: &RecordedCut) -> Vec<(u32, f64)> {
    let pitch = TAU / cut.cutter.teeth.len().max(1) as f64;
    let rate_hz = record.grid.rate_hz();
    let turned = |sample: usize| cut.spindle_motion.angle_rad(sample as f64 / rate_hz) / pitch;
    let first = turned(0).ceil();
    let mut next = first;
    let mut found = Vec::new();
    for sample in 1..record.grid.count() {
        let (from, to) = (turned(sample - 1), turned(sample));
        while next <= to && to > from {
            let share = ((next - from) / (to - from)).clamp(0.0, 1.0);
            found.push(((next - first) as u32, (sample - 1) as f64 + share));
            next += 1.0;
        }
    }
    found
}

/// Values of `samples` at the tooth passings `passes`, by linear interpolation, each with the number of its passing.
fn strobe(passes: &[(u32, f64)], samples: &[f64]) -> Vec<(u32, f64)> {
    passes
        .iter()
        .filter_map(|(pass, place)| {
            let (index, share) = (place.floor() as usize, place.fract());
            let (from, to) = (samples.get(index)?, samples.get(index + 1)?);
            Some((*pass, from + share * (to - from)))
        })
        .collect()
}
