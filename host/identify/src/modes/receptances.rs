//! Receptances with the standard deviation of every value, as the data of a modal fit.

use num_complex::Complex64;

use super::error::ModesError;
use super::point_direction::PointDirection;
use crate::criteria::{LEAST_LINES, LEAST_RELATIVE_DEVIATION};
use quietcut_frf::FrfTable;
use quietcut_model::structure::Direction;

/// Measured receptances in a band, at common frequencies, with their standard deviations.
#[derive(Clone, Debug)]
pub struct Receptances {
    /// Frequencies, Hz, ascending.
    pub frequency_hz: Vec<f64>,
    /// Directions of the displacements.
    pub responses: Vec<Direction>,
    /// Directions of the forces.
    pub forces: Vec<Direction>,
    /// Points of the responses, as numbers of names; all 0 where every response is at the tool tip. A response and a force
    /// are one degree of freedom if their directions and points are.
    pub response_points: Vec<usize>,
    /// Points of the forces, likewise.
    pub force_points: Vec<usize>,
    /// For each receptance, the index of its response direction and the index of its force direction.
    pub places: Vec<(usize, usize)>,
    /// The receptances, m/N, in the order of `places`, each at the frequencies of `frequency_hz`.
    pub values: Vec<Vec<Complex64>>,
    /// Standard deviation of the real part, equal to that of the imaginary part, of every receptance at every
    /// frequency, as `values`, m/N. The variance is averaged over neighbouring lines, and the standard deviation is at
    /// least a fixed fraction of the RMS of the receptance. If only coherence is measured, the standard deviation is
    /// correct up to a common factor; if neither is known, it is that fraction.
    pub deviation: Vec<Vec<f64>>,
    /// For each receptance its relative error by aliasing at every frequency; empty where none is stated.
    pub folding: Vec<Vec<f64>>,
    /// True if standard deviations of the receptances were measured; false if they follow from coherence up to a
    /// factor, or are not known.
    pub has_deviation: bool,
    /// True if the standard deviations of all receptances follow from coherence: the receptances are then taken as
    /// averages over windowed segments, which leak.
    pub has_coherence: bool,
}

/// Number of frequency lines on each side over which the variance of a receptance is averaged: a variance from a
/// handful of averages scatters by half of itself.
const NEIGHBOURS: usize = 4;

impl Receptances {
    /// The receptances of a table between `band_hz[0]` and `band_hz[1]`, Hz, inclusive; `None` takes all above 0 Hz.
    ///
    /// `deviation` holds the standard deviation of |H| of every value, as [`quietcut_frf::Measurement`] states it.
    /// Without it, the coherence of each response gives the relative standard deviation over the lines; without
    /// coherence it is equal at all lines. The residual of the fit then gives its scale.
    ///
    /// # Errors
    /// Too few lines in the band, a receptance that is zero throughout or that is missing.
    pub fn new(
        table: &FrfTable,
        deviation: Option<&[Vec<f64>]>,
        band_hz: Option<[f64; 2]>,
    ) -> Result<Self, ModesError> {
        let [from_hz, to_hz] = band_hz.unwrap_or([0.0, f64::INFINITY]);
        let lines: Vec<usize> = (0..table.frequency_hz().len())
            .filter(|&line| {
                let hertz = table.frequency_hz()[line];
                hertz > 0.0 && (from_hz..=to_hz).contains(&hertz)
            })
            .collect();
        if lines.len() < LEAST_LINES {
            return Err(ModesError::Data(format!(
                "{} frequencies lie in the band; at least {LEAST_LINES} are needed",
                lines.len()
            )));
        }
        let mut data = Self {
            frequency_hz: lines.iter().map(|&line| table.frequency_hz()[line]).collect(),
            responses: Vec::new(),
            forces: Vec::new(),
            response_points: Vec::new(),
            force_points: Vec::new(),
            places: Vec::new(),
            values: Vec::new(),
            deviation: Vec::new(),
            folding: Vec::new(),
            has_deviation: deviation.is_some(),
            has_coherence: deviation.is_none()
                && table.entries().iter().all(|entry| entry.coherence.is_some()),
        };
        for entry in table.entries() {
            let place = (
                index_of(&mut data.responses, entry.response),
                index_of(&mut data.forces, entry.force),
            );
            let values: Vec<Complex64> = lines.iter().map(|&line| entry.receptance[line]).collect();
            if values.iter().all(|value| value.norm() == 0.0) {
                return Err(ModesError::Data(format!(
                    "h{} is zero in the whole band; leave it out of the table",
                    entry.name()
                )));
            }
            data.places.push(place);
            data.values.push(values);
            let folding = entry
                .folding
                .iter()
                .flat_map(|folding| lines.iter().map(|&line| folding[line]));
            data.folding.push(folding.collect());
        }
        data.sort_directions();
        data.response_points = vec![0; data.responses.len()];
        data.force_points = vec![0; data.forces.len()];
        data.is_whole()?;
        for (index, entry) in table.entries().iter().enumerate() {
            let stated: Vec<f64> = match (deviation, &entry.coherence) {
                (Some(deviation), _) => lines.iter().map(|&line| deviation[index][line]).collect(),
                (None, Some(coherence)) => data.by_coherence(index, &lines, coherence),
                (None, None) => vec![0.0; lines.len()],
            };
            let smooth = data.smoothed(index, &stated);
            data.deviation.push(smooth);
        }
        Ok(data)
    }

    /// Receptances between directions at points: `values[k]` at the frequencies `frequency_hz` is that of the response and
    /// the force with the indices `places[k]`. Each response has one for each force.
    ///
    /// # Errors
    /// Too few lines, or a receptance that is zero throughout.
    pub(super) fn between_places<'a>(
        frequency_hz: Vec<f64>,
        [responses, forces]: [&'a [PointDirection]; 2],
        places: Vec<(usize, usize)>,
        values: Vec<Vec<Complex64>>,
        deviation: Option<Vec<Vec<f64>>>,
    ) -> Result<Self, ModesError> {
        if frequency_hz.len() < LEAST_LINES {
            return Err(ModesError::Data(format!(
                "{} frequencies lie in the band; at least {LEAST_LINES} are needed",
                frequency_hz.len()
            )));
        }
        for (&(p, q), values) in places.iter().zip(&values) {
            if values.iter().all(|value| value.norm() == 0.0) {
                return Err(ModesError::Data(format!(
                    "the receptance of {} by a force at {} is zero in the whole band; leave it out",
                    responses[p], forces[q]
                )));
            }
        }
        let mut names: Vec<&'a str> = Vec::new();
        let mut numbers = |all: &'a [PointDirection]| -> Vec<usize> {
            let mut found = Vec::new();
            for place in all {
                let known = names.iter().position(|name| **name == *place.point);
                found.push(known.unwrap_or(names.len()));
                if known.is_none() {
                    names.push(&place.point);
                }
            }
            found
        };
        let (response_points, force_points) = (numbers(responses), numbers(forces));
        let directions = |all: &[PointDirection]| all.iter().map(|place| place.direction).collect();
        let mut data = Self {
            responses: directions(responses),
            forces: directions(forces),
            response_points,
            force_points,
            places,
            has_deviation: deviation.is_some(),
            has_coherence: false,
            deviation: Vec::new(),
            folding: Vec::new(),
            values,
            frequency_hz,
        };
        for index in 0..data.values.len() {
            let stated = match &deviation {
                Some(deviation) => deviation[index].clone(),
                None => vec![0.0; data.frequency_hz.len()],
            };
            let smooth = data.smoothed(index, &stated);
            data.deviation.push(smooth);
        }
        Ok(data)
    }

    /// Lowest and highest frequency of the band, Hz.
    pub fn band_hz(&self) -> [f64; 2] {
        // The first and last line exist, since the band contains at least LEAST_LINES lines.
        [
            self.frequency_hz[0],
            self.frequency_hz[self.frequency_hz.len() - 1],
        ]
    }

    /// Mean frequency difference of neighbouring lines, Hz.
    pub fn spacing_hz(&self) -> f64 {
        let [from_hz, to_hz] = self.band_hz();
        (to_hz - from_hz) / (self.frequency_hz.len() - 1) as f64
    }

    /// Indices of the receptances by part. Two receptances belong to one part if they share a response or a force direction, or if both do so with
    /// receptances of the part. The directions along which a part is driven and those along which it is measured then have the same names: x of a
    /// response and x of a force are one.
    pub(super) fn parts(&self) -> Vec<Vec<usize>> {
        let directions = |index: usize| {
            let (p, q) = self.places[index];
            [self.responses[p], self.forces[q]]
        };
        let mut parts: Vec<Vec<usize>> = Vec::new();
        for index in 0..self.places.len() {
            let touches = |part: &Vec<usize>| {
                part.iter().any(|&other| {
                    directions(other)
                        .iter()
                        .any(|direction| directions(index).contains(direction))
                })
            };
            let (joined, apart): (Vec<_>, Vec<_>) = parts.into_iter().partition(touches);
            let mut part: Vec<usize> = joined.into_iter().flatten().collect();
            part.push(index);
            parts = apart;
            parts.push(part);
        }
        parts
    }

    /// The receptances of one part, with the directions of that part only.
    pub(super) fn of_part(&self, part: &[usize]) -> Self {
        let kept = |all: &[Direction], is_of: &dyn Fn(usize) -> Direction| -> Vec<Direction> {
            let is_kept = |direction: &Direction| part.iter().any(|&index| is_of(index) == *direction);
            all.iter().copied().filter(is_kept).collect()
        };
        let response = |index: usize| self.responses[self.places[index].0];
        let force = |index: usize| self.forces[self.places[index].1];
        let responses = kept(&self.responses, &response);
        let forces = kept(&self.forces, &force);
        let place = |all: &[Direction], direction: Direction| {
            all.iter()
                .position(|known| *known == direction)
                .unwrap_or_default()
        };
        Self {
            frequency_hz: self.frequency_hz.clone(),
            places: part
                .iter()
                .map(|&index| (place(&responses, response(index)), place(&forces, force(index))))
                .collect(),
            response_points: vec![0; responses.len()],
            force_points: vec![0; forces.len()],
            responses,
            forces,
            values: part.iter().map(|&index| self.values[index].clone()).collect(),
            deviation: part.iter().map(|&index| self.deviation[index].clone()).collect(),
            folding: part
                .iter()
                .map(|&index| self.folding.get(index).cloned().unwrap_or_default())
                .collect(),
            ..*self
        }
    }

    /// Checks that within every part of coupled directions each response has a receptance for each force: residue
    /// matrices of rank one require it.
    fn is_whole(&self) -> Result<(), ModesError> {
        for part in self.parts() {
            let places = || part.iter().map(|&index| self.places[index]);
            for (p, _) in places() {
                for (_, q) in places() {
                    if !self.places.contains(&(p, q)) {
                        let (response, force) = (self.responses[p], self.forces[q]);
                        return Err(ModesError::Data(format!(
                            "h{response}{force} is missing; every response needs its receptance by every force, or, with h{response}{response} and \
                             h{force}{force} alone, none by the other: then both directions are identified as uncoupled"
                        )));
                    }
                }
            }
        }
        Ok(())
    }

    /// Sorts force and response directions of the receptances in the order x, y, z.
    fn sort_directions(&mut self) {
        let order = |directions: &[Direction]| {
            let mut sorted = directions.to_vec();
            sorted.sort_unstable();
            sorted
        };
        let (responses, forces) = (order(&self.responses), order(&self.forces));
        let moved = |old: &[Direction], new: &[Direction], index: usize| {
            new.iter()
                .position(|direction| *direction == old[index])
                .unwrap_or(index)
        };
        for (p, q) in &mut self.places {
            *p = moved(&self.responses, &responses, *p);
            *q = moved(&self.forces, &forces, *q);
        }
        (self.responses, self.forces) = (responses, forces);
    }

    /// Standard deviation of a receptance from its coherence: √((1 − γ²)/γ²·P), with the coherence γ² and the power P
    /// of the response to equal independent forces. For one force this is the error of Bendat and Piersol up to the
    /// number of averages.
    fn by_coherence(&self, index: usize, lines: &[usize], coherence: &[f64]) -> Vec<f64> {
        let response = self.places[index].0;
        let row = || (0..self.values.len()).filter(|&other| self.places[other].0 == response);
        (0..lines.len())
            .map(|k| {
                let power: f64 = row().map(|other| self.values[other][k].norm_sqr()).sum();
                let explained = coherence[lines[k]].max(1e-6);
                ((1.0 - explained).max(0.0) / explained * power).sqrt()
            })
            .collect()
    }

    fn smoothed(&self, index: usize, stated: &[f64]) -> Vec<f64> {
        let values = &self.values[index];
        let power: f64 = values.iter().map(|value| value.norm_sqr()).sum::<f64>() / values.len() as f64;
        let least = LEAST_RELATIVE_DEVIATION * power.sqrt();
        (0..stated.len())
            .map(|k| {
                let near = &stated[k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(stated.len())];
                let variance =
                    near.iter().map(|deviation| deviation * deviation).sum::<f64>() / near.len() as f64;
                variance.sqrt().max(least)
            })
            .collect()
    }
}

fn index_of(directions: &mut Vec<Direction>, direction: Direction) -> usize {
    directions
        .iter()
        .position(|known| *known == direction)
        .unwrap_or_else(|| {
            directions.push(direction);
            directions.len() - 1
        })
}
