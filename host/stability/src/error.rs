//! Why stability cannot be computed.

use std::path::PathBuf;

use quietcut_frf::FrfError;
use quietcut_model::ModelError;
use quietcut_model::case::CaseError;
use quietcut_model::structure::StructureError;

/// Why stability cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum StabilityError {
    /// The case lacks a section, or has an extension that linear stability cannot treat.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The structure is none.
    #[error("{}: {cause}", path.display())]
    Structure {
        /// The case file.
        path: PathBuf,
        /// What is wrong with it.
        cause: StructureError,
    },
    /// An extension that the case cannot have.
    #[error("{}: {cause}", path.display())]
    Extension {
        /// The case file.
        path: PathBuf,
        /// What is wrong.
        cause: Box<ModelError>,
    },
    /// The method does not cover the case.
    #[error("{}: {what}", path.display())]
    NotCovered {
        /// The case file.
        path: PathBuf,
        /// What is not covered, and what can be done instead.
        what: &'static str,
    },
    /// Receptances are infinite.
    #[error(
        "a mode of {frequency_hz:.4} Hz has no damping: its receptance is infinite there; damping is needed, or a method \
         that does not go through receptances"
    )]
    Undamped {
        /// Frequency of the mode, Hz.
        frequency_hz: f64,
    },
    /// Nothing can couple.
    #[error(
        "mode coupling is not defined here: {found}; two modes that move the tool in feed and normal direction are needed"
    )]
    NoModeCoupling {
        /// What there is.
        found: &'static str,
    },
    /// A table of frequency response functions cannot be used.
    #[error(transparent)]
    Frf(#[from] FrfError),
    /// A table ends before the loop has become small.
    #[error(
        "depths from {deepest_mm:.3} mm on cannot be judged, and {depth_mm} mm was asked for: the frequency response \
         functions end at {last_hz} Hz, where the gain of the loop then reaches 1; measure to higher frequencies, or ask \
         for less depth"
    )]
    EndsEarly {
        /// The depth asked for, mm.
        depth_mm: f64,
        /// The largest depth that can be judged, mm.
        deepest_mm: f64,
        /// Last frequency of the table, Hz.
        last_hz: f64,
    },
    /// What was asked depends on frequencies that a table does not have.
    #[error(
        "at {rpm} rev/min and {depth_mm:.4} mm the cut vibrates at {frequency_hz:.3} Hz, but the frequency response \
         functions were measured from {first_hz} to {last_hz} Hz only; measure there too, or ask for less depth"
    )]
    NotMeasured {
        /// Spindle speed, rev/min.
        rpm: f64,
        /// Axial depth, mm.
        depth_mm: f64,
        /// Frequency of the vibration, Hz.
        frequency_hz: f64,
        /// First frequency of the table, Hz.
        first_hz: f64,
        /// Last frequency of the table, Hz.
        last_hz: f64,
    },
    /// Deviations so large that much of what they describe does not exist.
    #[error(
        "{}: with its deviations (keys that end in _std) {percent:.0} % of the machines are impossible: a damping ratio \
         or a frequency below 0, or indefinite matrices; smaller deviations are needed",
        path.display()
    )]
    Deviations {
        /// The case file.
        path: PathBuf,
        /// How many machines of a hundred.
        percent: f64,
    },
    /// A speed or depth that no cut has.
    #[error("{quantity} {value}: {expected} is needed")]
    Argument {
        /// Which quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// The numbers left the range in which they mean something.
    #[error("at {rpm} rev/min and {depth_mm} mm the computation broke down: {what}")]
    BrokeDown {
        /// Spindle speed, rev/min.
        rpm: f64,
        /// Axial depth, mm.
        depth_mm: f64,
        /// Where.
        what: &'static str,
    },
}
