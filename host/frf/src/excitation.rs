//! How a structure was driven.

use quietcut_recording::{Sidecar, TestKind};

/// How the structure was driven, which decides how a record is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Excitation {
    /// Noise, or a cut: overlapping segments under a window (Welch's method).
    Random,
    /// A frequency that glides: the whole record at once, neighbouring frequencies averaged.
    Sweep,
    /// Blows of a hammer: a segment for each.
    Hammer,
    /// One frequency after the other: phasors of each.
    StepSine,
}

impl Excitation {
    /// What a test is driven by.
    pub(super) fn of(sidecar: &Sidecar) -> Self {
        let glides = sidecar.cut.is_some_and(|cut| cut.last_rpm.is_some());
        match sidecar.kind {
            Some(TestKind::Cutting) if glides => Self::Sweep,
            Some(TestKind::Hammer) => Self::Hammer,
            Some(TestKind::StepSine) => Self::StepSine,
            Some(TestKind::Sweep) => Self::Sweep,
            Some(TestKind::Shaker | TestKind::Cutting | TestKind::Idle | TestKind::FreeDecay) | None => {
                Self::Random
            }
        }
    }

    /// The word for people and scripts.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Sweep => "sweep",
            Self::Hammer => "hammer",
            Self::StepSine => "step-sine",
        }
    }
}
