//! The cutting force of a recorded cut along a motion of the tool.

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
use quietcut_simulate::path::SampledMotion;

/// A recorded cut with the cutting force of the baseline along a motion of the tool.
pub(crate) struct Cutting {
    /// Tool, engagement and spindle angle of the cut.
    pub cut: RecordedCut,
    /// The chips of every tooth along the motion of the tool.
    chips: Chips,
    /// The cutting force that the baseline predicts along the motion of the tool.
    pub force: CutForce,
    finer: usize,
    /// True if the record has a channel of cutting force.
    with_force: bool,
}

impl Cutting {
    /// The cut of a recording with the cutting force of the baseline along the motion `motion` of the tool, which has
    /// `finer` samples per sample of the record. `with_force` is true if forces are measured.
    ///
    /// # Errors
    /// The case or the recording lacks a value that describes the cut, they contradict each other, or an extension does
    /// not apply to the cut.
    pub(super) fn new(
        baseline: &Baseline<'_>,
        recording: &Recording,
        motion: &SampledMotion,
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

    /// Indices of the samples of a channel that are not compared. Forces and accelerations jump when a tooth enters or
    /// leaves, and the tachometer leaves open on which side of the jump a nearby sample lies.
    pub(super) fn skipped(&self, channel: &Observed) -> Vec<usize> {
        if !matches!(channel.pickup.quantity, Quantity::Force | Quantity::Acceleration) {
            return Vec::new();
        }
        let is_beside = |sample: &usize| self.cut.is_beside(*sample as f64 / self.cut.rate_hz());
        (0..channel.measured.len()).filter(is_beside).collect()
    }

    /// The cutting force of the baseline linearized about the motion along which the chips are computed, as means over
    /// the record.
    pub(crate) fn mean_slopes(&self) -> MeanSlopes {
        self.chips.mean_slopes(&self.cut.cutter, &self.cut.spindle_motion)
    }

    /// Recomputes chip thickness and cutting force of the baseline along another motion of the tool.
    pub(super) fn follow(&mut self, motion: &SampledMotion) {
        self.chips = self
            .cut
            .chips(&self.cut.spindle_motion, motion, self.finer, self.with_force);
        self.force = self.force_of(&self.cut.cutter, motion);
    }

    /// The cutting force of the tool `cutter` with the chips of this cut. `motion` must be the motion along which these
    /// chips were computed.
    pub(crate) fn force_of(&self, cutter: &Cutter, motion: &SampledMotion) -> CutForce {
        self.chips.force(cutter, &self.cut.spindle_motion, motion)
    }

    /// The cutting force of the baseline's tool along another spindle motion or another motion of the tool, with new
    /// chips.
    pub(crate) fn force_along(&self, spindle_motion: &SpindleMotion, motion: &SampledMotion) -> CutForce {
        self.cut
            .chips(spindle_motion, motion, self.finer, self.with_force)
            .force(&self.cut.cutter, spindle_motion, motion)
    }
}
