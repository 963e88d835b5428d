//! Low-pass filtered acceleration of a cut, for the pictures of the report.

use quietcut_core::acceleration::{Block, Sensor};
use quietcut_core::decimation::{Decimation, FRACTION_BITS, State};

/// Acceleration over time in the structure band, the low frequencies with the structural modes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Time since the first sample of the cut, s.
    pub t_s: Vec<f64>,
    /// Acceleration along x, y and z in m/s², one value for each time.
    pub axes: [Vec<f64>; 3],
}

impl Trace {
    /// Filters the blocks into the structure band as the device does, and removes the delay of the filter. The sampling
    /// rate follows from the time stamps of the first and the last block. The trace is empty if no sample precedes the
    /// last block, or if the filter does not support the nominal rate of the sensor.
    pub fn of(blocks: &[Block], sensor: &Sensor) -> Self {
        let mut trace = Self::default();
        let (Ok(decimation), Some(first), Some(last)) = (
            Decimation::new(sensor.nominal_rate),
            blocks.first(),
            blocks.last(),
        ) else {
            return trace;
        };
        let before_last: usize = blocks.iter().rev().skip(1).map(|block| block.counts.len()).sum();
        if before_last == 0 {
            return trace;
        }
        let period_s = last.time.0.saturating_sub(first.time.0) as f64 * 1e-9 / before_last as f64;
        let scale = f64::from(sensor.meters_per_second2_per_count) / f64::from(1 << FRACTION_BITS);
        let delay = f64::from(decimation.structure_delay());
        let mut state = State::new();
        for (index, &counts) in blocks.iter().flat_map(|block| &block.counts).enumerate() {
            let Some(sample) = decimation.step(&mut state, counts).structure else {
                continue;
            };
            let t_s = (index as f64 - delay) * period_s;
            // Values at negative times are left out: they belong to the transient of the filter.
            if t_s < 0.0 {
                continue;
            }
            trace.t_s.push(t_s);
            for (axis, value) in trace.axes.iter_mut().zip(sample) {
                axis.push(scale * f64::from(value));
            }
        }
        trace
    }

    /// Standard deviation of the low-pass filtered acceleration along each axis between two times, m/s².
    pub fn rms(&self, [from_s, to_s]: [f64; 2]) -> [f64; 3] {
        let (from, to) = (
            self.t_s.partition_point(|&t| t < from_s),
            self.t_s.partition_point(|&t| t < to_s),
        );
        std::array::from_fn(|axis| {
            let values = self.axes[axis].get(from..to).unwrap_or_default();
            let count = values.len().max(1) as f64;
            let mean = values.iter().sum::<f64>() / count;
            (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use quietcut_core::units::Nanoseconds;

    use super::*;

    #[test]
    fn the_trace_keeps_amplitude_and_time_of_a_slow_tone() {
        let (rate_hz, tone_hz, counts) = (26_667.0 * 1.02, 17.4, 1000.0);
        let blocks: Vec<Block> = (0..800_u32)
            .map(|sequence| {
                let first = f64::from(sequence) * 64.0;
                Block {
                    sequence,
                    time: Nanoseconds((first / rate_hz * 1e9) as u64),
                    counts: (0..64)
                        .map(|i| {
                            [
                                (counts * (TAU * tone_hz * (first + f64::from(i)) / rate_hz).sin()) as i16,
                                0,
                                0,
                            ]
                        })
                        .collect(),
                    ..Block::default()
                }
            })
            .collect();
        let sensor = Sensor::IIS3DWB_16G;
        let trace = Trace::of(&blocks, &sensor);
        let amplitude = counts * f64::from(sensor.meters_per_second2_per_count);
        for (&t_s, &value) in trace.t_s.iter().zip(&trace.axes[0]).skip(20) {
            let expected = amplitude * (TAU * tone_hz * t_s).sin();
            // Tolerance: half a count of rounding, one count of truncation, and 0.001 dB of filter ripple.
            assert!(
                (value - expected).abs() < 2e-3 * amplitude,
                "{t_s}: {value} {expected}"
            );
        }
        let [x, y, _] = trace.rms([0.5, 1.5]);
        // The interval of 1 s contains no whole number of periods: the relative error of the mean square is at most
        // 1/(4π·17.4).
        assert!(
            (x / (amplitude / 2f64.sqrt()) - 1.0).abs() < 0.01 && y == 0.0,
            "{x} {y}"
        );
        assert_eq!(Trace::of(&[], &sensor), Trace::default());
    }
}
