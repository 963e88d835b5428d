//! A record: one recording with the prediction of the baseline.

use std::ops::Range;
use std::path::PathBuf;

use nalgebra::Matrix3;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::baseline::Baseline;
use crate::criteria::{MOVING_OVER_NOISE, RELATIVE_ERROR_OF_CUTS};
use crate::motion::cut_force::CutForce;
use crate::motion::free_decay::Decays;
use crate::records::channel::Observed;
use crate::records::cutting::Cutting;
use crate::records::domain::Domain;
use crate::signal::grid::Grid;
use crate::signal::noise::{BANDS, floor_between_lines, rms, white_floor_beside};
use quietcut_recording::{Quantity, TestKind};
use quietcut_simulate::path::{SampledMotion, restoring_along};

/// For each axis of the force: frequency response of one channel, in the channel's unit per newton, at the bins of the
/// upsampled spectrum. Empty along an axis in which the structure does not move, and for a channel of force.
pub(crate) type Responses = [Vec<Complex64>; 3];

/// Noise-free samples of a record's channels, as an extended case predicts them.
#[derive(Clone, Debug)]
pub(crate) struct Clean {
    /// Noise-free samples, by channel.
    readings: Vec<Vec<f64>>,
    /// Standard deviation of the measurement noise, by channel, in the SI unit of the channel.
    deviations: Vec<f64>,
}

/// One recording with the prediction of the baseline. Only the folder `records` changes it.
pub(crate) struct Record {
    /// File of the recording.
    pub path: PathBuf,
    /// Kind of the test, from the sidecar; `None` if the sidecar does not state it.
    pub kind: Option<TestKind>,
    /// Domain in which the record is compared: motion, in a cut with the force, or force alone.
    pub domain: Domain,
    /// Names of the channels whose sensors are not at the tool tip according to the sidecar.
    pub elsewhere: Vec<String>,
    /// Time and frequency grid of the record, with its transforms.
    pub grid: Grid,
    /// Channels that are compared.
    pub channels: Vec<Observed>,
    /// Forces on the structure along the machine's axes at the samples of the record, N: the measured ones, or in a cut
    /// the cutting force that the baseline predicts. Empty along an axis without force, or along which the structure
    /// does not move.
    pub force_n: [Vec<f64>; 3],
    /// Noise floor of each measured force as a standard deviation of white noise, N: sensor noise and aliased force.
    /// Zero in a cut, and along an axis without force.
    pub force_deviation_n: [f64; 3],
    /// Estimated displacement and velocity of the tool, upsampled: the predicted displacement, corrected at each
    /// frequency towards the measured one by a weight from 0 to 1 (Wiener), with its derivative. In the force domain:
    /// the measured motion within its band.
    pub motion: SampledMotion,
    /// Spectra of the estimated displacement at the samples of the record, by axis, m; beyond both ends of the record
    /// the displacement is continued by reflection and fades out.
    pub displacement: [Vec<Complex64>; 3],
    /// For each channel, in a cut: the estimated motion as this channel reads it, in the unit of the channel; for a
    /// channel of force, its predicted samples. Empty in other tests.
    pub readings: Vec<Vec<f64>>,
    /// Frequency up to which at least 99.5 % of the power of each channel of motion about its mean lies, Hz; at least
    /// three times the frequency resolution 1/duration of the record.
    pub highest_hz: f64,
    /// Lowest natural frequency of the baseline, Hz; 0 without oscillating modes.
    pub lowest_hz: f64,
    /// Highest frequency at which the record is compared with the prediction, Hz.
    pub band_hz: f64,
    /// Receptance H(iω) of the baseline, m/N, at the bins of the upsampled spectrum. In the force domain: dynamic
    /// stiffness of the baseline, N/m, at the bins of the spectrum that is not upsampled.
    pub transfer: Vec<Matrix3<Complex64>>,
    /// For each channel: its frequency response per newton of force, at the bins of the upsampled spectrum. Empty in
    /// the force domain.
    pub(super) responses: Vec<Responses>,
    /// Range of the samples of the record that are compared with the prediction: all samples of other tests. A cut is
    /// compared without its first revolutions, which only determine later chips, and, unless it is short, without as
    /// many samples at its end, where the motion is less certain if the sensors measure velocity or acceleration.
    pub compared: Range<usize>,
    /// For each channel: indices of samples that are not compared, such as those beside a jump of the cutting force.
    pub skipped: Vec<Vec<usize>>,
    /// Free decays of the baseline in each channel, and the fitted initial state of the record.
    pub decays: Decays,
    /// The cut with its force; `None` in other tests.
    pub cut: Option<Cutting>,
    /// By channel, in a cut: prediction of the baseline in closed loop, in which the predicted motion determines the
    /// chips. `None` in other tests and in a cut near or in chatter.
    pub(super) closed: Option<Vec<Vec<f64>>>,
    /// Noise-free samples that determine the motion instead of the measured ones; `None` unless an extended case
    /// supplies them.
    pub clean: Option<Clean>,
    /// True for a cut near or in chatter, whose motion is taken as measured (see `amplification`).
    pub(crate) amplifies: bool,
    /// By axis, in the response domain: weight of the measured motion in the estimated one, 0 to 1, at the bins of the
    /// spectrum that is not upsampled.
    pub(crate) measured_share: [Vec<f64>; 3],
}

/// Results of an earlier prediction of the same record that a new prediction starts from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    /// Noise-free samples of the channels; `None` if none are known.
    pub(crate) clean: Option<Clean>,
    /// True if the cut is known to be near or in chatter, false if it is known not to be; `None` if the record itself
    /// decides.
    pub(crate) amplifies: Option<bool>,
}

impl Record {
    /// Noise variance that the noise of the force sensors causes in a channel, in frequency bands up to half the sample
    /// rate: the mean over each band of Σ σ² |H|² over the forces, with the noise σ of a force and the channel's
    /// frequency response H to it.
    pub(super) fn power_by_force_noise(&self, channel: usize) -> [f64; BANDS] {
        let per_band = std::f64::consts::PI * self.grid.rate_hz() / BANDS as f64 / self.grid.omega(1);
        let from = |band: usize| (band as f64 * per_band).round() as usize;
        std::array::from_fn(|band| {
            let bins = from(band)..from(band + 1).max(from(band) + 1);
            let count = bins.len() as f64;
            let forces = self.force_deviation_n.iter().zip(&self.responses[channel]);
            forces
                .filter(|(deviation_n, _)| **deviation_n > 0.0)
                .map(|(deviation_n, response)| {
                    let response = response.get(bins.clone()).unwrap_or_default();
                    deviation_n * deviation_n * response.iter().map(|bin| bin.norm_sqr()).sum::<f64>() / count
                })
                .sum()
        })
    }

    /// True if the structure can move along `axis`, and a force acts along `axis` or the RMS of a channel that reads
    /// `axis` exceeds `MOVING_OVER_NOISE` standard deviations of its noise.
    pub(crate) fn moves(&self, axis: usize) -> bool {
        !self.motion.x[axis].is_empty()
            && (self.channels.iter().any(|channel| {
                channel.pickup.weights[axis] != 0.0
                    && rms(&channel.measured) > MOVING_OVER_NOISE * channel.deviation
            }) || !self.force_n[axis].is_empty())
    }

    /// Samples of a channel's response to forces along the machine's axes. `force` holds the spectra of the forces,
    /// upsampled or not.
    pub(crate) fn read_response(&self, force: &[Option<Vec<Complex64>>; 3], channel: usize) -> Vec<f64> {
        self.read_by(force, &self.responses[channel], channel)
    }

    /// Samples of a channel's response to forces along the machine's axes, for the given `responses` per newton instead
    /// of the channel's own; otherwise as [`Self::read_response`].
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

    /// Delay of an acceleration channel in a cut, s. Its reading has steps, so the delay is applied in the time domain,
    /// and the channel's `responses` do not contain it. Zero for other channels and in other tests.
    fn step_delay_s(&self, channel: &Observed) -> f64 {
        let reads_steps =
            self.kind == Some(TestKind::Cutting) && channel.pickup.quantity == Quantity::Acceleration;
        if reads_steps { channel.pickup.delay_s } else { 0.0 }
    }

    /// True if some channel responds to a force along `axis`.
    pub(crate) fn responds(&self, axis: usize) -> bool {
        self.responses.iter().any(|response| !response[axis].is_empty())
    }

    /// Response of a channel per newton at the bins of the upsampled spectrum, for the receptance `transfer` at its
    /// sensor, m/N.
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

    /// In the response domain: receptance at a channel's sensor at the bins of the upsampled spectrum, m/N. It is that
    /// at the tool tip, unless the baseline has mode shapes at the sensor.
    pub(crate) fn seen_by<'a>(&'a self, channel: &'a Observed) -> &'a [Matrix3<Complex64>] {
        channel.seen.as_deref().unwrap_or(&self.transfer)
    }

    /// Transfer function [`Observed::factor`] from displacement to the channel's reading, at a frequency bin. It is
    /// zero at the last bin of the upsampled spectrum, where it would not be real.
    pub(crate) fn factor(&self, channel: &Observed, bin: usize) -> Complex64 {
        if bin + 1 == self.grid.fine_bins() {
            Complex64::ZERO
        } else {
            channel.factor(self.grid.omega(bin))
        }
    }

    /// Adds −f_r to the force spectra `force`, with the restoring forces f_r of the baseline's terms
    /// ([`Baseline::terms`]) along the estimated motion.
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

    /// Computes the free decays of the baseline in every channel, each from a unit initial value of one state variable.
    pub(crate) fn prepare_decays(&mut self, baseline: &Baseline<'_>) {
        let pickups = self.channels.iter().map(|channel| &channel.pickup);
        self.decays = Decays::of(baseline, &self.grid, pickups, &self.skipped);
    }

    /// Accepts the samples `predicted`, which contain no free decay, as prediction of the record: sets the samples in
    /// `skipped` to the measured value, adds the best-fitting free decay to the others, and estimates the noise from
    /// the residual unless an extended case supplies it.
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
                None if self.kind == Some(TestKind::Cutting) => {
                    floor_between_lines(&residual, size).hypot(RELATIVE_ERROR_OF_CUTS * size)
                }
                None => white_floor_beside(&residual, size, &of_forces[index]),
            };
        }
    }

    /// Residuals by channel, in the response domain, without the free decay of the baseline and the offsets that fit them best.
    pub(crate) fn without_decay(&self, residuals: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let sizes: Vec<f64> = self.channels.iter().map(|channel| channel.deviation).collect();
        let mut decays = self.decays.clone();
        decays.fit(residuals, &sizes);
        let channels = residuals.iter().enumerate();
        channels
            .map(|(index, residual)| decays.without(index, residual))
            .collect()
    }

    /// Stores the closed-loop prediction, in which the predicted motion determines the chips. The samples in `skipped`
    /// take the value of the prediction along the estimated motion. If an extended case supplied noise-free samples,
    /// the closed-loop prediction replaces them.
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

    /// Largest root mean square, over the channels of motion, of the measured minus the predicted samples in the
    /// compared range, in standard deviations of the channel's noise. If an extended case supplies noise-free samples,
    /// they replace the measured ones.
    pub(crate) fn distance_from_closed_loop(&self) -> f64 {
        (0..self.channels.len())
            .filter(|index| self.channels[*index].pickup.quantity != Quantity::Force)
            .map(|index| rms(&self.to_correct(index)[self.compared.clone()]) / self.channels[index].deviation)
            .fold(0.0, f64::max)
    }

    /// Noise-free samples of the channels under the assumption that the baseline is right: the closed-loop prediction
    /// if there is one, otherwise the prediction along the estimated motion.
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

    /// Prediction error of a channel from which the motion is corrected: measured samples, or noise-free ones of an
    /// extended case if known, minus predicted samples.
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

    /// Samples of every channel for a cutting force: the response to it, or the force itself. Motion is sampled without
    /// anti-aliasing filter: content above half the sample rate is aliased.
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

    /// Spectra of a cutting force on the upsampled grid, corrected for the averaging over its intervals; `None` along
    /// an axis of the force to which no channel responds.
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
}
