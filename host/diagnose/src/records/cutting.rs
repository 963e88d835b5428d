//! The cutting force of a recorded cut along a motion.

use crate::baseline::Baseline;
use crate::error::DiagnoseError;
use crate::motion::chips::Chips;
use crate::motion::cut_force::CutForce;
use crate::motion::mean_slopes::MeanSlopes;
use crate::motion::recorded_cut::RecordedCut;
use crate::motion::spindle_motion::SpindleMotion;
use crate::records::channel::Observed;
use quietcut_recording::{Quantity, Recording};
use quietcut_simulate::Cutter;
use quietcut_simulate::path::Motion;

/// A recorded cut with the force of the baseline along a motion.
pub(crate) struct Cutting {
    /// The recorded cut.
    pub cut: RecordedCut,
    /// The chips along the motion.
    chips: Chips,
    /// The force of the baseline along the motion.
    pub force: CutForce,
    finer: usize,
    /// True where forces are measured.
    with_force: bool,
}

impl Cutting {
    /// The cut of a recording along `motion`, whose samples are `finer` times as dense as those of the record; `with_force` where
    /// forces are measured.
    ///
    /// # Errors
    /// As [`RecordedCut::new`].
    pub(super) fn new(
        baseline: &Baseline<'_>,
        recording: &Recording,
        motion: &Motion,
        finer: usize,
        with_force: bool,
    ) -> Result<Self, DiagnoseError> {
        let cut = RecordedCut::new(baseline.case, &baseline.effects, recording)?;
        let chips = cut.chips(&cut.spindle_motion, motion, finer, with_force);
        Ok(Self {
            force: chips.force(&cut.cutter, &cut.spindle_motion, motion),
            chips,
            finer,
            with_force,
            cut,
        })
    }

    /// Samples of a channel that are not compared. Forces and accelerations jump where a tooth enters or leaves, and the tachometer leaves
    /// open on which side of the jump a nearby sample lies.
    pub(super) fn skipped(&self, channel: &Observed) -> Vec<usize> {
        if !matches!(channel.pickup.quantity, Quantity::Force | Quantity::Acceleration) {
            return Vec::new();
        }
        let is_beside = |sample: &usize| self.cut.is_beside(*sample as f64 / self.cut.rate_hz());
        (0..channel.measured.len()).filter(is_beside).collect()
    }

    /// The force linearized about the motion of the chips.
    pub(crate) fn mean_slopes(&self) -> MeanSlopes {
        self.chips.mean_slopes(&self.cut.cutter, &self.cut.spindle_motion)
    }

    /// Recomputes chips and force along another motion.
    pub(super) fn follow(&mut self, motion: &Motion) {
        self.chips = self
            .cut
            .chips(&self.cut.spindle_motion, motion, self.finer, self.with_force);
        self.force = self.force_of(&self.cut.cutter, motion);
    }

    /// The force of another tool along the motion of the chips.
    pub(crate) fn force_of(&self, cutter: &Cutter, motion: &Motion) -> CutForce {
        self.chips.force(cutter, &self.cut.spindle_motion, motion)
    }

    /// The force of the baseline's tool with another motion of the spindle or of the tool.
    pub(crate) fn force_along(&self, spindle_motion: &SpindleMotion, motion: &Motion) -> CutForce {
        self.cut
            .chips(spindle_motion, motion, self.finer, self.with_force)
            .force(&self.cut.cutter, spindle_motion, motion)
    }
}
