//! A recorded cut beside what the baseline predicts of it.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::baseline::Baseline;
use crate::error::DiagnoseError;
use crate::motion::chips::Chips;
use crate::motion::mean_slopes::MeanSlopes;
use crate::motion::recorded_cut::{CutForce, RecordedCut};
use crate::motion::spindle_motion::Turning;
use crate::records::motion_estimate;
use crate::records::record::{Observed, Record};
use crate::records::{amplification, checks};
use crate::signal::noise::rms;
use quietcut_recording::{Quantity, Recording};
use quietcut_simulate::Cutter;
use quietcut_simulate::path::Motion;

/// Rounds in which force and motion settle: the motion comes from the force, the chip from the motion.
const ROUNDS: usize = 4;
/// The same along the motion of a model, at most: until the motion is off the closed loop by no more than this, in units of the noise.
const ROUNDS_OF_A_MODEL: usize = 8;
const SETTLED: f64 = 0.03;

/// A cut with its force as it is believed.
pub(crate) struct Cutting {
    /// The cut.
    pub cut: RecordedCut,
    /// Its chips along the motion.
    chips: Chips,
    /// Its force along the motion, as the baseline has it.
    pub force: CutForce,
    finer: usize,
    /// True where forces are measured.
    with_force: bool,
}

impl Cutting {
    fn new(baseline: &Baseline<'_>, record: &Record, recording: &Recording) -> Result<Self, DiagnoseError> {
        let cut = RecordedCut::new(baseline.case, &baseline.effects, recording)?;
        let grid = &record.grid;
        let with_force = record
            .channels
            .iter()
            .any(|channel| channel.pickup.quantity == Quantity::Force);
        let chips = cut.chips(&cut.turning, &record.motion, grid.finer(), with_force);
        Ok(Self {
            force: chips.force(&cut.cutter, &cut.turning, &record.motion),
            chips,
            finer: grid.finer(),
            with_force,
            cut,
        })
    }

    /// Samples of a channel that are not compared: forces and accelerations jump where a tooth enters or leaves, and the tachometer
    /// does not say on which side a sample beside that is.
    fn skipped(&self, channel: &Observed) -> Vec<usize> {
        if !matches!(channel.pickup.quantity, Quantity::Force | Quantity::Acceleration) {
            return Vec::new();
        }
        let is_beside = |sample: &usize| self.cut.is_beside(*sample as f64 / self.cut.rate_hz());
        (0..channel.measured.len()).filter(is_beside).collect()
    }

    /// How its force answers to a small motion beside the one that its chips are of.
    pub(crate) fn mean_slopes(&self) -> MeanSlopes {
        self.chips.mean_slopes(&self.cut.cutter, &self.cut.turning)
    }

    /// Goes along another motion.
    fn follow(&mut self, motion: &Motion) {
        self.chips = self
            .cut
            .chips(&self.cut.turning, motion, self.finer, self.with_force);
        self.force = self.force_of(&self.cut.cutter, motion);
    }

    /// The force of another tool along the motion that the chips are of.
    pub(crate) fn force_of(&self, cutter: &Cutter, motion: &Motion) -> CutForce {
        self.chips.force(cutter, &self.cut.turning, motion)
    }

    /// The force of the believed tool where it turns or moves otherwise.
    pub(crate) fn force_along(&self, turning: &Turning, motion: &Motion) -> CutForce {
        self.cut
            .chips(turning, motion, self.finer, self.with_force)
            .force(&self.cut.cutter, turning, motion)
    }
}

impl Record {
    /// What every channel reads of a cutting force: the response to it, or the force itself, at the samples of the record. The
    /// motion is taken at its instants, without a filter: it has what lies above half the sample rate folded into it.
    pub(crate) fn read_cut(&self, force: &CutForce) -> Vec<Vec<f64>> {
        let spectra = self.cut_spectra(force);
        self.channels
            .par_iter()
            .enumerate()
            .map(|(index, channel)| {
                if channel.pickup.quantity == Quantity::Force {
                    return (0..self.grid.count())
                        .map(|sample| {
                            channel
                                .pickup
                                .read(std::array::from_fn(|axis| force.sampled_n[axis][sample]))
                        })
                        .collect();
                }
                self.read_response(&spectra, index)
            })
            .collect()
    }

    /// Spectra of a cutting force at the bins of the finer grid; the mean over a finer sample is set right.
    pub(crate) fn cut_spectra(&self, force: &CutForce) -> [Option<Vec<Complex64>>; 3] {
        let step_s = 1.0 / (self.grid.rate_hz() * self.grid.finer() as f64);
        std::array::from_fn(|axis| {
            if !self.responds(axis) {
                return None;
            }
            let mut spectrum = self.grid.spectrum_of_fine(&force.mean_n[axis]);
            for (bin, value) in spectrum.iter_mut().enumerate().skip(1) {
                let half = 0.5 * self.grid.omega(bin) * step_s;
                *value *= half / half.sin();
            }
            Some(spectrum)
        })
    }

    /// Refuses channels whose size cannot be that of this cut. What is predicted first is along no motion at all: forces are about
    /// those of the chips as they are fed; the motion may be larger by far where regeneration amplifies it.
    fn check_units_of_cut(&self) -> Result<(), DiagnoseError> {
        let mut forces = Vec::new();
        for (index, channel) in self.channels.iter().enumerate() {
            let mut response = self.decays.without(index, &channel.predicted);
            let mut measured = channel.measured.clone();
            // There it is as measured.
            for &sample in &self.skipped[index] {
                (response[sample], measured[sample]) = (0.0, 0.0);
            }
            let range = self.compared.clone();
            let (response, measured) = (&response[range.clone()], &measured[range]);
            let name = &channel.pickup.name;
            checks::far_off(&self.path, name, response, measured)?;
            if channel.pickup.quantity == Quantity::Force && rms(response) > 0.0 {
                forces.push(checks::unit(&self.path, name, response, measured, 0.0));
            }
        }
        checks::unless_one_is_right(forces)
    }

    /// Compares what comes after the first turn, and of all but short records what comes before the last.
    fn compare_without_ends(&mut self, cut: &RecordedCut) {
        let (turn, count) = (cut.first_turn(), self.grid.count());
        self.compared = turn..if count > 4 * turn { count - turn } else { count };
    }

    /// Predicts all channels of a cut, and learns the motion from what is left.
    pub(crate) fn compare_cut(
        &mut self,
        baseline: &Baseline<'_>,
        recording: &Recording,
        amplifies: Option<bool>,
    ) -> Result<(), DiagnoseError> {
        let mut cutting = Cutting::new(baseline, self, recording)?;
        self.skipped = self
            .channels
            .iter()
            .map(|channel| cutting.skipped(channel))
            .collect();
        self.compare_without_ends(&cutting.cut);
        self.prepare_decays(baseline);
        let slopes = cutting.mean_slopes();
        self.amplifies = amplifies.unwrap_or_else(|| amplification::amplifies(self, &cutting.cut, &slopes));
        let rounds = if self.clean.is_some() {
            ROUNDS_OF_A_MODEL
        } else {
            ROUNDS
        };
        for round in 0..rounds {
            if round == 1 && self.amplifies {
                cutting.cut.let_jump(self.motion.swing_m());
                self.compare_without_ends(&cutting.cut);
            }
            if round > 0 {
                cutting.follow(&self.motion);
            }
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
                for (index, predicted) in predicted.iter_mut().enumerate() {
                    if self.channels[index].pickup.quantity != Quantity::Force {
                        let added = self.read_response(&terms, index);
                        predicted
                            .iter_mut()
                            .zip(added)
                            .for_each(|(sum, added)| *sum += added);
                    }
                }
                self.add_terms(baseline, &mut force);
            }
            self.accept(predicted);
            if round == 0 && self.clean.is_none() {
                self.check_units_of_cut()?;
            }
            let off = self.off_the_closed_loop();
            // The first force along the motion of a model is that of the measured one still.
            let is_along = (round > 0 || self.clean.is_none()) && !self.amplifies;
            motion_estimate::learn(self, baseline, &force, is_along.then_some(&slopes));
            if self.clean.is_some() && is_along && off < SETTLED {
                break;
            }
        }
        // What the causes add is measured from the force along the motion as it is known now.
        cutting.follow(&self.motion);
        self.cut = Some(cutting);
        Ok(())
    }
}
