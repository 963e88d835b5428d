//! Effects: deviations of a machine, a cut or a sensor from the model of a case. Each effect has one file with its
//! [`EffectSpec`]; its physics stands there or in a file that several effects share.
//!
//! [`EffectName`] lists all effects. Names, keys, help and the table of the documentation follow from their
//! specifications. To add an effect: write its file, name it twice in `effects/mod.rs`, as a module and in the list,
//! and treat it where the compiler asks for it.

mod axial_depth_modulation;
mod backlash;
mod coulomb_friction;
mod cross_axis;
mod cubic_damping;
mod cubic_stiffness;
mod damping;
mod describing;
mod drift;
mod edge_force;
mod effect;
mod error;
mod first_order_section;
mod force_coefficients;
mod force_exponent;
mod hysteresis;
mod joint_friction;
mod linear_change;
mod list;
mod local_force;
mod location;
mod masing_memory;
mod mass;
mod missing_mode;
mod mode_coupling;
pub(crate) mod nearest;
mod parameter;
mod pickup;
mod process_damping;
mod quadratic_damping;
mod quadratic_stiffness;
mod quintic_stiffness;
mod runout;
mod sensor_delay;
mod sensor_gain;
mod sensor_offset_from_tool_tip;
mod set;
mod softening_hardening;
mod spec;
mod speed_fluctuation;
mod stiffness;
pub mod table;
mod values;
mod wear;

#[cfg(test)]
mod joint_friction_tests;
#[cfg(test)]
mod round_trip_tests;
#[cfg(test)]
mod tests;

pub use describing::{DescribingFunction, Harmonic};
pub use effect::Effect;
pub use error::EffectError;
pub use first_order_section::FirstOrderSection;
use list::list;
pub use parameter::{Parameter, Prior, ValueKind};
pub use pickup::Pickup;
pub use set::Effects;
pub use spec::{Argument, Class, EffectSpec, Locations, Treatment};
pub use values::{Value, Values};

list! {
    Mass => mass::MASS,
    Stiffness => stiffness::STIFFNESS,
    Damping => damping::DAMPING,
    MissingMode => missing_mode::MISSING_MODE,
    CubicStiffness => cubic_stiffness::CUBIC_STIFFNESS,
    QuadraticStiffness => quadratic_stiffness::QUADRATIC_STIFFNESS,
    CubicDamping => cubic_damping::CUBIC_DAMPING,
    SofteningHardening => softening_hardening::SOFTENING_HARDENING,
    QuinticStiffness => quintic_stiffness::QUINTIC_STIFFNESS,
    QuadraticDamping => quadratic_damping::QUADRATIC_DAMPING,
    CoulombFriction => coulomb_friction::COULOMB_FRICTION,
    Backlash => backlash::BACKLASH,
    Hysteresis => hysteresis::HYSTERESIS,
    JointFriction => joint_friction::JOINT_FRICTION,
    ModeCoupling => mode_coupling::MODE_COUPLING,
    Drift => drift::DRIFT,
    ForceCoefficients => force_coefficients::FORCE_COEFFICIENTS,
    EdgeForce => edge_force::EDGE_FORCE,
    ForceExponent => force_exponent::FORCE_EXPONENT,
    Runout => runout::RUNOUT,
    ProcessDamping => process_damping::PROCESS_DAMPING,
    AxialDepthModulation => axial_depth_modulation::AXIAL_DEPTH_MODULATION,
    SpeedFluctuation => speed_fluctuation::SPEED_FLUCTUATION,
    Wear => wear::WEAR,
    SensorGain => sensor_gain::SENSOR_GAIN,
    SensorDelay => sensor_delay::SENSOR_DELAY,
    CrossAxis => cross_axis::CROSS_AXIS,
    SensorOffsetFromToolTip => sensor_offset_from_tool_tip::SENSOR_OFFSET_FROM_TOOL_TIP,
}
