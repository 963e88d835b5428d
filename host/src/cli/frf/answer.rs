//! Answer of `quietcut frf`.

use std::fmt::Write;
use std::path::PathBuf;

use serde::Serialize;

use super::args::{Args, Method};
use super::multisine_answer::MultisineAnswer;
use super::related_lines::largest;
use crate::frf::{FrfTable, Measurement, ModeRatio, RecordingGroup};
use crate::report::digits::significant;

/// Output of `quietcut frf --json`.
#[derive(Serialize)]
pub(super) struct FrfOutput {
    method: &'static str,
    frequency_hz: [f64; 2],
    lines: usize,
    parts: Vec<ColumnsAnswer>,
    receptances: Vec<ReceptanceAnswer>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    calibration: Vec<RatioAnswer>,
    warnings: Vec<String>,
    out: Vec<PathBuf>,
}

#[derive(Serialize)]
struct ColumnsAnswer {
    forces: Vec<&'static str>,
    excitation: &'static str,
    recordings: usize,
    averages: f64,
    /// Smallest singular value of the force spectra over the frequencies that are not left out: see
    /// [`RecordingGroup::least_singular`].
    least_singular_value: f64,
    left_out_hz: Vec<f64>,
    #[serde(rename = "blows", skip_serializing_if = "Option::is_none")]
    impacts: Option<ImpactCounts>,
    #[serde(flatten)]
    multisine: Option<MultisineAnswer>,
}

#[derive(Serialize)]
struct ImpactCounts {
    used: usize,
    double_s: Vec<f64>,
}

#[derive(Serialize)]
struct ReceptanceAnswer {
    name: String,
    peak_hz: f64,
    peak_m_per_n: PeakEstimate,
    coherence: Option<CoherenceAnswer>,
}

#[derive(Serialize)]
struct PeakEstimate {
    value: f64,
    /// 90 % interval of the peak magnitude of a receptance; `null` for a hammer test with fewer than three single
    /// impacts, whose scatter gives no standard deviation, and for one period of periodic excitation.
    ci90: Option<[f64; 2]>,
}

#[derive(Serialize)]
struct CoherenceAnswer {
    median: f64,
    at_peak: f64,
}

#[derive(Serialize)]
struct RatioAnswer {
    frequency_hz: f64,
    response: &'static str,
    tip_to_housing: f64,
    misfit: f64,
}

impl FrfOutput {
    pub(super) fn new(
        args: &Args,
        measurement: &Measurement,
        table: &FrfTable,
        calibration: &[ModeRatio],
    ) -> Self {
        let frequency_hz = table.frequency_hz();
        let receptances = (0..table.entries().len())
            .map(|index| ReceptanceAnswer::new(measurement, table, index))
            .collect();
        Self {
            method: match args.method {
                Method::H1 => "h1",
                Method::H2 => "h2",
                Method::Mean => "mean",
                Method::PseudoInverse => "pseudo-inverse",
            },
            // This index is safe: a table of frequency response functions has at least one frequency line.
            frequency_hz: [frequency_hz[0], frequency_hz[frequency_hz.len() - 1]],
            lines: frequency_hz.len(),
            parts: measurement.groups.iter().map(ColumnsAnswer::new).collect(),
            receptances,
            calibration: calibration
                .iter()
                .map(|ratio| RatioAnswer {
                    frequency_hz: ratio.frequency_hz,
                    response: ratio.response.name(),
                    tip_to_housing: ratio.ratio,
                    misfit: ratio.misfit,
                })
                .collect(),
            warnings: measurement.warnings.clone(),
            out: args.out.iter().map(|target| target.path.clone()).collect(),
        }
    }

    pub(super) fn text(&self) -> String {
        let mut text = format!(
            "{} frequencies from {:.3} to {:.3} Hz",
            self.lines, self.frequency_hz[0], self.frequency_hz[1]
        );
        for receptance in &self.receptances {
            let PeakEstimate { value, ci90 } = &receptance.peak_m_per_n;
            // Writing to a String cannot fail.
            let _ = write!(
                text,
                "\nH{}: {} µm/N at {} Hz",
                receptance.name,
                significant(1e6 * value, 5),
                significant(receptance.peak_hz, 5)
            );
            let _ = match ci90 {
                Some([from, to]) => write!(
                    text,
                    ", 90 % interval {} to {}",
                    significant(1e6 * from, 5),
                    significant(1e6 * to, 5)
                ),
                None => write!(text, ", no interval from so few impacts or periods"),
            };
            if let Some(coherence) = &receptance.coherence {
                let _ = write!(
                    text,
                    "; coherence {:.3} at the peak, median {:.3}",
                    coherence.at_peak, coherence.median
                );
            }
        }
        for part in self.parts.iter().filter_map(|part| part.multisine.as_ref()) {
            text += &part.text();
        }
        for ratio in &self.calibration {
            let _ = write!(
                text,
                "\nratio of tool tip to housing at {:.3} Hz in {}: {:.4} (misfit {:.1} %)",
                ratio.frequency_hz,
                ratio.response,
                ratio.tip_to_housing,
                100.0 * ratio.misfit
            );
        }
        for path in &self.out {
            let _ = write!(text, "\nwritten: {}", path.display());
        }
        text
    }
}

impl ColumnsAnswer {
    fn new(part: &RecordingGroup) -> Self {
        Self {
            forces: part.forces.iter().map(|direction| direction.name()).collect(),
            excitation: part.excitation.name(),
            recordings: part.recordings,
            averages: part.averages,
            least_singular_value: part.least_singular,
            left_out_hz: part.left_out_hz.clone(),
            multisine: part.periodic.as_ref().map(MultisineAnswer::new),
            impacts: part.impacts.as_ref().map(|(used, double)| ImpactCounts {
                used: used.len(),
                double_s: double.iter().map(|impact| impact.time_s).collect(),
            }),
        }
    }
}

impl ReceptanceAnswer {
    /// Peak magnitude of entry `index` of `table` with the 90 % interval from the random error of the estimate and from
    /// aliasing, the coherence at the peak, and the median of the coherence over all frequency lines.
    fn new(measurement: &Measurement, table: &FrfTable, index: usize) -> Self {
        let entry = &table.entries()[index];
        let size = |line: usize| entry.receptance[line].norm();
        let at = largest(entry, size);
        // The standard deviation is known for the receptance before the tool-tip calibration, and is divided by this
        // receptance. The calibration multiplies the contribution of each mode by one factor, so that the quotient also
        // holds after the calibration where one mode dominates.
        let before = measurement.table.entries()[index].receptance[at].norm();
        let relative = if before > 0.0 {
            measurement.deviation[index][at] / before
        } else {
            0.0
        };
        let folding = &measurement.table.entries()[index].folding;
        let folding = folding.as_ref().map_or(0.0, |folding| folding[at]);
        // Half-width of the 90 % interval of the peak magnitude: the peak magnitude times the root of the sum of the
        // squares of two relative errors, the half-width by the random error and the largest error by aliasing.
        let half = (measurement.ninety_percent(index) * relative).hypot(folding) * size(at);
        Self {
            name: entry.name(),
            peak_hz: table.frequency_hz()[at],
            peak_m_per_n: PeakEstimate {
                value: size(at),
                ci90: measurement.has_deviation[index].then(|| [(size(at) - half).max(0.0), size(at) + half]),
            },
            coherence: entry.coherence.as_ref().map(|coherence| {
                let mut sorted = coherence.clone();
                sorted.sort_by(f64::total_cmp);
                CoherenceAnswer {
                    median: sorted[sorted.len() / 2],
                    at_peak: coherence[at],
                }
            }),
        }
    }
}
