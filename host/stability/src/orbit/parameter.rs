//! Parameters that branches of forced orbits vary, and the setting of all of them.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Parameter of a cut, or of the nonlinear terms of the structure, that a branch of forced orbits varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Parameter {
    /// Axial depth of cut; in computations m, in results mm.
    Depth,
    /// Spindle speed, rev/min.
    Rpm,
    /// Feed per tooth; in computations m, in results mm.
    Feed,
    /// Factor κ on the cubic stiffness of the structure, K₃ → κ K₃ (thesis eq. 6.27).
    Kappa,
    /// Factor ν on the cubic damping of the structure, C₃ → ν C₃ (thesis eq. 6.27).
    Nu,
}

impl Parameter {
    /// All parameters.
    pub const ALL: [Self; 5] = [Self::Depth, Self::Rpm, Self::Feed, Self::Kappa, Self::Nu];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Rpm => "rpm",
            Self::Feed => "feed",
            Self::Kappa => "kappa",
            Self::Nu => "nu",
        }
    }

    /// Key in results, which ends in the unit.
    pub fn key(self) -> &'static str {
        match self {
            Self::Depth => "depth_mm",
            Self::Rpm => "rpm",
            Self::Feed => "feed_mm",
            Self::Kappa => "kappa",
            Self::Nu => "nu",
        }
    }

    /// Label of an axis in a chart.
    pub fn label(self) -> &'static str {
        match self {
            Self::Depth => "axial depth [mm]",
            Self::Rpm => "spindle speed [rev/min]",
            Self::Feed => "feed per tooth [mm]",
            Self::Kappa => "factor κ on the cubic stiffness",
            Self::Nu => "factor ν on the cubic damping",
        }
    }

    /// Unit of results in the unit of computations.
    pub(super) fn result_unit(self) -> f64 {
        match self {
            Self::Depth | Self::Feed => 1e-3,
            Self::Rpm | Self::Kappa | Self::Nu => 1.0,
        }
    }

    /// Value in the unit of results, from one in the unit of computations.
    pub(super) fn in_results(self, value: f64) -> f64 {
        match self {
            // A product with 1e3 is rounded as the depths of all other results are.
            Self::Depth | Self::Feed => value * 1e3,
            Self::Rpm | Self::Kappa | Self::Nu => value,
        }
    }

    /// This parameter at a value in the unit of computations.
    pub(super) fn at(self, value: f64) -> Place {
        Place {
            parameter: self,
            value: self.in_results(value),
        }
    }
}

/// Parameter and its value in the unit of results: where an error occurred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The parameter.
    pub parameter: Parameter,
    /// Value in the unit of results.
    pub value: f64,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.value;
        match self.parameter {
            Parameter::Depth => write!(f, "{value} mm"),
            Parameter::Rpm => write!(f, "{value} rev/min"),
            Parameter::Feed => write!(f, "{value} mm per tooth"),
            Parameter::Kappa => write!(f, "kappa = {value}"),
            Parameter::Nu => write!(f, "nu = {value}"),
        }
    }
}

/// Values of all parameters at which a forced orbit is computed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Feed per tooth, mm.
    pub feed_mm: f64,
    /// Factor κ on the cubic stiffness.
    pub kappa: f64,
    /// Factor ν on the cubic damping.
    pub nu: f64,
}

impl Setting {
    /// Value of a parameter in the unit of results.
    pub fn get(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Depth => self.depth_mm,
            Parameter::Rpm => self.rpm,
            Parameter::Feed => self.feed_mm,
            Parameter::Kappa => self.kappa,
            Parameter::Nu => self.nu,
        }
    }

    /// The same setting with another value of one parameter, in the unit of results.
    #[must_use]
    pub fn with(mut self, parameter: Parameter, value: f64) -> Self {
        match parameter {
            Parameter::Depth => self.depth_mm = value,
            Parameter::Rpm => self.rpm = value,
            Parameter::Feed => self.feed_mm = value,
            Parameter::Kappa => self.kappa = value,
            Parameter::Nu => self.nu = value,
        }
        self
    }

    /// The same setting with another value of one parameter, in the unit of computations.
    #[must_use]
    pub(super) fn at(self, parameter: Parameter, value: f64) -> Self {
        self.with(parameter, parameter.in_results(value))
    }

    /// Feed per tooth, m.
    pub(super) fn feed_m(&self) -> f64 {
        self.feed_mm * Parameter::Feed.result_unit()
    }

    /// Axial depth, m.
    pub(super) fn depth_m(&self) -> f64 {
        self.depth_mm * Parameter::Depth.result_unit()
    }
}
