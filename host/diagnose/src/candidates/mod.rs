//! Candidate causes, one or two files for each effect of the model. The files contain the parts of a cause that depend
//! on records: regressors, start values, bounds. Code that several causes share is, for example, in
//! [`linear_parameter`], [`restoring`], [`process`] and [`sensor`].

pub(crate) mod altered_structure;
mod axial_depth_modulation;
mod backlash;
pub(crate) mod cause;
pub(crate) mod closed_loop;
mod coefficients;
mod coulomb_friction;
mod cross_axis;
mod cubic_damping;
mod cubic_stiffness;
mod damping;
mod drift;
mod edge_force;
pub(crate) mod extension_tables;
mod force_coefficients;
mod force_coefficients_by_one_factor;
mod force_exponent;
mod hysteresis;
mod joint_friction;
mod linear_parameter;
mod mass;
mod missing_mode;
mod mode_coupling;
mod process;
mod process_damping;
mod quadratic_damping;
mod quadratic_stiffness;
mod quintic_stiffness;
mod restoring;
mod runout;
mod sensor;
mod sensor_delay;
mod sensor_gain;
mod sensor_gain_of_force;
mod sensor_offset_from_tool_tip;
mod softening_hardening;
mod speed_fluctuation;
mod stiffness;
mod wear;

use quietcut_model::effects::EffectName;

use self::cause::Cause;

/// The candidate causes of all effects of the model.
pub(crate) fn all() -> Vec<Box<dyn Cause>> {
    EffectName::ALL.into_iter().flat_map(of).collect()
}

/// The candidate causes that compete under the name of one effect, such as drift at a constant rate and drift that
/// settles. The match has no wildcard, so that a new effect without an entry here does not compile.
fn of(effect: EffectName) -> Vec<Box<dyn Cause>> {
    match effect {
        EffectName::Mass => vec![Box::new(mass::CAUSE)],
        EffectName::Stiffness => vec![Box::new(stiffness::CAUSE)],
        EffectName::Damping => vec![Box::new(damping::CAUSE)],
        EffectName::MissingMode => vec![Box::new(missing_mode::MissingMode)],
        EffectName::CubicStiffness => vec![Box::new(cubic_stiffness::CAUSE)],
        EffectName::QuadraticStiffness => vec![Box::new(quadratic_stiffness::CAUSE)],
        EffectName::CubicDamping => vec![Box::new(cubic_damping::CAUSE)],
        EffectName::SofteningHardening => vec![Box::new(softening_hardening::CAUSE)],
        EffectName::QuinticStiffness => vec![Box::new(quintic_stiffness::CAUSE)],
        EffectName::QuadraticDamping => vec![Box::new(quadratic_damping::CAUSE)],
        EffectName::CoulombFriction => vec![
            Box::new(coulomb_friction::SYMMETRIC),
            Box::new(coulomb_friction::ASYMMETRIC),
            Box::new(coulomb_friction::BEHIND_BACKLASH),
            Box::new(coulomb_friction::BEHIND_SOFT_BACKLASH),
        ],
        EffectName::Backlash => vec![Box::new(backlash::CAUSE)],
        EffectName::Hysteresis => vec![Box::new(hysteresis::CAUSE)],
        EffectName::JointFriction => vec![
            Box::new(joint_friction::MICROSLIP),
            Box::new(joint_friction::SLIP),
        ],
        EffectName::ModeCoupling => vec![Box::new(mode_coupling::QUARTIC), Box::new(mode_coupling::CUBIC)],
        EffectName::Drift => vec![Box::new(drift::RATE), Box::new(drift::SETTLING)],
        EffectName::ForceCoefficients => vec![
            Box::new(force_coefficients_by_one_factor::CommonFactor { with_edge: false }),
            Box::new(force_coefficients_by_one_factor::CommonFactor { with_edge: true }),
            Box::new(force_coefficients::FORCE_COEFFICIENTS),
        ],
        EffectName::EdgeForce => vec![Box::new(edge_force::EDGE_FORCE)],
        EffectName::ForceExponent => vec![Box::new(force_exponent::ForceExponent)],
        EffectName::Runout => vec![Box::new(runout::RunoutCause)],
        EffectName::ProcessDamping => vec![Box::new(process_damping::ProcessDampingCause)],
        EffectName::AxialDepthModulation => vec![Box::new(axial_depth_modulation::AxialDepthModulationCause)],
        EffectName::SpeedFluctuation => vec![Box::new(speed_fluctuation::SpeedFluctuationCause)],
        EffectName::Wear => vec![Box::new(wear::WearCause)],
        EffectName::SensorGain => vec![
            Box::new(sensor_gain::SensorGainCause),
            Box::new(sensor_gain_of_force::ForceSensorGainCause),
        ],
        EffectName::SensorDelay => vec![Box::new(sensor_delay::SensorDelayCause)],
        EffectName::CrossAxis => vec![Box::new(cross_axis::CrossAxis)],
        EffectName::SensorOffsetFromToolTip => vec![Box::new(sensor_offset_from_tool_tip::SensorOffsetCause)],
    }
}
