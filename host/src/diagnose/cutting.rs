//! A recorded cut beside what the baseline predicts of it.

use num_complex::Complex64;
use rayon::prelude::*;

use super::DiagnoseError;
use super::cut::{CutForce, RecordedCut};
use super::motion;
use super::record::{Observed, Record};
use super::scene::Baseline;
use crate::recording::{Quantity, Recording};

/// Rounds in which force and motion settle: the motion comes from the force, the chip from the motion.
const ROUNDS: usize = 4;

/// A cut with its force as it is believed.
pub struct Cutting {
    /// The cut.
    pub cut: RecordedCut,
    /// Its force along the motion, as the baseline has it.
    pub force: CutForce,
    /// True at samples beside an entry or exit, whose forces are not compared.
    beside: Vec<bool>,
}

impl Cutting {
    fn new(baseline: &Baseline<'_>, record: &Record, recording: &Recording) -> Result<Self, DiagnoseError> {
        let cut = RecordedCut::new(baseline.case, &baseline.effects, recording)?;
        let grid = &record.grid;
        let beside = (0..grid.count())
            .map(|sample| cut.is_beside(sample as f64 / grid.rate_hz()))
            .collect();
        Ok(Self {
            force: cut.force(&cut.believed(), &record.motion, grid.finer()),
            cut,
            beside,
        })
    }
}

impl Record {
    /// What every channel reads of a cutting force: the response to it, or the force itself, at the samples of the record. The
    /// motion is taken at its instants, without a filter: it has what lies above half the sample rate folded into it.
    pub fn read_cut(&self, force: &CutForce) -> Vec<Vec<f64>> {
        let spectra = self.cut_spectra(force);
        self.channels
            .par_iter()
            .map(|channel| {
                if channel.pickup.quantity == Quantity::Force {
                    return (0..self.grid.count())
                        .map(|sample| {
                            channel
                                .pickup
                                .read(std::array::from_fn(|axis| force.sampled_n[axis][sample]))
                        })
                        .collect();
                }
                self.read_response(&spectra, channel)
            })
            .collect()
    }

    /// Spectra of a cutting force at the bins of the finer grid; the mean over a finer sample is set right.
    fn cut_spectra(&self, force: &CutForce) -> [Option<Vec<Complex64>>; 3] {
        let step_s = 1.0 / (self.grid.rate_hz() * self.grid.finer() as f64);
        std::array::from_fn(|axis| {
            let mut spectrum = self.grid.spectrum_of_fine(&force.mean_n[axis]);
            for (bin, value) in spectrum.iter_mut().enumerate().skip(1) {
                let half = 0.5 * self.grid.omega(bin) * step_s;
                *value *= half / half.sin();
            }
            Some(spectrum)
        })
    }

    /// Predicts all channels of a cut, and learns the motion from what is left.
    pub(super) fn compare_cut(
        &mut self,
        baseline: &Baseline<'_>,
        recording: &Recording,
    ) -> Result<(), DiagnoseError> {
        self.prepare_decays(baseline);
        let mut cutting = Cutting::new(baseline, self, recording)?;
        for round in 0..ROUNDS {
            cutting.force = cutting
                .cut
                .force(&cutting.cut.believed(), &self.motion, self.grid.finer());
            let mut force = self.cut_spectra(&cutting.force);
            self.force_n = std::array::from_fn(|axis| match &force[axis] {
                Some(spectrum) if baseline.axes.contains(&axis) => {
                    self.grid.samples(&spectrum[..self.grid.bins()])
                }
                _ => Vec::new(),
            });
            let mut predicted = self.read_cut(&cutting.force);
            if round > 0 && !baseline.terms.is_empty() {
                let mut terms = [None, None, None];
                self.add_terms(baseline, &mut terms);
                for (channel, predicted) in self.channels.iter().zip(&mut predicted) {
                    if channel.pickup.quantity != Quantity::Force {
                        let added = self.read_response(&terms, channel);
                        predicted
                            .iter_mut()
                            .zip(added)
                            .for_each(|(sum, added)| *sum += added);
                    }
                }
                self.add_terms(baseline, &mut force);
            }
            skip_beside(&cutting.beside, &self.channels, &mut predicted);
            self.accept(predicted);
            motion::learn(self, baseline, &force);
        }
        // What the causes add is measured from the force along the motion as it is known now.
        cutting.force = cutting
            .cut
            .force(&cutting.cut.believed(), &self.motion, self.grid.finer());
        self.cut = Some(cutting);
        Ok(())
    }
}

/// Force samples that are not compared are predicted as they were measured.
fn skip_beside(beside: &[bool], channels: &[Observed], predicted: &mut [Vec<f64>]) {
    for (channel, predicted) in channels.iter().zip(predicted) {
        if channel.pickup.quantity == Quantity::Force {
            for ((predicted, measured), beside) in predicted.iter_mut().zip(&channel.measured).zip(beside) {
                if *beside {
                    *predicted = *measured;
                }
            }
        }
    }
}
