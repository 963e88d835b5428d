//! Segments of records in the form in which they are compared: transformed, band-limited, whitened, and orthogonal to
//! free decays and constant offsets of the sensors.

use std::borrow::Cow;
use std::ops::Range;

use crate::fit::whitening::Whitening;
use crate::records::domain::Domain;
use crate::records::record::Record;
use crate::records::study::Study;
use crate::signal::dot::dot;
use crate::signal::grid::SegmentTransform;
use quietcut_recording::TestKind;

/// One segment of a record, with what brings its measured and predicted samples into the form in which they are
/// compared: Fourier transform, band, whitening, and the projection that removes free decays and sensor offsets.
pub(crate) struct Segment {
    /// Index of the segment's record in the study.
    pub(crate) record: usize,
    pub(crate) range: Range<usize>,
    pub(crate) subset: Subset,
    /// Weight of the segment's values: one over the factor by which
    /// [`Regression::level_records`](crate::fit::regression::Regression::level_records) raises the standard deviation
    /// of the noise of the record; 1 without that.
    pub(crate) weight: f64,
    bins: usize,
    transform: SegmentTransform,
    whitening: Whitening,
    /// For each channel: indices, from the start of the segment, of samples that are not compared.
    skipped: Vec<Vec<usize>>,
    /// Orthonormal basis of the unknown contributions that are projected out of the segment: whitened free decays and
    /// sensor offsets.
    nuisance: Vec<Vec<f64>>,
}

/// Unknown contributions that are projected out of a segment; none for a record compared in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Nuisance {
    /// Free decays of the baseline from an unknown initial state, and offsets of sensors.
    StartAndOffsets,
    /// Offsets of sensors alone.
    Offsets,
}

/// Names the segments over which a sum (χ², inner product) is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Subset {
    /// Segments to which parameters are fitted for the prediction of the held-out segments.
    Fitted,
    /// Segments on which the prediction by the fit to [`Self::Fitted`] is tested. Only unknown initial states and
    /// sensor offsets are fitted to them.
    HeldOut,
    /// Whole records, one segment each.
    Whole,
}

/// Divides the compared range of each record: the whole, and four segments of a third, a sixth, a third and a sixth of
/// it. The short ones are held out. They contain other times than the fitted ones and, in a sweep, other frequencies.
/// In a study of several records a free decay is not divided, because the end of a decay contains little information:
/// it is held out if it is the last record of the study, and fitted otherwise.
pub(crate) fn split(study: &Study<'_>, unknown: impl Fn(&Record) -> Nuisance) -> Vec<Segment> {
    let several = study.records.len() > 1;
    let last = study.records.len().saturating_sub(1);
    study
        .records
        .iter()
        .enumerate()
        .flat_map(|(index, record)| {
            let Range { start: from, end } = record.compared.clone();
            let count = end - from;
            let mut ranges = vec![(from..end, Subset::Whole)];
            if several && record.kind == Some(TestKind::FreeDecay) {
                let subset = if index == last {
                    Subset::HeldOut
                } else {
                    Subset::Fitted
                };
                ranges.push((from..end, subset));
            } else {
                ranges.extend([
                    (from..from + count / 3, Subset::Fitted),
                    (from + count / 3..from + count / 2, Subset::HeldOut),
                    (from + count / 2..from + 5 * count / 6, Subset::Fitted),
                    (from + 5 * count / 6..end, Subset::HeldOut),
                ]);
            }
            let unknown = unknown(record);
            ranges
                .into_iter()
                .map(move |(range, subset)| Segment::new(study, index, range, subset, unknown))
        })
        .collect()
}

impl Segment {
    /// Prepares the samples `range` of the record at `index` as a segment.
    pub(crate) fn new(
        study: &Study<'_>,
        index: usize,
        range: Range<usize>,
        subset: Subset,
        unknown: Nuisance,
    ) -> Self {
        let record = &study.records[index];
        let mut segment = Self {
            record: index,
            bins: bins_of(record, range.len()),
            skipped: record
                .skipped
                .iter()
                .map(|of| {
                    of.iter()
                        .filter(|sample| range.contains(sample))
                        .map(|sample| sample - range.start)
                        .collect()
                })
                .collect(),
            transform: SegmentTransform::new(range.len()),
            range,
            subset,
            weight: 1.0,
            whitening: Whitening::default(),
            nuisance: Vec::new(),
        };
        segment.whitening = Whitening::of(record, segment.range.len(), segment.bins);
        segment.nuisance = nuisance(record, &segment, unknown);
        segment
    }

    /// The values of this segment that are compared: transforms the segment of `samples`, given by channel for the
    /// whole record, limits its band, whitens it, and projects out free decays and sensor offsets.
    pub(crate) fn whiten(&self, samples: &[Vec<f64>]) -> Vec<f64> {
        let mut column = raw(self, samples);
        for nuisance in &self.nuisance {
            let along = dot(&column, nuisance);
            for (value, nuisance) in column.iter_mut().zip(nuisance) {
                *value -= along * nuisance;
            }
        }
        if self.weight != 1.0 {
            column.iter_mut().for_each(|value| *value *= self.weight);
        }
        column
    }

    /// Number of samples of the segment that do not count as compared: one for each projected free decay or offset, and
    /// the skipped samples.
    pub(crate) fn taken(&self) -> usize {
        self.nuisance.len() + self.skipped.iter().map(Vec::len).sum::<usize>()
    }
}

fn bins_of(record: &Record, length: usize) -> usize {
    let share = record.band_hz / record.grid.rate_hz();
    ((share * length as f64) as usize + 1).min(length / 2 + 1)
}

fn raw(segment: &Segment, samples: &[Vec<f64>]) -> Vec<f64> {
    let mut column = Vec::with_capacity(2 * segment.bins * samples.len());
    for (samples, skipped) in samples.iter().zip(&segment.skipped) {
        let mut samples = Cow::Borrowed(&samples[segment.range.clone()]);
        for &sample in skipped {
            samples.to_mut()[sample] = 0.0;
        }
        segment.transform.bins(&samples, segment.bins, &mut column);
    }
    segment.whitening.apply(&mut column);
    column
}

/// Orthonormal basis of whitened free decays and sensor offsets in a segment; empty for a record compared in force.
fn nuisance(record: &Record, segment: &Segment, unknown: Nuisance) -> Vec<Vec<f64>> {
    if record.domain == Domain::Force {
        return Vec::new();
    }
    let count = record.grid.count();
    let channels = record.channels.len();
    let mut raws = Vec::new();
    let states = match unknown {
        Nuisance::StartAndOffsets => record.decays.count(),
        Nuisance::Offsets => 0,
    };
    for state in 0..states {
        // The free decays of a segment begin at its first sample, because its initial state is unknown too.
        let shifted: Vec<Vec<f64>> = (0..channels)
            .map(|channel| {
                let column = record.decays.column(channel, state);
                let mut samples = vec![0.0; count];
                samples[segment.range.clone()].copy_from_slice(&column[..segment.range.len()]);
                samples
            })
            .collect();
        raws.push(raw(segment, &shifted));
    }
    for constant in 0..channels {
        let samples: Vec<Vec<f64>> = (0..channels)
            .map(|channel| vec![f64::from(u8::from(channel == constant)); count])
            .collect();
        raws.push(raw(segment, &samples));
    }
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for mut column in raws {
        let size = dot(&column, &column).sqrt();
        // Two passes of Gram–Schmidt make the columns orthogonal within rounding.
        for _ in 0..2 {
            for known in &basis {
                let along = dot(&column, known);
                column
                    .iter_mut()
                    .zip(known)
                    .for_each(|(value, known)| *value -= along * known);
            }
        }
        let left = dot(&column, &column).sqrt();
        if left > 1e-7 * size && left > 0.0 {
            column.iter_mut().for_each(|value| *value /= left);
            basis.push(column);
        }
    }
    basis
}
