//! One recording beside what the baseline predicts of it.

use std::ops::Range;
use std::path::PathBuf;

use nalgebra::Matrix3;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::baseline::receptance::Receptance;
use crate::baseline::{Baseline, derivatives};
use crate::error::DiagnoseError;
use crate::motion::free_decay::Decays;
use crate::records::checks;
use crate::records::cutting::Cutting;
use crate::records::motion_estimate;
use crate::records::study::Domain;
use crate::signal::grid::Grid;
use crate::signal::noise::{BANDS, floor_between_lines, quiet_floor, rms, white_floor, white_floor_beside};
use quietcut_recording::{Kind, Quantity, Recording};
use quietcut_simulate::effect::Pickup;
use quietcut_simulate::path::{Motion, restoring_along};

/// Share of what a channel reads of a cut to which that is computed: where a tooth enters or leaves is known to a share of a
/// sample, and with it the step of the force.
pub(crate) const TRUSTED_IN_CUTS: f64 = 2e-4;

/// Finer samples per sample of a cut, at least: its force jumps.
const FINER_IN_CUTS: usize = 8;

/// A channel that the baseline predicts.
#[derive(Clone, Debug)]
pub(crate) struct Observed {
    /// What it reads.
    pub pickup: Pickup,
    /// What was measured, SI.
    pub measured: Vec<f64>,
    /// What the baseline says, along the measured motion.
    pub predicted: Vec<f64>,
    /// Standard deviation of its white noise.
    pub deviation: f64,
    /// The time over which it is the mean, s: of accelerations one sample where the velocity jumps, else none.
    mean_s: f64,
    /// The receptance of its sensor's place, where the baseline knows the modes there: see [`Record::seen_by`].
    seen: Option<Vec<Matrix3<Complex64>>>,
}

/// By axis of force: what a channel reads per newton at the bins of the finer samples; empty where it hears nothing of that axis.
pub(crate) type Responses = [Vec<Complex64>; 3];

/// What the channels of a record read without their noise, as a better model has it.
#[derive(Clone, Debug)]
pub(crate) struct Clean {
    /// By channel.
    readings: Vec<Vec<f64>>,
    /// The noise of each.
    deviations: Vec<f64>,
}

/// One recording with its prediction.
pub(crate) struct Record {
    /// Where it was read from.
    pub path: PathBuf,
    /// What kind of test it is.
    pub kind: Option<Kind>,
    /// In what it is compared.
    pub domain: Domain,
    /// Channels whose sensors sit somewhere else than at the tool tip.
    pub elsewhere: Vec<String>,
    /// Its transforms.
    pub grid: Grid,
    /// The channels that are compared.
    pub channels: Vec<Observed>,
    /// Forces that drive the structure, N, in the machine's axes; empty where none does.
    pub force_n: [Vec<f64>; 3],
    /// Floor of each force's spectrum as a deviation of white noise, N: its sensor's noise, and what sampling hides.
    pub force_deviation_n: [f64; 3],
    /// The motion as far as it is known: measured where that tells more than the model, else as the model has it.
    pub motion: Motion,
    /// Its displacement at the samples of the record as spectra, continued smoothly before and after: what that adds are free
    /// decays.
    pub displacement: [Vec<Complex64>; 3],
    /// By channel, of a cut: what it reads of the motion as far as it is known, with what sampling folds into it.
    pub readings: Vec<Vec<f64>>,
    /// Below this lies all but a two-hundredth of the motion's power, Hz.
    pub highest_hz: f64,
    /// Lowest natural frequency of the baseline, Hz; 0 where nothing vibrates.
    pub lowest_hz: f64,
    /// Highest frequency at which the record is compared, Hz.
    pub band_hz: f64,
    /// H(iω) of the baseline at the bins of the finer samples, m/N; in the domain of force the dynamic stiffness at the bins
    /// of the samples, N/m.
    pub transfer: Vec<Matrix3<Complex64>>,
    /// Those of each channel.
    responses: Vec<Responses>,
    /// The samples that are compared: those before are only the past of what follows, and at the end of a cut the motion is known
    /// less well, where its sensors derive from it.
    pub compared: Range<usize>,
    /// By channel: samples that are not compared.
    pub skipped: Vec<Vec<usize>>,
    /// Free decays of the baseline, as the channels read them.
    pub decays: Decays,
    /// The cut, where it is the record of one.
    pub cut: Option<Cutting>,
    /// By channel, of a cut: what it reads of the motion that the baseline has in closed loop.
    closed: Option<Vec<Vec<f64>>>,
    /// What the motion is learned from, where that is known better than from what was measured.
    pub clean: Option<Clean>,
    /// True of a cut in which force and motion amplify one another, so that the motion is taken as it was measured (see `amplification`).
    pub(crate) amplifies: bool,
    /// By axis, of a cut: the share of the measured motion in the one that chips are computed along, at the bins of the samples.
    pub(crate) measured_share: [Vec<f64>; 3],
}

/// What is known of a record before it is read.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    /// What the channels read without their noise.
    pub(crate) clean: Option<Clean>,
    /// Whether the cut amplifies; else the record itself says.
    pub(crate) amplifies: Option<bool>,
}

impl Observed {
    /// Measured less predicted.
    pub(crate) fn residual(&self) -> Vec<f64> {
        self.measured
            .iter()
            .zip(&self.predicted)
            .map(|(a, b)| a - b)
            .collect()
    }

    /// (iω)^q e^(−iωτ), and of a mean over T times sin(ωT/2)/(ωT/2): what becomes of a displacement in this channel, without its weights.
    pub(crate) fn factor(&self, omega: f64) -> Complex64 {
        let half = 0.5 * omega * self.mean_s;
        let mean = if half == 0.0 { 1.0 } else { half.sin() / half };
        Complex64::new(0.0, omega).powi(derivatives(self.pickup.quantity))
            * Complex64::cis(-omega * self.pickup.delay_s)
            * mean
    }
}

impl Record {
    /// Prepares one recording.
    ///
    /// # Errors
    /// A record that tells nothing: too short, clipped, without a channel that is needed, of a kind that is not judged.
    pub(crate) fn new(
        baseline: &Baseline<'_>,
        recording: &Recording,
        known: Known,
    ) -> Result<Self, DiagnoseError> {
        let domain = checks::domain(baseline, recording)?;
        let is_cut = recording.sidecar.kind == Some(Kind::Cutting);
        // What drives a cut is its model; forces that were measured are compared with it.
        let force_n = if is_cut {
            std::array::from_fn(|_| Vec::new())
        } else {
            forces(baseline, recording)
        };
        let mut channels = channels(baseline, recording, domain);
        checks::record(baseline, recording, &channels)?;
        let highest_hz = highest_hz(recording);
        let rate_hz = recording.sample_rate_hz;
        // Harmonics of terms of the motion up to the sixteenth stay below half the finer rate.
        let finer = ((32.0 * highest_hz / rate_hz).ceil() as usize)
            .clamp(if is_cut { FINER_IN_CUTS } else { 1 }, 8)
            .next_power_of_two();
        // What comes around from the end of a cut is a free decay at its beginning, which is taken off.
        let decays = if is_cut { 2.0 } else { 8.0 };
        let room_s = decays * baseline.slowest_decay_s();
        let grid = Grid::new(recording.len(), rate_hz, room_s, finer);
        let transfer = match domain {
            Domain::Response => response(&baseline.receptance, &grid),
            Domain::Force => dynamic_stiffness(baseline, &grid),
        };
        for channel in channels
            .iter_mut()
            .filter(|channel| !channel.pickup.modes.is_empty())
        {
            let seen = baseline.first_order.seen(&channel.pickup.modes);
            channel.seen = Some(response(&Receptance::new(&seen), &grid));
        }
        let count = channels.len();
        let mut record = Self {
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
            motion: Motion::default(),
            displacement: std::array::from_fn(|_| Vec::new()),
            readings: Vec::new(),
            closed: None,
            highest_hz,
            lowest_hz: baseline.lowest_hz().unwrap_or(0.0),
            // Forces of a cut reach to the end of the band.
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
        match domain {
            Domain::Response => {
                let of = |channel| record.responses_by(channel, record.seen_by(channel), &baseline.axes);
                record.responses = record.channels.iter().map(of).collect();
                if is_cut {
                    record.compare_cut(baseline, recording, known.amplifies)?;
                } else {
                    record.compare_responses(baseline);
                }
                record.check_units(is_cut)?;
            }
            Domain::Force => motion_estimate::compare_forces(&mut record, baseline, recording)?,
        }
        Ok(record)
    }

    /// Refuses channels whose size cannot be that of the case; of a cut those of motion, whose forces are checked before.
    fn check_units(&self, is_cut: bool) -> Result<(), DiagnoseError> {
        let checked = |(index, channel): (usize, &Observed)| {
            // Across the force a little of another axis is as large as what is predicted.
            let axis = motion_estimate::main_axis(channel)?;
            if self.force_n[axis].is_empty() || is_cut && channel.pickup.quantity == Quantity::Force {
                return None;
            }
            let range = self.compared.clone();
            let response = self.decays.without(index, &channel.predicted);
            let (response, measured) = (&response[range.clone()], &channel.measured[range]);
            let by_noise = self.energy_by_force_noise(index);
            let name = &channel.pickup.name;
            Some(checks::unit(&self.path, name, response, measured, by_noise))
        };
        let mut checked = self.channels.iter().enumerate().filter_map(checked);
        if is_cut {
            checks::unless_one_is_right(checked)
        } else {
            checked.try_for_each(|checked| checked)
        }
    }

    /// Σ y² of what a channel reads of the response to the noise of the force sensors, over the samples of the record.
    fn energy_by_force_noise(&self, channel: usize) -> f64 {
        let power = self.power_by_force_noise(channel);
        power.iter().sum::<f64>() / BANDS as f64 * self.grid.count() as f64
    }

    /// Power of what a channel reads of the response to the noise of the force sensors, in bands up to half the sample rate: the mean
    /// of σ² |H|² in each.
    fn power_by_force_noise(&self, channel: usize) -> [f64; BANDS] {
        let per_band = std::f64::consts::PI * self.grid.rate_hz() / BANDS as f64 / self.grid.omega(1);
        let from = |band: usize| (band as f64 * per_band).round() as usize;
        std::array::from_fn(|band| {
            let bins = from(band)..from(band + 1).max(from(band) + 1);
            let count = bins.len() as f64;
            let forces = self.force_deviation_n.iter().zip(&self.responses[channel]);
            forces
                .filter(|(deviation_n, _)| **deviation_n > 0.0)
                .map(|(deviation_n, response)| {
                    let heard = response.get(bins.clone()).unwrap_or_default();
                    deviation_n * deviation_n * heard.iter().map(|bin| bin.norm_sqr()).sum::<f64>() / count
                })
                .sum()
        })
    }

    /// True where the motion along `axis` is more than what could be noise.
    pub(crate) fn moves(&self, axis: usize) -> bool {
        !self.motion.x[axis].is_empty()
            && (self.channels.iter().any(|channel| {
                channel.pickup.weights[axis] != 0.0 && rms(&channel.measured) > 3.0 * channel.deviation
            }) || !self.force_n[axis].is_empty())
    }

    /// Samples that a channel reads of the response to forces in the machine's axes, given as spectra of the samples or of
    /// finer ones.
    pub(crate) fn read_response(&self, force: &[Option<Vec<Complex64>>; 3], channel: usize) -> Vec<f64> {
        self.read_by(force, &self.responses[channel], channel)
    }

    /// The same by other responses than those of the channel.
    pub(crate) fn read_by(
        &self,
        force: &[Option<Vec<Complex64>>; 3],
        responses: &Responses,
        channel: usize,
    ) -> Vec<f64> {
        let count = force.iter().flatten().map(Vec::len).max().unwrap_or(0);
        let mut spectrum = vec![Complex64::ZERO; count];
        for (force, response) in force.iter().zip(responses) {
            for ((sum, force), response) in spectrum.iter_mut().zip(force.iter().flatten()).zip(response) {
                *sum += force * response;
            }
        }
        let delay_s = self.step_delay_s(&self.channels[channel]);
        if count == 0 {
            vec![0.0; self.grid.count()]
        } else if delay_s != 0.0 {
            spectrum.resize(self.grid.fine_bins(), Complex64::ZERO);
            self.grid.late_samples_of_fine(&spectrum, delay_s)
        } else if count > self.grid.bins() {
            self.grid.samples_of_fine(&spectrum)
        } else {
            self.grid.samples(&spectrum)
        }
    }

    /// The delay of a channel that reads steps, as the accelerations of a cut are: its responses are those of a channel in time.
    fn step_delay_s(&self, channel: &Observed) -> f64 {
        let reads_steps =
            self.kind == Some(Kind::Cutting) && channel.pickup.quantity == Quantity::Acceleration;
        if reads_steps { channel.pickup.delay_s } else { 0.0 }
    }

    /// True where some channel hears a force along `axis`.
    pub(crate) fn responds(&self, axis: usize) -> bool {
        self.responses.iter().any(|response| !response[axis].is_empty())
    }

    /// What a channel reads per newton where its sensor moves by `transfer`, m/N at the bins of the finer samples.
    pub(crate) fn responses_by(
        &self,
        channel: &Observed,
        transfer: &[Matrix3<Complex64>],
        axes: &[usize],
    ) -> Responses {
        let delay_s = self.step_delay_s(channel);
        std::array::from_fn(|axis| {
            if channel.pickup.quantity == Quantity::Force || !axes.contains(&axis) {
                return Vec::new();
            }
            (0..transfer.len())
                .into_par_iter()
                .map(|bin| {
                    let weights = channel.pickup.weights.iter().enumerate();
                    let read: Complex64 = weights
                        .map(|(row, weight)| transfer[bin][(row, axis)] * *weight)
                        .sum();
                    let in_time = Complex64::cis(self.grid.omega(bin) * delay_s);
                    read * self.factor(channel, bin) * in_time
                })
                .collect()
        })
    }

    /// The receptance of the place of a channel's sensor at the bins of the finer samples, m/N: that of the tool, unless the baseline
    /// knows its modes there.
    pub(crate) fn seen_by<'a>(&'a self, channel: &'a Observed) -> &'a [Matrix3<Complex64>] {
        channel.seen.as_deref().unwrap_or(&self.transfer)
    }

    /// [`Observed::factor`] at a bin; zero at the last one of the finer samples, where it would not be real.
    pub(crate) fn factor(&self, channel: &Observed, bin: usize) -> Complex64 {
        if bin + 1 == self.grid.fine_bins() {
            Complex64::ZERO
        } else {
            channel.factor(self.grid.omega(bin))
        }
    }

    /// Predicts all channels from the forces and the terms of the baseline along the motion, and learns the motion from
    /// what is left; terms move the motion, so that it takes a few rounds.
    fn compare_responses(&mut self, baseline: &Baseline<'_>) {
        self.prepare_decays(baseline);
        let rounds = if baseline.terms.is_empty() { 1 } else { 4 };
        let outside: [Option<Vec<Complex64>>; 3] = std::array::from_fn(|axis| {
            (!self.force_n[axis].is_empty()).then(|| self.grid.spectrum(&self.force_n[axis]))
        });
        for round in 0..rounds {
            let mut force = outside.clone();
            if round > 0 {
                self.add_terms(baseline, &mut force);
            }
            self.predict(&force);
            motion_estimate::learn(self, baseline, &force, None);
        }
        if rounds > 1 {
            let mut force = outside;
            self.add_terms(baseline, &mut force);
            self.predict(&force);
        }
    }

    /// −f_r of the baseline's terms along the motion, as forces.
    pub(crate) fn add_terms(&self, baseline: &Baseline<'_>, force: &mut [Option<Vec<Complex64>>; 3]) {
        for term in &baseline.terms {
            let restoring = restoring_along(&**term, &self.motion);
            for &axis in &baseline.axes {
                if restoring[axis].iter().all(|force| *force == 0.0) {
                    continue;
                }
                let spectrum = self.grid.spectrum_of_fine(&restoring[axis]);
                let sum = force[axis].get_or_insert_with(Vec::new);
                sum.resize(self.grid.fine_bins(), Complex64::ZERO);
                for (sum, restoring) in sum.iter_mut().zip(&spectrum) {
                    *sum -= restoring;
                }
            }
        }
    }

    /// Response to `force` and the free decay that fits best, in every channel; the noise of what is left.
    fn predict(&mut self, force: &[Option<Vec<Complex64>>; 3]) {
        let predicted: Vec<Vec<f64>> = (0..self.channels.len())
            .into_par_iter()
            .map(|channel| self.read_response(force, channel))
            .collect();
        self.accept(predicted);
    }

    /// The free decays of the baseline in every channel.
    pub(crate) fn prepare_decays(&mut self, baseline: &Baseline<'_>) {
        self.decays = Decays::of(baseline, self);
    }

    /// Takes a prediction without free decay, as measured where it is not compared, adds the one that fits best, and looks at the noise of what is left.
    pub(crate) fn accept(&mut self, predicted: Vec<Vec<f64>>) {
        for ((channel, mut predicted), skipped) in self.channels.iter_mut().zip(predicted).zip(&self.skipped)
        {
            for &sample in skipped {
                predicted[sample] = channel.measured[sample];
            }
            channel.predicted = predicted;
        }
        let residuals: Vec<Vec<f64>> = self.channels.iter().map(Observed::residual).collect();
        let sizes: Vec<f64> = self
            .channels
            .iter()
            .map(|channel| rms(&channel.measured))
            .collect();
        self.decays.fit(&residuals, &sizes);
        let of_forces: Vec<[f64; BANDS]> = (0..self.channels.len())
            .map(|channel| self.power_by_force_noise(channel))
            .collect();
        for (index, channel) in self.channels.iter_mut().enumerate() {
            self.decays.add_to(index, &mut channel.predicted);
            let (residual, size) = (channel.residual(), rms(&channel.measured));
            channel.deviation = match &self.clean {
                Some(clean) => clean.deviations[index],
                None if self.kind == Some(Kind::Cutting) => {
                    floor_between_lines(&residual, size).hypot(TRUSTED_IN_CUTS * size)
                }
                None => white_floor_beside(&residual, size, &of_forces[index]),
            };
        }
    }

    /// What the channels read in closed loop, but for samples that are not compared; goes along that if the motion is a model's.
    pub(crate) fn close(&mut self, mut closed: Vec<Vec<f64>>) {
        for ((closed, channel), skipped) in closed.iter_mut().zip(&self.channels).zip(&self.skipped) {
            for &sample in skipped {
                closed[sample] = channel.predicted[sample];
            }
        }
        if let Some(clean) = &mut self.clean {
            clean.readings.clone_from(&closed);
        }
        self.closed = Some(closed);
    }

    /// By how much the motion is off the closed loop, in units of the noise: the most of any channel.
    pub(crate) fn off_the_closed_loop(&self) -> f64 {
        (0..self.channels.len())
            .filter(|index| self.channels[*index].pickup.quantity != Quantity::Force)
            .map(|index| rms(&self.to_correct(index)[self.compared.clone()]) / self.channels[index].deviation)
            .fold(0.0, f64::max)
    }

    /// What the channels read without their noise, if the baseline is right.
    pub(crate) fn predicted(&self) -> Clean {
        let open = || {
            self.channels
                .iter()
                .map(|channel| channel.predicted.clone())
                .collect()
        };
        Clean {
            readings: self.closed.clone().unwrap_or_else(open),
            deviations: self.channels.iter().map(|channel| channel.deviation).collect(),
        }
    }

    /// What the motion corrects in a channel: what was measured, or known to be so without noise, less what is predicted.
    pub(crate) fn to_correct(&self, channel: usize) -> Vec<f64> {
        let observed = &self.channels[channel];
        match &self.clean {
            Some(clean) => {
                let pairs = clean.readings[channel].iter().zip(&observed.predicted);
                pairs.map(|(clean, predicted)| clean - predicted).collect()
            }
            None => observed.residual(),
        }
    }
}

/// Forces along the axes of the baseline, as they act: a force sensor that the baseline knows to be wrong is corrected.
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

/// A force that is white itself has no floor; its noise is taken to be no more than this share of it.
const MOST_FORCE_NOISE: f64 = 0.02;

fn floor_n(force_n: &[f64], kind: Option<Kind>) -> f64 {
    let size = rms(force_n);
    let quiet_n = if kind == Some(Kind::Hammer) {
        quiet_floor(force_n)
    } else {
        f64::INFINITY
    };
    if size > 0.0 {
        white_floor(force_n, size)
            .min(quiet_n)
            .min(MOST_FORCE_NOISE * size)
    } else {
        0.0
    }
}

/// Places that mean the tool tip.
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
            // The force of a cut is an answer as well.
            let compared =
                is_force == (domain == Domain::Force) || recording.sidecar.kind == Some(Kind::Cutting);
            let is_mean = baseline.velocity_jumps && pickup.quantity == Quantity::Acceleration;
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

/// The frequency below which all but half a percent of the power of every channel of motion lies, Hz; at least three times
/// the resolution of the record.
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
                    sum >= 0.995 * whole
                })
                .unwrap_or(0);
            grid.omega(bin) / std::f64::consts::TAU
        })
        .fold(least, f64::max)
}

/// A receptance at the bins of the finer samples.
pub(crate) fn response(receptance: &Receptance, grid: &Grid) -> Vec<Matrix3<Complex64>> {
    (0..grid.fine_bins())
        .into_par_iter()
        .map(|bin| receptance.at(grid.omega(bin)))
        .collect()
}

/// Z(iω) over the axes of the structure; zero where it is not known.
fn dynamic_stiffness(baseline: &Baseline<'_>, grid: &Grid) -> Vec<Matrix3<Complex64>> {
    crate::baseline::dynamic_stiffness::table(&baseline.altered, &baseline.first_order, &baseline.axes, grid)
}
