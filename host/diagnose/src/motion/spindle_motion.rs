//! The spindle angle of a recorded cut, from its tachometer.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use quietcut_numerics::least_squares::{LinearProblem, eliminated};

use crate::criteria::{LARGEST_MODULATION, LEAST_MODULATION_F_RATIO, LEAST_TACHOMETER_EDGES};
use crate::error::DiagnoseError;
use quietcut_recording::{Recording, TachometerEdges};
use quietcut_simulate::{Fluctuation, Spindle};

/// The spindle angle over the time of a record.
#[derive(Clone, Debug)]
pub(crate) struct SpindleMotion {
    spindle: Spindle,
    rpm: f64,
    /// Spindle angle at the beginning of the whole recording, rad. The phase of a speed modulation is given at the same
    /// time.
    start_rad: f64,
    fluctuation: Option<Fluctuation>,
    /// Time from the beginning of the whole recording to the first sample, s: see [`Recording::since_s`].
    since_s: f64,
    /// Times, from the beginning of the whole recording, at which tooth 1 passes immersion angle 0: one edge of the
    /// tachometer per revolution, s.
    edges_s: Vec<f64>,
}

impl SpindleMotion {
    /// Fits the spindle angle to the tachometer of a recording: constant speed, with the speed modulation of the case
    /// if there is one.
    ///
    /// # Errors
    /// The recording has no tachometer channel, or its edges are too few or do not match the tachometer wheel.
    pub(crate) fn new(
        recording: &Recording,
        fluctuation: Option<Fluctuation>,
    ) -> Result<Self, DiagnoseError> {
        let edges = TachometerEdges::new(recording).ok_or_else(|| {
            recording
                .lacks("channel tacho, whose rising edges give the angle of the teeth (a cut cannot be diagnosed without it)")
        })?;
        let starts_s = edges
            .revolutions_s()
            .map_err(|what| DiagnoseError::record(&recording.path, what))?;
        let edges_s: Vec<f64> = starts_s
            .iter()
            .map(|start_s| recording.since_s + start_s)
            .collect();
        if edges_s.len() < LEAST_TACHOMETER_EDGES {
            return Err(DiagnoseError::record(
                &recording.path,
                format!(
                    "the tachometer shows {} revolutions; at least {LEAST_TACHOMETER_EDGES} are required",
                    edges_s.len()
                ),
            ));
        }
        Ok(Self {
            spindle: Spindle::new(1.0),
            rpm: 1.0,
            start_rad: 0.0,
            fluctuation,
            since_s: recording.since_s,
            edges_s,
        }
        .fitted())
    }

    /// The spindle motion fitted to the same tachometer edges, but with the speed modulation `fluctuation`.
    pub(crate) fn with(&self, fluctuation: Fluctuation) -> Self {
        Self {
            fluctuation: Some(fluctuation),
            ..self.clone()
        }
        .fitted()
    }

    /// Least-squares fit of mean speed and start angle to the tachometer edges. The angle that the speed modulation
    /// adds is proportional to the mean speed, so that the angle at an edge is linear in start angle and mean speed.
    fn fitted(mut self) -> Self {
        let count = self.edges_s.len() as f64;
        // At tachometer edge k, from 0 on, the spindle angle is 2πk. The fitted angle is linear in the sum of the edge
        // time and the lead of the speed modulation, both in s.
        let times: Vec<f64> = self.edges_s.iter().map(|t| t + self.modulation_s(*t)).collect();
        let mean_t = times.iter().sum::<f64>() / count;
        let mean_k = 0.5 * (count - 1.0);
        let (mut tt, mut tk) = (0.0, 0.0);
        for (k, t) in times.iter().enumerate() {
            tt += (t - mean_t) * (t - mean_t);
            tk += (t - mean_t) * (k as f64 - mean_k);
        }
        let revolutions_per_s = tk / tt;
        self.rpm = 60.0 * revolutions_per_s;
        self.start_rad = TAU * (mean_k - revolutions_per_s * mean_t);
        let steady = Spindle::new(self.rpm);
        self.spindle = self
            .fluctuation
            .map_or(steady, |fluctuation| steady.fluctuating(fluctuation));
        self
    }

    fn modulation_s(&self, t: f64) -> f64 {
        let steady = Spindle::new(60.0);
        self.fluctuation.map_or(0.0, |fluctuation| {
            steady.fluctuating(fluctuation).angle_rad(t) / TAU - t
        })
    }

    /// Mean spindle speed over the record, rev/min.
    pub(crate) fn rpm(&self) -> f64 {
        self.rpm
    }

    /// Immersion angle of tooth 1 at time `t` after the first sample, rad.
    pub(crate) fn angle_rad(&self, t: f64) -> f64 {
        self.start_rad + self.spindle.angle_rad(self.since_s(t))
    }

    /// Spindle speed at time `t` after the first sample, rad/s.
    pub(crate) fn speed_rad_per_s(&self, t: f64) -> f64 {
        self.spindle.speed_at_rad_per_s(self.since_s(t))
    }

    /// Time since the beginning of the whole recording, s, at time `t` after the first sample.
    pub(crate) fn since_s(&self, t: f64) -> f64 {
        self.since_s + t
    }

    /// Regenerative delay at time `t` after the first sample, for a pitch of `angle_rad` between two teeth, s.
    pub(crate) fn delay_s(&self, t: f64, angle_rad: f64) -> f64 {
        self.spindle.delay_s(self.since_s(t), angle_rad)
    }

    /// Times after the first sample at which tooth 1 passes immersion angle 0, one tachometer edge per revolution, s.
    pub(crate) fn revolutions_s(&self) -> impl Iterator<Item = f64> {
        self.edges_s.iter().map(|edge_s| edge_s - self.since_s)
    }

    /// Mean duration of a revolution, s.
    pub(crate) fn revolution_s(&self) -> f64 {
        60.0 / self.rpm
    }
}

/// Step of the grid of tried frequencies of a speed modulation, in modulation periods over the longest record, from its
/// first to its last tachometer edge.
const STEP: f64 = 0.2;

/// A speed modulation estimated from tachometer edges.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpeedModulation {
    /// Relative amplitude δ, frequency f_m and phase ψ of the modulation.
    pub fluctuation: Fluctuation,
    /// Standard deviations of the errors of the estimated δ, f_m in Hz and ψ in rad, from the residual of the
    /// tachometer edge times.
    pub deviation: [f64; 3],
}

/// The speed modulation that fits the tachometer edges of all records best; `None` if the edges are too few, or if the
/// modulation is not significant or its amplitude too large. Frequencies from 0.7 periods over the longest record (from
/// its first to its last edge) to 0.45 times the lowest spindle frequency are tried.
///
/// Edge k is at the time t with k T₀ = t + δ cos ψ·(1 − cos ωt)/ω + δ sin ψ·sin ωt/ω + constant. The equation is linear
/// in all unknowns except the frequency ω. T₀, the mean duration of a revolution, and the constant differ between
/// records.
pub(crate) fn speed_modulation(spindle_motions: &[&SpindleMotion]) -> Option<SpeedModulation> {
    let longest_s = spindle_motions
        .iter()
        .filter_map(|spindle_motion| Some(spindle_motion.edges_s.last()? - spindle_motion.edges_s.first()?))
        .fold(0.0, f64::max);
    let revolutions_per_s = spindle_motions
        .iter()
        .map(|spindle_motion| 1.0 / spindle_motion.revolution_s())
        .fold(f64::INFINITY, f64::min);
    let edges: usize = spindle_motions
        .iter()
        .map(|spindle_motion| spindle_motion.edges_s.len())
        .sum();
    let free = edges.checked_sub(2 * spindle_motions.len() + 4)? as f64;
    if longest_s <= 0.0 {
        return None;
    }
    let [low_hz, high_hz] = [0.7 / longest_s, 0.45 * revolutions_per_s];
    let step_hz = STEP / longest_s;
    let count = ((high_hz - low_hz) / step_hz).max(0.0) as usize;
    let (_, best_hz) = (0..=count)
        .map(|index| low_hz + step_hz * index as f64)
        .map(|hertz| (fit_modulation(spindle_motions, hertz).left, hertz))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    // Golden-section search for the modulation frequency near the best frequency of the grid.
    let (mut from, mut to) = (best_hz - step_hz, best_hz + step_hz);
    for _ in 0..40 {
        let third = 0.381_966 * (to - from);
        if fit_modulation(spindle_motions, from + third).left
            < fit_modulation(spindle_motions, to - third).left
        {
            to -= third;
        } else {
            from += third;
        }
    }
    let frequency_hz = 0.5 * (from + to);
    let found = fit_modulation(spindle_motions, frequency_hz);
    let gained = (found.without - found.left) / 3.0;
    let delta = found.along.hypot(found.across);
    let is_found = gained > LEAST_MODULATION_F_RATIO * found.left / free && delta < LARGEST_MODULATION;
    is_found.then(|| SpeedModulation {
        fluctuation: Fluctuation {
            delta,
            frequency_hz,
            phase_rad: found.across.atan2(found.along),
        },
        deviation: deviation(spindle_motions, frequency_hz, &found, found.left / free),
    })
}

/// Standard deviations of the errors of the estimated δ, f_m in Hz and ψ in rad, if the tachometer edge times scatter
/// with `variance`, s²; infinite if the three are not identifiable.
fn deviation(
    spindle_motions: &[&SpindleMotion],
    frequency_hz: f64,
    found: &ModulationFit,
    variance: f64,
) -> [f64; 3] {
    let step_hz = 1e-4 * frequency_hz;
    let (along, across) = (found.along, found.across);
    let modulation = |frequency_hz: f64, t: f64| {
        let [c, s] = modulation_s(frequency_hz, t);
        along * c + across * s
    };
    let slopes = |t: f64| {
        let [c, s] = modulation_s(frequency_hz, t);
        let above = modulation(frequency_hz + step_hz, t);
        let below = modulation(frequency_hz - step_hz, t);
        [c, s, (above - below) / (2.0 * step_hz)]
    };
    let matrix = without_lines(spindle_motions, slopes);
    let right = DVector::zeros(matrix.nrows());
    let Ok(fit) = LinearProblem::new(&matrix, &right).solve() else {
        return [f64::INFINITY; 3];
    };
    let covariance = Matrix3::from_fn(|i, j| fit.covariance[(i, j)] * variance);
    let delta = along.hypot(across);
    let of_delta = Vector3::new(along / delta, across / delta, 0.0);
    let of_phase = Vector3::new(-across, along, 0.0) / (delta * delta);
    [of_delta, Vector3::z(), of_phase]
        .map(|gradient| (gradient.transpose() * covariance * gradient)[0].max(0.0).sqrt())
}

/// Result of a least-squares fit of a speed modulation of given frequency to the tachometer edges.
struct ModulationFit {
    /// Components of the relative speed amplitude δ in cosine and sine phase: δ cos ψ (`along`) and δ sin ψ (`across`).
    along: f64,
    across: f64,
    /// Residual sum of squares of the tachometer edge times, s², with the speed modulation (`left`) and without it
    /// (`without`).
    left: f64,
    without: f64,
}

fn fit_modulation(spindle_motions: &[&SpindleMotion], frequency_hz: f64) -> ModulationFit {
    let equations = without_lines(spindle_motions, |t| {
        let [c, s] = modulation_s(frequency_hz, t);
        [c, s, -t]
    });
    let (matrix, right) = (
        equations.columns(0, 2).into_owned(),
        equations.column(2).into_owned(),
    );
    let without = right.norm_squared();
    match LinearProblem::new(&matrix, &right).solve() {
        Ok(fit) => ModulationFit {
            along: fit.parameters[0],
            across: fit.parameters[1],
            left: fit.sum_of_squares,
            without,
        },
        // The cosine and the sine component are linearly dependent at the times of the edges.
        Err(_) => ModulationFit {
            along: 0.0,
            across: 0.0,
            left: without,
            without,
        },
    }
}

/// Lead of the spindle at time `t`, s, per unit of δ cos ψ and of δ sin ψ: (1 − cos ωt)/ω and sin(ωt)/ω.
fn modulation_s(frequency_hz: f64, t: f64) -> [f64; 2] {
    let omega = TAU * frequency_hz;
    [(1.0 - (omega * t).cos()) / omega, (omega * t).sin() / omega]
}

/// Least-squares equations of the three columns `of` at the edge times, after elimination of a straight line in the
/// number of the edge from each record.
fn without_lines(spindle_motions: &[&SpindleMotion], of: impl Fn(f64) -> [f64; 3]) -> DMatrix<f64> {
    let equations: Vec<DMatrix<f64>> = spindle_motions
        .iter()
        .map(|spindle_motion| {
            let edges_s = &spindle_motion.edges_s;
            let middle = 0.5 * (edges_s.len() as f64 - 1.0);
            let rows = edges_s.iter().enumerate().map(|(k, t)| {
                let [first, second, third] = of(*t);
                [1.0, k as f64 - middle, first, second, third]
            });
            eliminated(DMatrix::from_row_iterator(edges_s.len(), 5, rows.flatten()), 2)
        })
        .collect();
    let count = equations.iter().map(DMatrix::nrows).sum();
    let rows = equations.iter().flat_map(DMatrix::row_iter);
    DMatrix::from_row_iterator(count, 3, rows.flat_map(|row| [row[0], row[1], row[2]]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use quietcut_recording::{Channel, Quantity, RecordedChannel, Sidecar};

    fn spindle_motion(edges_s: Vec<f64>) -> SpindleMotion {
        SpindleMotion {
            spindle: Spindle::new(1.0),
            rpm: 1.0,
            start_rad: 0.0,
            fluctuation: None,
            since_s: 0.0,
            edges_s,
        }
        .fitted()
    }

    /// A pulse over the first half of each position of a wheel at 7 rev/s, read as `tacho` from the column `encoder`.
    fn recording(positions: u16, missing: u16) -> Recording {
        let level = |sample: usize| {
            let turns = 7.0 * (sample as f64 * 1e-4 - 0.05) + 10.0;
            let place = turns.fract() * f64::from(positions);
            f64::from(u8::from(
                place.fract() < 0.5 && (place as u16) < positions - missing,
            ))
        };
        let mut sidecar = Sidecar::default();
        sidecar.channels.insert(
            "encoder".into(),
            RecordedChannel {
                name: Some("tacho".into()),
                pulses_per_rev: Some(positions),
                missing: Some(missing),
                ..RecordedChannel::default()
            },
        );
        Recording {
            path: "cut.csv".into(),
            sample_rate_hz: 1e4,
            start_s: 0.0,
            since_s: 0.0,
            channels: vec![Channel {
                name: "tacho".into(),
                quantity: Quantity::Level,
                samples: (0..20_000).map(level).collect(),
            }],
            sidecar,
        }
    }

    #[test]
    fn the_wheel_of_a_renamed_channel_gives_the_speed() {
        for (positions, missing) in [(1, 0), (4, 0), (6, 1), (12, 2)] {
            let found = SpindleMotion::new(&recording(positions, missing), None).unwrap();
            assert!(
                (found.rpm() - 420.0).abs() < 0.1,
                "{positions} {missing}: {}",
                found.rpm()
            );
            // Angle 0 at 0.05 s with a gap, else at the first edge; an edge is located to half a sample.
            let turns = found.angle_rad(0.05) / TAU * f64::from(if missing > 0 { 1 } else { positions });
            assert!(
                (turns - turns.round()).abs() < 5e-3 * f64::from(positions),
                "{positions} {missing}: {turns}"
            );
        }
    }

    #[test]
    fn speed_modulation_is_found_only_if_the_edges_contain_it() {
        let truth = Fluctuation {
            delta: 0.012,
            frequency_hz: 1.7,
            phase_rad: 2.1,
        };
        let edges = |rpm: f64, start: f64, fluctuation: Option<Fluctuation>| {
            let steady = Spindle::new(rpm);
            let spindle = fluctuation.map_or(steady, |fluctuation| steady.fluctuating(fluctuation));
            let times = (0..24).map(|k| spindle.time_s(TAU * f64::from(k) + start));
            // Jitter of the edges: two microseconds, in a fixed irregular sequence.
            times
                .enumerate()
                .map(|(k, t)| t + 2e-6 * (7.3 * (k * k) as f64).sin())
                .collect::<Vec<_>>()
        };
        let modulated = [
            spindle_motion(edges(900.0, 0.4, Some(truth))),
            spindle_motion(edges(1233.0, 2.0, Some(truth))),
        ];
        let SpeedModulation {
            fluctuation: found,
            deviation,
        } = speed_modulation(&modulated.each_ref()).unwrap();
        // The jitter of two microseconds is small against the amplitude δ/ω = 1.1 ms over 24 edges.
        assert!((found.delta / truth.delta - 1.0).abs() < 3e-3, "{found:?}");
        assert!(
            (found.frequency_hz - truth.frequency_hz).abs() < 2e-3,
            "{found:?}"
        );
        assert!((found.phase_rad - truth.phase_rad).abs() < 1e-2, "{found:?}");
        let errors = [
            found.delta - truth.delta,
            found.frequency_hz - truth.frequency_hz,
            found.phase_rad - truth.phase_rad,
        ];
        for (error, deviation) in errors.iter().zip(deviation) {
            // The error from this jitter agrees with the stated standard deviation.
            assert!(error.abs() < 4.0 * deviation, "{errors:?} {deviation:?}");
            assert!(deviation < 1e-2, "{deviation:?}");
        }
        let spindle = Spindle::new(900.0).fluctuating(truth);
        let known = modulated[0].with(truth);
        for i in 0..100 {
            let t = 0.016 * f64::from(i);
            let apart = known.angle_rad(t) - (spindle.angle_rad(t) - 0.4);
            assert!(apart.abs() < 1e-3, "{t}: {apart}");
        }
        let steady = spindle_motion(edges(900.0, 0.4, None));
        assert!(speed_modulation(&[&steady]).is_none());
        assert!((steady.rpm() - 900.0).abs() < 0.01);
    }
}
