//! Noise of measured forces: in the predicted motion it has the spectrum of the machine's receptance.

use nalgebra::{Complex, DMatrix};
use realfft::RealFftPlanner;

/// Whitens the sum of white sensor noise and white force noise filtered by the receptance of the machine: in units of the sensor noise S(ω)
/// = I + a(ω)·a(ω)ᴴ = L·Lᴴ, whitening is L⁻¹.
///
/// Runs are treated as periodic, which keeps the distances between outputs within a few percent.
pub(crate) struct Whitening {
    /// By run and bin: the matrix L⁻¹, sensors × sensors.
    inverse: Vec<Vec<DMatrix<Complex<f64>>>>,
    sensors: usize,
    samples: usize,
    /// By sensor: standard deviation of all noise over that of the sensor, over all runs.
    pub(crate) growth: Vec<f64>,
}

impl Whitening {
    /// Builds the whitening. `seen(run, bin)` is the matrix a, sensors × forces: readings in units of the sensor noise per force as large
    /// as the noise of its sensor, at the bins of a record of `samples` samples.
    pub(crate) fn new(
        runs: usize,
        sensors: usize,
        samples: usize,
        seen: impl Fn(usize, usize) -> DMatrix<Complex<f64>>,
    ) -> Self {
        let bins = samples / 2 + 1;
        let mut growth = vec![0.0; sensors];
        let mut inverse = Vec::with_capacity(runs);
        for run in 0..runs {
            let of_bin = |bin| {
                let a = seen(run, bin);
                let power = DMatrix::identity(sensors, sensors) + &a * a.adjoint();
                for (sensor, growth) in growth.iter_mut().enumerate() {
                    *growth += power[(sensor, sensor)].re / (bins * runs) as f64;
                }
                let factor = power.cholesky().unwrap();
                factor.l().try_inverse().unwrap()
            };
            inverse.push((0..bins).map(of_bin).collect());
        }
        Self {
            inverse,
            sensors,
            samples,
            growth: growth.into_iter().map(f64::sqrt).collect(),
        }
    }

    /// Whitens readings in units of the sensor noise, run by run and sensor by sensor.
    pub(crate) fn apply(&self, values: &mut [f64]) {
        let mut planner = RealFftPlanner::<f64>::new();
        let (forward, back) = (
            planner.plan_fft_forward(self.samples),
            planner.plan_fft_inverse(self.samples),
        );
        let runs = values.chunks_exact_mut(self.sensors * self.samples);
        for (run, inverse) in runs.zip(&self.inverse) {
            let mut spectra: Vec<Vec<Complex<f64>>> = run
                .chunks_exact_mut(self.samples)
                .map(|samples| {
                    let mut spectrum = forward.make_output_vec();
                    forward.process(samples, &mut spectrum).unwrap();
                    spectrum
                })
                .collect();
            for (bin, inverse) in inverse.iter().enumerate() {
                // The matrix is lower triangular: starting with the last sensor, it can be applied in place.
                for i in (0..self.sensors).rev() {
                    spectra[i][bin] = (0..=i).map(|j| inverse[(i, j)] * spectra[j][bin]).sum();
                }
            }
            for (samples, spectrum) in run.chunks_exact_mut(self.samples).zip(&mut spectra) {
                // The constant and, for an even number of samples, the last bin of a real signal are real.
                spectrum[0].im = 0.0;
                if self.samples.is_multiple_of(2) {
                    spectrum[self.samples / 2].im = 0.0;
                }
                back.process(spectrum, samples).unwrap();
                samples.iter_mut().for_each(|value| *value /= self.samples as f64);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn noise_through_a_filter_becomes_white() {
        // Smoothed noise n_k + n_(k−1), with the spectrum 1 + e^(−iω), read by two sensors with the factors 3 and −2.
        let samples = 4096;
        let filter = |bin: usize| {
            let turn = Complex::from_polar(1.0, -std::f64::consts::TAU * bin as f64 / samples as f64);
            DMatrix::from_column_slice(2, 1, &[(1.0 + turn) * 3.0, (1.0 + turn) * -2.0])
        };
        let whitening = Whitening::new(1, 2, samples, |_, bin| filter(bin));
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let mut draw = || -> Vec<f64> { (0..samples).map(|_| StandardNormal.sample(&mut random)).collect() };
        let (force, first, second) = (draw(), draw(), draw());
        let smooth = |k: usize| force[k] + force[(k + samples - 1) % samples];
        let mut values: Vec<f64> = (0..samples).map(|k| first[k] + 3.0 * smooth(k)).collect();
        values.extend((0..samples).map(|k| second[k] - 2.0 * smooth(k)));
        whitening.apply(&mut values);
        let (x, y) = values.split_at(samples);
        let mean = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / samples as f64;
        // Means of 4096 products of normal deviates scatter by √(2/4096) = 0.022 for squares and by 0.016 otherwise.
        for lag in 0..3 {
            let wanted = if lag == 0 { 1.0 } else { 0.0 };
            assert!((mean(&x[lag..], x) - wanted).abs() < 0.08, "{lag}");
            assert!((mean(&y[lag..], y) - wanted).abs() < 0.08, "{lag}");
            assert!(mean(&x[lag..], y).abs() < 0.06, "{lag}");
        }
        // The noise variances of the two sensors grow to 1 + 9·2 and 1 + 4·2.
        assert!((whitening.growth[0] - 19.0_f64.sqrt()).abs() < 1e-2);
        assert!((whitening.growth[1] - 3.0).abs() < 1e-2);
    }
}
