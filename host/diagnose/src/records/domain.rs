//! The quantity in which a recording is compared with the baseline model: the motion, or the force on the structure.

use crate::baseline::Baseline;
use crate::error::DiagnoseError;
use quietcut_recording::{Quantity, Recording, TestKind};

/// The quantity in which a recording is compared with the baseline model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Domain {
    /// The force F is the input, and the motion y is compared: y − H·(F − f_r), with the receptance H and the nonlinear
    /// restoring forces f_r of the baseline model. In a cut the baseline model predicts F, and a measured force is
    /// compared too. A free decay needs no F.
    Response,
    /// The motion x is the input, and the force F is compared: F − (M ẍ + C ẋ + K x + f_r). So it is if the sidecar
    /// names a motion, as `input = ["x"]`, or, except in free decays, if the structure has a rigid-body mode; never in
    /// a cut.
    Force,
}

impl Domain {
    /// The domain (motion or force) in which a recording is compared, from its kind, its input and its channels, and
    /// from the structure.
    ///
    /// # Errors
    /// The recording lacks a required channel, or it is an idle record to be compared in motion: its excitation is not
    /// known.
    pub(super) fn of(baseline: &Baseline<'_>, recording: &Recording) -> Result<Self, DiagnoseError> {
        let has = |quantity: Quantity| {
            recording
                .channels
                .iter()
                .any(|channel| channel.quantity == quantity)
        };
        let motion = [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration];
        let input = recording.sidecar.input.clone().unwrap_or_default();
        for name in &input {
            if recording.channel(name).is_none() {
                return Err(recording
                    .lacks(format!("{name}, which its sidecar names as its input"))
                    .into());
            }
        }
        if !motion.into_iter().any(has) {
            return Err(recording
                .lacks("channel of motion, such as x [m] or ax [m/s^2]")
                .into());
        }
        let kind = recording.sidecar.kind;
        if kind == Some(TestKind::Cutting) {
            return Ok(Self::Response);
        }
        let driven_by_motion = input
            .iter()
            .filter_map(|name| recording.channel(name))
            .any(|channel| motion.contains(&channel.quantity));
        if driven_by_motion || (baseline.is_free() && kind != Some(TestKind::FreeDecay)) {
            if !has(Quantity::Force) {
                return Err(recording
                    .lacks(
                        "channel of force, such as fx [N]: under an imposed motion, the case predicts the force",
                    )
                    .into());
            }
            return Ok(Self::Force);
        }
        match kind {
            Some(TestKind::Idle) => Err(DiagnoseError::record(
                &recording.path,
                "an idle record has nothing that drives the structure as far as the case knows: shaker, step-sine, sweep, \
             hammer, free-decay and cutting are diagnosed",
            )),
            Some(TestKind::FreeDecay) => Ok(Self::Response),
            _ if has(Quantity::Force) => Ok(Self::Response),
            _ => Err(recording
                .lacks(
                    "channel of the exciting force, such as fx [N] (only kind = \"free-decay\" needs none)",
                )
                .into()),
        }
    }
}
