//! Effects that can be hidden, by the names of answers, and their influence on a machine and its sensors.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::job::CutScale;
use super::law::Law;
use super::machine::{Machine, between, either};
use super::motion::System;
use super::sliders::Sliders;

/// A kind of effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum EffectKind {
    Mass,
    Stiffness,
    Damping,
    /// Mass, stiffness and damping changed by one factor: equivalent to a gain of the only channel.
    CommonFactor,
    MissingMode,
    CubicStiffness,
    QuadraticStiffness,
    CubicDamping,
    QuadraticDamping,
    QuinticStiffness,
    JointFriction,
    SofteningHardening,
    CoulombFriction,
    Backlash,
    Hysteresis,
    ModeCoupling,
    Drift,
    SensorGain,
    SensorDelay,
    CrossAxis,
    SensorOffset,
    /// Sensor offset with a ratio for each mode, of a structure given by modes.
    SensorOffsetByMode,
    ForceCoefficients,
    /// All cutting and edge coefficients changed by one factor: equivalent to a gain of all channels.
    CommonForce,
    EdgeForce,
    ForceExponent,
    Runout,
    ProcessDamping,
    AxialDepthModulation,
    SpeedFluctuation,
    Wear,
    // The following effects are not in the library.
    PulsatingStiffness,
    Stop,
    Stribeck,
    UnmeasuredForce,
    SensorSaturation,
    SensorSquare,
}

/// Effects of the library that tests of structures can hide. Those of [`OF_OWN_FAMILY`] are not among them, so that the draws of the other
/// families stay.
pub(crate) const STRUCTURAL: [EffectKind; 17] = [
    EffectKind::Mass,
    EffectKind::Stiffness,
    EffectKind::Damping,
    EffectKind::MissingMode,
    EffectKind::CubicStiffness,
    EffectKind::QuadraticStiffness,
    EffectKind::CubicDamping,
    EffectKind::SofteningHardening,
    EffectKind::CoulombFriction,
    EffectKind::Backlash,
    EffectKind::Hysteresis,
    EffectKind::ModeCoupling,
    EffectKind::Drift,
    EffectKind::SensorGain,
    EffectKind::SensorDelay,
    EffectKind::CrossAxis,
    EffectKind::SensorOffset,
];

/// Effects of the library on the restoring forces of a machine, linear parameters apart.
pub(crate) const RESTORING: [EffectKind; 11] = [
    EffectKind::MissingMode,
    EffectKind::CubicStiffness,
    EffectKind::QuadraticStiffness,
    EffectKind::CubicDamping,
    EffectKind::QuadraticDamping,
    EffectKind::SofteningHardening,
    EffectKind::CoulombFriction,
    EffectKind::Backlash,
    EffectKind::Hysteresis,
    EffectKind::ModeCoupling,
    EffectKind::Drift,
];

/// Effects of the library that tests of structures hide in a family of their own.
pub(crate) const OF_OWN_FAMILY: [EffectKind; 3] = [
    EffectKind::QuadraticDamping,
    EffectKind::QuinticStiffness,
    EffectKind::JointFriction,
];

/// Effects of the library that belong to the cutting process.
pub(crate) const PROCESS: [EffectKind; 8] = [
    EffectKind::ForceCoefficients,
    EffectKind::EdgeForce,
    EffectKind::ForceExponent,
    EffectKind::Runout,
    EffectKind::ProcessDamping,
    EffectKind::AxialDepthModulation,
    EffectKind::SpeedFluctuation,
    EffectKind::Wear,
];

/// Effects that the library does not have.
pub(crate) const NOT_IN_LIBRARY: [EffectKind; 6] = [
    EffectKind::PulsatingStiffness,
    EffectKind::Stop,
    EffectKind::Stribeck,
    EffectKind::UnmeasuredForce,
    EffectKind::SensorSaturation,
    EffectKind::SensorSquare,
];

/// One effect at one location with given parameters.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cause {
    pub(crate) kind: EffectKind,
    /// Direction of the effect: 0, 1, 2 for x, y, z.
    pub(crate) axis: usize,
    /// Index of the sensor that the effect concerns, in the order of the rig.
    pub(crate) sensor: usize,
    /// Parameters, each divided by a scale so that 1 is an effect that is easily seen.
    pub(crate) shares: Vec<f64>,
}

/// Scales of the parameters of effects.
#[derive(Clone, Debug)]
pub(crate) struct Scale {
    /// Peak displacement of the test, m.
    pub(crate) peak_m: f64,
    /// Duration of a record, s.
    pub(crate) seconds: f64,
    /// Time between samples, s.
    pub(crate) sample_s: f64,
    /// Scales of the cut, if the records are of cuts.
    pub(crate) cut: Option<CutScale>,
}

impl EffectKind {
    /// Effect names in answers: one, or several for a common factor.
    pub(crate) fn names(self) -> &'static [&'static str] {
        match self {
            Self::Mass => &["mass"],
            Self::Stiffness => &["stiffness"],
            Self::Damping => &["damping"],
            Self::CommonFactor => &["mass", "stiffness", "damping"],
            Self::MissingMode => &["missing-mode"],
            Self::CubicStiffness => &["cubic-stiffness"],
            Self::QuadraticStiffness => &["quadratic-stiffness"],
            Self::CubicDamping => &["cubic-damping"],
            Self::QuadraticDamping => &["quadratic-damping"],
            Self::QuinticStiffness => &["quintic-stiffness"],
            Self::JointFriction => &["joint-friction"],
            Self::SofteningHardening => &["softening-hardening"],
            Self::CoulombFriction => &["coulomb-friction"],
            Self::Backlash => &["backlash"],
            Self::Hysteresis => &["hysteresis"],
            Self::ModeCoupling => &["mode-coupling"],
            Self::Drift => &["drift"],
            Self::SensorGain => &["sensor-gain"],
            Self::SensorDelay => &["sensor-delay"],
            Self::CrossAxis => &["cross-axis"],
            Self::SensorOffset | Self::SensorOffsetByMode => &["sensor-offset-from-tool-tip"],
            Self::ForceCoefficients => &["force-coefficients"],
            Self::CommonForce => &["force-coefficients", "edge-force"],
            Self::EdgeForce => &["edge-force"],
            Self::ForceExponent => &["force-exponent"],
            Self::Runout => &["runout"],
            Self::ProcessDamping => &["process-damping"],
            Self::AxialDepthModulation => &["axial-depth-modulation"],
            Self::SpeedFluctuation => &["speed-fluctuation"],
            Self::Wear => &["wear"],
            Self::PulsatingStiffness => &["(pulsating stiffness)"],
            Self::Stop => &["(one-sided stop)"],
            Self::Stribeck => &["(Stribeck friction)"],
            Self::UnmeasuredForce => &["(unmeasured periodic force)"],
            Self::SensorSaturation => &["(saturating sensor)"],
            Self::SensorSquare => &["(sensor with a square)"],
        }
    }

    /// The effect's name in answers, or the first of several.
    pub(crate) fn name(self) -> &'static str {
        self.names()[0]
    }

    /// Number of the effect's fitted parameters.
    pub(crate) fn parameters(self) -> usize {
        match self {
            Self::MissingMode | Self::SpeedFluctuation => 3,
            Self::SofteningHardening | Self::Backlash | Self::Hysteresis | Self::SensorOffsetByMode => 2,
            Self::JointFriction => 2,
            Self::ForceCoefficients | Self::EdgeForce | Self::ForceExponent | Self::Runout => 2,
            _ => 1,
        }
    }

    /// True for an error of a sensor.
    pub(crate) fn of_sensor(self) -> bool {
        matches!(
            self,
            Self::SensorGain
                | Self::SensorDelay
                | Self::CrossAxis
                | Self::SensorOffset
                | Self::SensorOffsetByMode
                | Self::SensorSaturation
                | Self::SensorSquare
        )
    }

    /// True for an effect that acts along one direction.
    pub(crate) fn has_direction(self) -> bool {
        let of_all = matches!(
            self,
            Self::ModeCoupling | Self::Drift | Self::CommonFactor | Self::CommonForce
        );
        !of_all && !self.of_sensor() && !PROCESS.contains(&self)
    }

    /// Draws the scaled parameters of a hidden effect.
    pub(crate) fn draw(self, random: &mut ChaCha8Rng) -> Vec<f64> {
        let size = between(random, 0.1, 1.5);
        match self {
            Self::Mass
            | Self::Stiffness
            | Self::Damping
            | Self::CubicStiffness
            | Self::QuinticStiffness
            | Self::QuadraticStiffness => {
                vec![size * either(random)]
            }
            Self::ModeCoupling | Self::Drift | Self::SensorGain | Self::CrossAxis => {
                vec![size * either(random)]
            }
            // Parameters: natural frequency and modal mass relative to those of the machine, and the damping ratio in between.
            Self::MissingMode => {
                let apart = if random.random::<bool>() {
                    random.random_range(0.55..0.8)
                } else {
                    random.random_range(1.25..1.8)
                };
                vec![apart, between(random, 0.01, 0.05), between(random, 4.0, 60.0)]
            }
            Self::JointFriction => vec![size, random.random_range(0.3..0.9)],
            Self::SofteningHardening => vec![size, random.random_range(0.4..0.7)],
            Self::Backlash => vec![random.random_range(0.15..0.7), between(random, 0.05, 0.5)],
            Self::Hysteresis => vec![between(random, 0.03, 0.3), random.random_range(0.1..0.5)],
            Self::ForceCoefficients | Self::EdgeForce => {
                vec![size * either(random), between(random, 0.1, 1.5) * either(random)]
            }
            Self::ForceExponent => vec![between(random, 0.15, 1.0), random.random_range(0.5..1.5)],
            Self::Runout => vec![size, random.random_range(0.0..6.0)],
            Self::AxialDepthModulation => vec![1.0],
            Self::SensorOffsetByMode => vec![size, between(random, 0.1, 1.5)],
            Self::SpeedFluctuation => vec![
                size,
                random.random_range(0.05..0.25),
                random.random_range(0.0..6.0),
            ],
            _ => vec![size],
        }
    }

    /// Start values of a fit of this effect, as scaled parameters.
    pub(crate) fn starts(self, random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
        match self {
            Self::MissingMode => [0.55, 0.7, 0.9, 1.15, 1.4, 1.7]
                .map(|f| vec![f, 0.02, 30.0])
                .to_vec(),
            Self::SofteningHardening | Self::JointFriction => vec![vec![0.1, 0.5]],
            Self::Backlash => [0.15, 0.35, 0.6].map(|gap| vec![gap, 0.1]).to_vec(),
            Self::Hysteresis => [0.1, 0.3].map(|z| vec![0.05, z]).to_vec(),
            Self::CoulombFriction => vec![vec![0.2]],
            Self::QuadraticDamping => vec![vec![0.02]],
            Self::ForceCoefficients | Self::EdgeForce => vec![vec![0.02, 0.02]],
            Self::ForceExponent => vec![vec![0.1, 1.0]],
            Self::Runout => vec![vec![0.1, 1.0], vec![0.1, 4.0]],
            Self::SpeedFluctuation => vec![vec![0.1, 0.1, 1.0]],
            Self::AxialDepthModulation => vec![vec![0.5]],
            Self::SensorOffsetByMode => vec![vec![0.02, 0.05]],
            _ => vec![vec![0.02 * either(random)]],
        }
    }
}

impl Cause {
    /// True if the machine can have the effect at all.
    pub(crate) fn possible(kind: EffectKind, machine: &Machine) -> bool {
        match kind {
            EffectKind::Mass | EffectKind::Stiffness | EffectKind::Damping | EffectKind::Drift => {
                !machine.modal
            }
            EffectKind::ModeCoupling | EffectKind::CrossAxis => machine.axes.len() >= 2,
            EffectKind::SensorOffsetByMode => machine.modal,
            _ => true,
        }
    }

    /// True values of the parameters, by their keys in answers.
    pub(crate) fn values(&self, machine: &Machine, scale: &Scale) -> Vec<(&'static str, f64)> {
        if let Some(cut) = &scale.cut
            && let Some(values) = self.process_values(machine, cut, scale)
        {
            return values;
        }
        let (a, s) = (self.axis, &self.shares);
        let entry = |matrix: &nalgebra::DMatrix<f64>, change: f64| matrix[(a, a)] * (1.0 + change);
        let k = machine.stiffness_along(a);
        let c = self.damping_along(machine);
        let (peak, speed) = (scale.peak_m, scale.peak_m * machine.omega[0]);
        match self.kind {
            EffectKind::Mass => vec![("mass_kg", entry(&machine.mass, 0.1 * s[0]))],
            EffectKind::Stiffness => vec![("stiffness_n_per_m", entry(&machine.stiffness, 0.1 * s[0]))],
            EffectKind::Damping => vec![("damping_ns_per_m", entry(&machine.damping, 0.3 * s[0]))],
            EffectKind::CommonFactor => vec![("factor", 1.0 + 0.1 * s[0])],
            EffectKind::MissingMode => vec![
                (
                    "frequency_hz",
                    s[0] * self.natural(machine) / std::f64::consts::TAU,
                ),
                ("damping_ratio", s[1]),
                ("modal_mass_kg", s[2] * machine.mass[(0, 0)]),
            ],
            EffectKind::CubicStiffness => vec![("k3_n_per_m3", 0.1 * s[0] * k / peak.powi(2))],
            EffectKind::QuadraticStiffness => vec![("k2_n_per_m2", 0.1 * s[0] * k / peak)],
            EffectKind::QuinticStiffness => vec![("k5_n_per_m5", 0.1 * s[0] * k / peak.powi(4))],
            EffectKind::JointFriction => vec![
                ("softening_n_per_m", 0.1 * s[0] * k),
                ("exponent", s[1]),
                ("reference_m", peak),
            ],
            EffectKind::CubicDamping => vec![("c3_ns3_per_m3", 0.5 * s[0] * c / speed.powi(2))],
            EffectKind::QuadraticDamping => vec![("c2_ns2_per_m2", 0.5 * s[0] * c / speed)],
            EffectKind::SofteningHardening => {
                let k3 = -0.1 * s[0] * k / peak.powi(2);
                vec![
                    ("k3_n_per_m3", k3),
                    ("k5_n_per_m5", -k3 / (2.0 * (s[1] * peak).powi(2))),
                ]
            }
            EffectKind::CoulombFriction => vec![("fc_n", 0.3 * s[0].abs() * c * speed)],
            EffectKind::Backlash => vec![("gap_mm", 2e3 * s[0].abs() * peak), ("stiffness_fraction", s[1])],
            EffectKind::Hysteresis => vec![
                ("hysteretic_stiffness_n_per_m", s[0] * k),
                ("yield_m", s[1].abs() * peak),
            ],
            EffectKind::ModeCoupling => vec![("kxyy_n_per_m3", 0.3 * s[0] * k / peak.powi(2))],
            EffectKind::Drift => vec![("relative_rate_per_s", 0.1 * s[0] / scale.seconds)],
            EffectKind::SensorGain => vec![("gain", 1.0 + 0.1 * s[0])],
            EffectKind::SensorDelay => vec![("delay_s", 0.5 * s[0] * scale.sample_s)],
            EffectKind::CrossAxis => vec![("fraction", 0.1 * s[0])],
            EffectKind::SensorOffset => vec![("ratio", 1.0 - 0.1 * s[0])],
            EffectKind::SensorOffsetByMode => {
                vec![("ratio_1", 1.0 - 0.1 * s[0]), ("ratio_2", 1.0 - 0.1 * s[1])]
            }
            EffectKind::PulsatingStiffness => vec![("stiffness", 0.1 * s[0] * k)],
            EffectKind::Stop => vec![("stiffness", 0.5 * s[0] * k)],
            EffectKind::Stribeck => vec![("kinetic", 0.5 * s[0] * c * speed)],
            EffectKind::UnmeasuredForce => vec![("amplitude", 0.3 * s[0] * c * speed)],
            EffectKind::SensorSaturation => vec![("third", 0.1 * s[0])],
            EffectKind::SensorSquare => vec![("second", 0.1 * s[0])],
            _ => Vec::new(),
        }
    }

    /// Natural frequency along the effect's direction, rad/s.
    fn natural(&self, machine: &Machine) -> f64 {
        let i = if machine.modal { 0 } else { self.axis };
        (machine.stiffness[(i, i)] / machine.mass[(i, i)]).sqrt()
    }

    fn damping_along(&self, machine: &Machine) -> f64 {
        let i = if machine.modal { 0 } else { self.axis };
        machine.damping[(i, i)]
    }

    /// Changes the machine's matrices, if the effect is one of the linear structure.
    pub(crate) fn change(&self, machine: &mut Machine, scale: &Scale) {
        let values = self.values(machine, scale);
        let (a, value) = (self.axis, values[0].1);
        match self.kind {
            EffectKind::Mass => machine.mass[(a, a)] = value,
            EffectKind::Stiffness => machine.stiffness[(a, a)] = value,
            EffectKind::Damping => machine.damping[(a, a)] = value,
            // Modes belong to all directions, and so does their factor.
            EffectKind::CommonFactor if machine.modal => {
                machine.mass *= value;
                machine.damping *= value;
                machine.stiffness *= value;
            }
            EffectKind::CommonFactor => {
                machine.mass[(a, a)] *= value;
                machine.damping[(a, a)] *= value;
                machine.stiffness[(a, a)] *= value;
            }
            EffectKind::MissingMode => {
                let (omega, ratio, mass) = (std::f64::consts::TAU * value, values[1].1, values[2].1);
                let n = machine.mass.nrows();
                let grown = |matrix: &nalgebra::DMatrix<f64>, corner: f64| {
                    let mut grown = matrix.clone().resize(n + 1, n + 1, 0.0);
                    grown[(n, n)] = corner;
                    grown
                };
                machine.mass = grown(&machine.mass, mass);
                machine.damping = grown(&machine.damping, 2.0 * ratio * omega * mass);
                machine.stiffness = grown(&machine.stiffness, mass * omega * omega);
                machine
                    .tip
                    .push(std::array::from_fn(|axis| f64::from(u8::from(axis == a))));
            }
            _ => {}
        }
    }

    /// Adds the effect's law to `system`. Scales are those of the baseline machine.
    pub(crate) fn add(&self, machine: &Machine, scale: &Scale, system: &mut System) {
        let values = self.values(machine, scale);
        let (axis, value) = (self.axis, values[0].1);
        let second = values.get(1).map_or(0.0, |value| value.1);
        let spring = |power, coefficient| Law::Spring {
            axis,
            power,
            coefficient,
        };
        let (k, omega) = (machine.stiffness_along(axis), self.natural(machine));
        match self.kind {
            EffectKind::CubicStiffness => system.add(spring(3, value)),
            EffectKind::QuadraticStiffness => system.add(spring(2, value)),
            EffectKind::QuinticStiffness => system.add(spring(5, value)),
            EffectKind::SofteningHardening => {
                system.add(spring(3, value));
                system.add(spring(5, second));
            }
            EffectKind::CubicDamping => system.add(Law::Damper {
                axis,
                power: 3,
                coefficient: value,
            }),
            EffectKind::QuadraticDamping => system.add(Law::QuadraticDamper {
                axis,
                coefficient: value,
            }),
            EffectKind::CoulombFriction => system.add(Law::Friction {
                axis,
                kinetic_n: value,
                breakaway_n: value,
                stribeck_m_per_s: 1.0,
            }),
            EffectKind::Stribeck => system.add(Law::Friction {
                axis,
                kinetic_n: value,
                breakaway_n: 2.5 * value,
                stribeck_m_per_s: 0.2 * omega * scale.peak_m,
            }),
            EffectKind::Backlash => system.add(Law::Gap {
                axis,
                half_gap_m: 0.5e-3 * value,
                stiffness: second * k,
            }),
            EffectKind::Hysteresis => system.add(Law::BoucWen {
                axis,
                stiffness: value,
                yield_m: second,
                own: 0,
            }),
            EffectKind::JointFriction => {
                // Sliders stronger than that slip in no test.
                let most_m = 4.0 * scale.peak_m;
                system.add_joint(axis, Sliders::new(value, second, scale.peak_m, most_m));
            }
            EffectKind::ModeCoupling => system.add(Law::Coupling {
                axes: [0, 1],
                coefficient: value,
            }),
            EffectKind::Drift => {
                let stiffness = std::array::from_fn(|i| {
                    std::array::from_fn(|j| machine.stiffness.get((i, j)).copied().unwrap_or(0.0))
                });
                system.add(Law::Drift {
                    stiffness,
                    rate_per_s: value,
                });
            }
            EffectKind::PulsatingStiffness => system.add(Law::Pulsating {
                axis,
                stiffness: value,
                omega: 0.37 * omega,
            }),
            EffectKind::Stop => system.add(Law::Stop {
                axis,
                gap_m: 0.3 * scale.peak_m,
                stiffness: value,
            }),
            EffectKind::UnmeasuredForce => system.add(Law::UnmeasuredForce {
                axis,
                amplitude_n: value,
                omega: 0.83 * omega,
                phase: 1.0,
            }),
            _ => {}
        }
    }
}
