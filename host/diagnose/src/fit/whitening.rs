//! Whitens the spectra of a record's channels: after it, their noise has unit variance and is independent between
//! channels.

use nalgebra::Cholesky;
use num_complex::Complex64;

use crate::records::amplification::LoopNoise;
use crate::records::domain::Domain;
use crate::records::record::Record;

/// Whitening by L⁻¹, with the covariance of the channels at each bin S = diag(σ²) + Σ σ_f² h hᴴ = L Lᴴ. The first part
/// is the noise of the channels' own sensors. The second is the response h to noise of the force sensors and to aliased
/// forces, both contained in the noise floor σ_f of each force; it is correlated between channels and absent in the
/// force domain. In a cut near or in chatter, the noise covariance of its closed loop ([`LoopNoise`]) replaces S.
#[derive(Default)]
pub(crate) struct Whitening {
    channels: usize,
    /// For each frequency bin: number of real values per channel, 1 for a real bin (zero and half the sample rate) and
    /// 2 for a complex one.
    numbers: Vec<usize>,
    /// Bin after bin, for each channel: one over the diagonal element of L, the Cholesky factor of the noise covariance
    /// between channels.
    weights: Vec<f64>,
    /// Bin after bin, row by row: elements left of the diagonal of L, the Cholesky factor of the noise covariance
    /// between channels; empty if the channels' noise is independent.
    common: Vec<Complex64>,
}

impl Whitening {
    /// Prepares the whitening of a segment of `length` samples, whose first `bins` bins are compared.
    pub(crate) fn of(record: &Record, length: usize, bins: usize) -> Self {
        let channels = record.channels.len();
        let is_real = |bin: usize| bin == 0 || 2 * bin == length;
        let mut whitening = Self {
            channels,
            numbers: (0..bins).map(|bin| if is_real(bin) { 1 } else { 2 }).collect(),
            weights: Vec::with_capacity(bins * channels),
            common: Vec::new(),
        };
        let forces: Vec<(usize, f64)> = match record.domain {
            Domain::Response => {
                let all = record.force_deviation_n.into_iter().enumerate();
                all.filter(|(_, deviation)| *deviation > 0.0).collect()
            }
            Domain::Force => Vec::new(),
        };
        let of_loop = LoopNoise::of(record);
        let has_common = !forces.is_empty() || of_loop.is_some();
        let deviations: Vec<f64> = record.channels.iter().map(|channel| channel.deviation).collect();
        let mut read = vec![Complex64::ZERO; channels * forces.len()];
        let mut rows = vec![Complex64::ZERO; channels * channels];
        for bin in 0..bins {
            let omega = std::f64::consts::TAU * record.grid.rate_hz() * bin as f64 / length as f64;
            let loud = of_loop
                .as_ref()
                .and_then(|of_loop| Cholesky::new(of_loop.covariance(omega)));
            if let Some(loud) = loud {
                let l = loud.l();
                (0..channels * channels).for_each(|at| rows[at] = l[(at / channels, at % channels)]);
            } else {
                read_of_noise(record, omega, &forces, &mut read);
                factorize(&deviations, &read, &mut rows);
            }
            for i in 0..channels {
                whitening.weights.push(1.0 / rows[i * channels + i].re);
                if has_common {
                    whitening
                        .common
                        .extend_from_slice(&rows[i * channels..i * channels + i]);
                }
            }
        }
        whitening
    }

    /// Whitens the values of all channels: multiplies them by L⁻¹, the inverse Cholesky factor of the noise covariance.
    /// `column` holds them channel after channel.
    pub(crate) fn apply(&self, column: &mut [f64]) {
        let per_channel = column.len() / self.channels.max(1);
        let rows = if self.common.is_empty() {
            0
        } else {
            self.channels * (self.channels - 1) / 2
        };
        let mut at = 0;
        for (bin, numbers) in self.numbers.iter().enumerate() {
            let weights = &self.weights[bin * self.channels..(bin + 1) * self.channels];
            let mut common = self.common[bin * rows..].iter();
            for (i, weight) in weights.iter().enumerate() {
                let place = i * per_channel + at;
                for (j, shared) in (0..i).zip(&mut common) {
                    let known = j * per_channel + at;
                    let imaginary = if *numbers == 2 { column[known + 1] } else { 0.0 };
                    let less = shared * Complex64::new(column[known], imaginary);
                    column[place] -= less.re;
                    if *numbers == 2 {
                        column[place + 1] -= less.im;
                    }
                }
                for value in &mut column[place..place + numbers] {
                    *value *= weight;
                }
            }
            at += numbers;
        }
    }
}

/// Writes into `read`, with one row per channel and one column per force, the channel's response at ω (rad/s) to one
/// standard deviation σ_f of the force's noise. `forces` holds the axis and σ_f of each force.
fn read_of_noise(record: &Record, omega: f64, forces: &[(usize, f64)], read: &mut [Complex64]) {
    let nearest = (omega / record.grid.omega(1)).round() as usize;
    let of_channels = read.chunks_exact_mut(forces.len().max(1));
    for (channel, read) in record.channels.iter().zip(of_channels) {
        let transfer = record.seen_by(channel);
        let transfer = &transfer[nearest.min(transfer.len() - 1)];
        for (read, (from, deviation)) in read.iter_mut().zip(forces) {
            let response: Complex64 = (0..3)
                .map(|axis| transfer[(axis, *from)] * channel.pickup.weights[axis])
                .sum();
            *read = response * channel.factor(omega) * *deviation;
        }
    }
}

/// Writes the Cholesky factor L of the channels' noise covariance S = diag(σ²) + R Rᴴ into `rows`. `deviations` is σ,
/// `read` is R with one row per channel.
fn factorize(deviations: &[f64], read: &[Complex64], rows: &mut [Complex64]) {
    let (channels, forces) = (deviations.len(), read.len() / deviations.len().max(1));
    for i in 0..channels {
        let own = deviations[i] * deviations[i];
        for j in 0..=i {
            let mut sum = Complex64::from(if i == j { own } else { 0.0 });
            for force in 0..forces {
                sum += read[i * forces + force] * read[j * forces + force].conj();
            }
            for k in 0..j {
                sum -= rows[i * channels + k] * rows[j * channels + k].conj();
            }
            rows[i * channels + j] = if i == j {
                // Rounding must not make the whitened variance smaller than that of the channel's own sensor noise.
                Complex64::from(sum.re.max(own).sqrt())
            } else {
                sum / rows[j * channels + j].re
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    #[test]
    fn the_cholesky_factor_reproduces_the_covariance() {
        let deviations = [0.5, 2.0, 1.0];
        let read: Vec<Complex64> = (0..6)
            .map(|k| Complex64::from_polar(1.0 + f64::from(k), 0.7 * f64::from(k * k)))
            .collect();
        let mut rows = vec![Complex64::ZERO; 9];
        factorize(&deviations, &read, &mut rows);
        let l = DMatrix::from_row_slice(3, 3, &rows);
        let r = DMatrix::from_row_slice(3, 2, &read);
        let sensors = DMatrix::from_fn(3, 3, |i, j| {
            Complex64::from(if i == j { deviations[i].powi(2) } else { 0.0 })
        });
        let wanted = sensors + &r * r.adjoint();
        assert!((&l * l.adjoint() - &wanted).norm() < 1e-12 * wanted.norm());
    }

    #[test]
    fn a_signal_common_to_two_channels_counts_once() {
        // Two channels that read one common signal. It has three values: the constant, and real and imaginary part of
        // one bin.
        let rows = [Complex64::new(3.0, -1.0), Complex64::new(0.0, 2.0)];
        let whitening = Whitening {
            channels: 2,
            numbers: vec![1, 2],
            weights: vec![1.0, 0.5, 1.0, 0.25],
            common: rows.to_vec(),
        };
        // In both bins the second channel is the first times its entry of L; whitening removes it.
        let z = Complex64::new(2.0, 5.0);
        let second = rows[1] * z;
        let mut column = vec![7.0, z.re, z.im, 21.0, second.re, second.im];
        whitening.apply(&mut column);
        assert_eq!(column, [7.0, 2.0, 5.0, 0.0, 0.0, 0.0]);
        // A signal in the second channel alone is divided by its own standard deviation.
        let mut column = vec![0.0, 0.0, 0.0, 4.0, 8.0, -4.0];
        whitening.apply(&mut column);
        assert_eq!(column, [0.0, 0.0, 0.0, 2.0, 2.0, -1.0]);
    }
}
