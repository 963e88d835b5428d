//! Words of the kinds of bifurcation, units, and the values that a parameter can have.

use crate::case::SPEED_MAX_RPM;
use crate::orbit::{Criticality, Parameter};
use crate::stability::StabilityLoss;

/// Word of a kind of stability loss in options and results.
pub(super) fn word(kind: StabilityLoss) -> &'static str {
    match kind {
        StabilityLoss::Hopf => "torus",
        StabilityLoss::Flip => "flip",
        StabilityLoss::Fold => "fold",
    }
}

/// Word of the criticality of a bifurcation.
pub(super) fn criticality_word(criticality: Criticality) -> &'static str {
    if criticality.is_supercritical() {
        "supercritical"
    } else {
        "subcritical"
    }
}

/// Ending of keys for the unit of a parameter.
pub(super) fn unit(parameter: Parameter) -> &'static str {
    match parameter {
        Parameter::Depth | Parameter::Feed => "mm",
        Parameter::Rpm => "rpm",
        Parameter::Kappa => "kappa",
        Parameter::Nu => "nu",
    }
}

/// Refuses a value that a parameter cannot have.
pub(super) fn possible(parameter: Parameter, value: f64) -> Result<(), String> {
    let (is_possible, right) = match parameter {
        Parameter::Rpm => (
            value > 0.0 && value <= SPEED_MAX_RPM,
            format!("a speed above 0 and up to {SPEED_MAX_RPM} rev/min"),
        ),
        Parameter::Depth | Parameter::Feed => (value >= 0.0, "0 mm or more".to_owned()),
        Parameter::Nu => (value >= 0.0, "a factor of 0 or more".to_owned()),
        Parameter::Kappa => (true, String::new()),
    };
    if is_possible {
        Ok(())
    } else {
        Err(format!(
            "{} = {value} is not possible; needed is {right}",
            parameter.key()
        ))
    }
}
