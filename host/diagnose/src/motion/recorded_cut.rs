//! The force of a recorded cut along a known motion.
//!
//! The measured motion u determines the chip thickness of every tooth: h = min over earlier passes p of n·(u − u(t − pτ)) + (r_j − r_(j+p))
//! sin γ + p f sin φ sin γ, because all earlier passes left the surface. The force of the cut is linear in most parameters of the process.
//! It jumps between samples where teeth enter and leave: its mean over each finer sample drives the structure, with entry, exit and loss of
//! contact at their instants.

use crate::criteria::{SPEED_MISMATCH, UNCERTAIN_SAMPLES};
use crate::error::DiagnoseError;
use crate::motion::chips::{Chips, Sampling};
use crate::motion::spindle_motion::SpindleMotion;
use quietcut_model::case::Case;
use quietcut_model::milling::Cut;
use quietcut_recording::Recording;
use quietcut_simulate::path::Motion;
use quietcut_simulate::{Cutter, Effects, Spindle};

/// Share of the feed in a chip, sin φ, down to which earlier surfaces are evaluated.
const SHALLOW: f64 = 0.1;
/// Largest number of passes that a tooth skips.
const MOST_JUMPED: usize = 24;

/// A recorded cut.
#[derive(Clone, Debug)]
pub(crate) struct RecordedCut {
    /// The tool and its engagement.
    pub cutter: Cutter,
    /// The spindle angle.
    pub spindle_motion: SpindleMotion,
    /// Samples per second.
    rate_hz: f64,
    /// Samples of the record.
    count: usize,
    /// Number of earlier passes that may have left the surface, of a cut whose teeth skip passes.
    passes: Option<usize>,
}

/// Immersion and feed of a recording, from its sidecar, else from the case.
///
/// # Errors
/// The case has no cut.
pub(crate) fn cut_of(case: &Case, recording: &Recording) -> Result<Cut, DiagnoseError> {
    let baseline = case.cut()?;
    let given = recording.sidecar.cut.unwrap_or_default();
    Ok(Cut {
        start_deg: given.start_deg.unwrap_or(baseline.start_deg),
        exit_deg: given.exit_deg.unwrap_or(baseline.exit_deg),
        feed_per_tooth_mm: given.feed_per_tooth_mm.unwrap_or(baseline.feed_per_tooth_mm),
        feed_direction_deg: baseline.feed_direction_deg,
    })
}

impl RecordedCut {
    /// The cut of a recording: its working point from the sidecar, the rest from the case with its extensions.
    ///
    /// # Errors
    /// No tool, material or cut in the case, no depth in the sidecar, no tachometer in the recording; or an extension that does not apply.
    pub(crate) fn new(case: &Case, effects: &Effects, recording: &Recording) -> Result<Self, DiagnoseError> {
        let (tool, material, cut) = (case.tool()?, case.material()?, cut_of(case, recording)?);
        let given = recording.sidecar.cut.unwrap_or_default();
        let depth_mm = given.axial_depth_mm.ok_or_else(|| {
            recording.lacks("axial_depth_mm under [cut] in its sidecar (.toml), the axial depth of the cut")
        })?;
        if let Some(teeth) = given.teeth.filter(|teeth| *teeth as usize != tool.teeth) {
            return Err(DiagnoseError::record(
                &recording.path,
                format!(
                    "[cut] in the sidecar gives {teeth} teeth, but the case {}: they describe different tools",
                    tool.teeth
                ),
            ));
        }
        let wrong = |error| DiagnoseError::simulate(&case.path, error);
        let cutter = Cutter::new(tool, material, &cut, 1e-3 * depth_mm)
            .and_then(|cutter| effects.cutter(cutter))
            .map_err(wrong)?;
        let spindle_motion = SpindleMotion::new(recording, effects.spindle(Spindle::new(1.0)).fluctuation())?;
        if let Some(rpm) = given.spindle_rpm
            && (spindle_motion.rpm() / rpm - 1.0).abs() > SPEED_MISMATCH
        {
            return Err(DiagnoseError::record(
                &recording.path,
                format!(
                    "the tachometer gives {:.1} rev/min, but the sidecar {rpm}: check pulses_per_rev of the tachometer",
                    spindle_motion.rpm()
                ),
            ));
        }
        Ok(Self {
            cutter,
            spindle_motion,
            rate_hz: recording.sample_rate_hz,
            count: recording.len(),
            passes: None,
        })
    }

    /// The chips along `motion`, whose samples are `finer` times as dense as those of the record, for this motion of the spindle.
    pub(crate) fn chips(
        &self,
        spindle_motion: &SpindleMotion,
        motion: &Motion,
        finer: usize,
        with_force: bool,
    ) -> Chips {
        let sampling = Sampling {
            rate_hz: self.rate_hz,
            count: self.count,
            finer,
            passes: self.passes,
        };
        // Without force sensors no force is compared at samples.
        Chips::new(&self.cutter, spindle_motion, motion, sampling, |sample| {
            with_force && !self.is_beside(sample as f64 / self.rate_hz)
        })
    }

    /// Samples per second.
    pub(crate) fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Lets teeth skip passes as a tool with amplitude `swing_m` does. Near the ends of a slot, where the feed adds only the share
    /// `SHALLOW` of itself to a chip, a cut ahead of the surface is caught up after swing / (share · feed) passes.
    pub(crate) fn let_jump(&mut self, swing_m: f64) {
        let jumped = swing_m / (SHALLOW * self.cutter.feed_per_tooth_m).max(f64::MIN_POSITIVE);
        self.passes = Some((jumped.ceil() as usize).min(MOST_JUMPED) + 2);
    }

    /// Number of samples in the first revolution, or in as many as the surface depends on: the record lacks the passes before it.
    pub(crate) fn first_turn(&self) -> usize {
        let passes = self.passes.unwrap_or(1).max(self.cutter.teeth.len());
        let turns = passes as f64 / self.cutter.teeth.len() as f64;
        ((turns * self.spindle_motion.turn_s() * self.rate_hz).ceil() as usize).min(self.count)
    }

    /// True where a tooth enters or leaves within `UNCERTAIN_SAMPLES` samples of `t`.
    pub(crate) fn is_beside(&self, t: f64) -> bool {
        let near_rad = UNCERTAIN_SAMPLES / self.rate_hz * self.spindle_motion.speed_rad_per_s(t);
        self.cutter.teeth.iter().any(|tooth| {
            let phi = self.spindle_motion.angle_rad(t) + tooth.angle_rad;
            [self.cutter.start_rad, self.cutter.exit_rad]
                .into_iter()
                .any(|edge| {
                    let apart = (phi - edge).rem_euclid(std::f64::consts::TAU);
                    apart < near_rad || apart > std::f64::consts::TAU - near_rad
                })
        })
    }
}
