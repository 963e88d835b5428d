//! Data of a modal fit to whole records.

use num_complex::Complex64;

use super::unknowns::{SMOOTH, Transient, Unknowns};
use super::variances::{ChannelNoise, Variances};
use crate::criteria::{LEAST_RECORD_LINES, MOST_RECORD_LINES};
use crate::modes::error::ModesError;
use crate::modes::model::ModalModel;
use crate::modes::pole_residue::{PoleResidue, ShapedPole};
use quietcut_frf::{ChannelLines, RecordSpectra};
use quietcut_model::structure::Direction;

/// Fourier transforms of the records of a modal fit, and the assignment of their channels to entries of the mode
/// shapes.
pub(super) struct Data<'a> {
    pub(super) records: &'a [RecordSpectra],
    /// For each pair of compliance and inertia terms of the modes outside the band, the index of its response and of
    /// its force direction.
    pub(super) places: Vec<(usize, usize)>,
    /// For each record: the index in the right shape of each response channel, and the index in the left shape of each
    /// force channel.
    pub(super) axes: Vec<(Vec<usize>, Vec<usize>)>,
    /// Mean angular frequency of the lines of all records, rad/s, by which s is divided in the polynomials of the
    /// transients.
    pub(super) omega: f64,
}

impl<'a> Data<'a> {
    pub(super) fn new(model: &ModalModel, records: &'a [RecordSpectra]) -> Result<Self, ModesError> {
        let lines: usize = records.iter().map(|record| record.frequency_hz.len()).sum();
        if lines > MOST_RECORD_LINES {
            return Err(ModesError::Data(format!(
                "the records have {lines} lines in the band, at most {MOST_RECORD_LINES} can be fitted; give a narrower --band-hz about the modes"
            )));
        }
        let index = |all: &[Direction], channels: &[ChannelLines]| -> Option<Vec<usize>> {
            let of = |channel: &ChannelLines| all.iter().position(|known| *known == channel.direction);
            channels.iter().map(of).collect()
        };
        let mut axes = Vec::new();
        for record in records {
            let found = (
                index(&model.responses, &record.responses),
                index(&model.forces, &record.forces),
            );
            let (Some(responses), Some(forces)) = found else {
                return Err(ModesError::Data(format!(
                    "{} has other directions than the receptances",
                    record.path.display()
                )));
            };
            if record.frequency_hz.len() < LEAST_RECORD_LINES {
                return Err(ModesError::Data(format!(
                    "{} has {} lines in the band; at least {LEAST_RECORD_LINES} are needed",
                    record.path.display(),
                    record.frequency_hz.len()
                )));
            }
            axes.push((responses, forces));
        }
        let place = |(response, force): (Direction, Direction)| {
            let p = model.responses.iter().position(|known| *known == response)?;
            Some((p, model.forces.iter().position(|known| *known == force)?))
        };
        let hertz: f64 = records.iter().flat_map(|record| &record.frequency_hz).sum();
        Ok(Self {
            records,
            places: model
                .outside
                .iter()
                .filter_map(|&(response, force, _)| place((response, force)))
                .collect(),
            axes,
            omega: std::f64::consts::TAU * hertz / lines.max(1) as f64,
        })
    }

    pub(super) fn start(&self, model: &ModalModel) -> Unknowns {
        let modes = model.modes.iter().map(|found| ShapedPole {
            pole: found.mode.pole(),
            right: found.mode.right.clone(),
            left: found.mode.left.clone(),
        });
        let transient = |(responses, _): &(Vec<usize>, Vec<usize>)| Transient {
            residues: vec![vec![Complex64::ZERO; model.modes.len()]; responses.len()],
            smooth: vec![[0.0; SMOOTH]; responses.len()],
        };
        Unknowns {
            structure: PoleResidue {
                modes: modes.collect(),
                outside: model.outside.iter().map(|(.., values)| *values).collect(),
            },
            transients: self.axes.iter().map(transient).collect(),
        }
    }

    pub(super) fn found(&self, variances: &[Variances]) -> Vec<ChannelNoise> {
        let mut found = Vec::new();
        for (record, variances) in self.records.iter().zip(variances) {
            let forces = record.forces.iter().zip(&variances.forces);
            for (channel, variance) in forces.chain(record.responses.iter().zip(&variances.responses)) {
                let deviation = variance.sqrt();
                found.push(ChannelNoise {
                    recording: record.path.display().to_string(),
                    channel: channel.name.clone(),
                    deviation,
                    percent: 100.0 * deviation / channel.root_mean_square,
                });
            }
        }
        found
    }
}

impl Data<'_> {
    /// Mean square of the transform of each response of a record over the lines of the band.
    pub(super) fn sizes(&self, record: usize) -> Vec<f64> {
        let of = |channel: &ChannelLines| {
            let power: f64 = channel.lines.iter().map(|line| line.norm_sqr()).sum();
            (power / channel.lines.len().max(1) as f64).max(f64::MIN_POSITIVE)
        };
        self.records[record].responses.iter().map(of).collect()
    }

    /// Directions that are both excited and measured, as pairs of indices in the right and in the left shape.
    pub(super) fn shared(&self, (rights, lefts): (usize, usize)) -> Vec<(usize, usize)> {
        let directions = |index: usize, of_response: bool| {
            self.axes.iter().zip(self.records).find_map(|(axes, record)| {
                let (indices, channels) = if of_response {
                    (&axes.0, &record.responses)
                } else {
                    (&axes.1, &record.forces)
                };
                let at = indices.iter().position(|&known| known == index)?;
                Some(channels[at].direction)
            })
        };
        let of_right = |p: usize| directions(p, true);
        let of_left = |q: usize| directions(q, false);
        let pairs = (0..rights).flat_map(|p| (0..lefts).map(move |q| (p, q)));
        pairs
            .filter(|&(p, q)| of_right(p).is_some() && of_right(p) == of_left(q))
            .collect()
    }
}
