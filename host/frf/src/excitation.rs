//! Kinds of excitation of a structure.

use quietcut_recording::{Quantity, RecordedCut, Recording, Sidecar, TestKind};

use super::hammer::is_struck;

/// Kind of excitation; it selects how a record is evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Excitation {
    /// Random excitation, or a cut at constant spindle speed: overlapping windowed segments (Welch's method).
    Random,
    /// Swept sine, or a cut with a speed ramp: one transform of the whole record, averaged over neighbouring lines.
    Sweep,
    /// Hammer test: one segment per impact.
    Hammer,
    /// Step sine: one phasor ratio response/force at each frequency step.
    StepSine,
    /// Multisine or another signal of whole periods: averages over the periods, evaluated at the excited lines.
    Multisine,
}

impl Excitation {
    /// Kind of excitation of a recording, from the kind of test and the speed ramp in its sidecar. Random for shaker
    /// tests, cuts without a speed ramp, idle runs and free decays, and if the sidecar names no kind.
    fn of(sidecar: &Sidecar) -> Self {
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

    /// Kind of excitation of a recording: that of its sidecar; if the sidecar names neither a kind nor parameters of a
    /// cut, a hammer test if the recording has one force channel only and this is the force of a hammer.
    pub(super) fn of_recording(recording: &Recording) -> Self {
        let sidecar = &recording.sidecar;
        let mut forces = recording
            .channels
            .iter()
            .filter(|channel| channel.quantity == Quantity::Force);
        let is_free = sidecar.kind.is_none() && sidecar.cut.is_none_or(|cut| cut == RecordedCut::default());
        match (forces.next(), forces.next()) {
            (Some(force), None) if is_free && is_struck(&force.samples, recording.sample_rate_hz) => {
                Self::Hammer
            }
            _ => Self::of(sidecar),
        }
    }

    /// Name of the kind of excitation in messages and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Sweep => "sweep",
            Self::Hammer => "hammer",
            Self::StepSine => "step-sine",
            Self::Multisine => "multisine",
        }
    }
}
