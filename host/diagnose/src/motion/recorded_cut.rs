//! The cutting force of a recorded cut along a known motion.
//!
//! The motion u of the tool determines the chip thickness of every tooth j: h = min over earlier passes p of n·(u − u(t
//! − pτ)) + (r_j − r_(j+p)) sin γ + p f sin φ sin γ, because the surface is what all earlier passes left. Here n is the
//! direction of the chip thickness, τ the time between passes, r the runout of a tooth, f the feed per tooth, φ the
//! immersion angle and γ the edge angle. The cutting force is linear in most parameters of the process. It jumps
//! between samples when teeth enter and leave. Its mean over each interval of the upsampled grid drives the structure,
//! with entry, exit and loss of contact within the interval.

use crate::criteria::{SPEED_MISMATCH, UNCERTAIN_SAMPLES};
use crate::error::DiagnoseError;
use crate::motion::chips::{Chips, Sampling};
use crate::motion::spindle_motion::SpindleMotion;
use quietcut_model::case::Case;
use quietcut_model::milling::Cut;
use quietcut_recording::Recording;
use quietcut_simulate::path::SampledMotion;
use quietcut_simulate::{Cutter, Effects, Spindle};

/// Smallest sin φ of the immersion angle φ down to which all passes that a vibrating tooth may miss are evaluated. The
/// feed per tooth f adds about f·sin φ to the chip thickness, so that nearer to the ends of a slot a tooth could miss
/// any number of passes.
const SHALLOW: f64 = 0.1;
/// Largest number of successive passes for which a tooth may leave the workpiece uncut.
const MOST_MISSED: usize = 24;

/// A recorded cut: the tool, its engagement and the spindle angle.
#[derive(Clone, Debug)]
pub(crate) struct RecordedCut {
    /// The tool of the recorded cut with its immersion and axial depth.
    pub cutter: Cutter,
    /// The spindle angle over time.
    pub spindle_motion: SpindleMotion,
    /// Sample rate of the record, Hz.
    rate_hz: f64,
    /// Number of samples of the record.
    count: usize,
    /// Number of earlier tooth passes of which one has left the present surface, if vibrating teeth miss passes; `None`
    /// for two passes, or one revolution and one pass if the teeth differ in radius.
    passes: Option<usize>,
}

/// Immersion and feed of a recording: from its sidecar, otherwise from the case. The feed direction is that of the
/// case.
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

/// Refuses a sidecar that gives another number of teeth than the case, or another speed than the tachometer, `rpm`,
/// rev/min.
///
/// # Errors
/// The case has no tool, or the sidecar contradicts the case or the tachometer.
pub(crate) fn check_sidecar(case: &Case, recording: &Recording, rpm: f64) -> Result<(), DiagnoseError> {
    let (tool, given) = (case.tool()?, recording.sidecar.cut.unwrap_or_default());
    if let Some(teeth) = given.teeth.filter(|teeth| *teeth as usize != tool.teeth) {
        return Err(DiagnoseError::record(
            &recording.path,
            format!(
                "[cut] in the sidecar gives {teeth} teeth, but the case {}: they describe different tools",
                tool.teeth
            ),
        ));
    }
    match given.spindle_rpm {
        Some(stated) if (rpm / stated - 1.0).abs() > SPEED_MISMATCH => Err(DiagnoseError::record(
            &recording.path,
            format!(
                "the tachometer gives {rpm:.1} rev/min, but the sidecar {stated}: check pulses_per_rev of the tachometer"
            ),
        )),
        _ => Ok(()),
    }
}

impl RecordedCut {
    /// The cut of a recording: speed from the tachometer, depth, immersion and feed from the sidecar, the rest from the
    /// case with its extensions. Immersion and feed that the sidecar lacks are those of the case.
    ///
    /// # Errors
    /// The case, the sidecar or the tachometer lacks a value that describes the cut; they contradict each other in the
    /// number of teeth or the speed; or the cut or an extension is not possible.
    pub(crate) fn new(case: &Case, effects: &Effects, recording: &Recording) -> Result<Self, DiagnoseError> {
        let (tool, material, cut) = (case.tool()?, case.material()?, cut_of(case, recording)?);
        let given = recording.sidecar.cut.unwrap_or_default();
        let depth_mm = given.axial_depth_mm.ok_or_else(|| {
            recording.lacks("axial_depth_mm under [cut] in its sidecar (.toml), the axial depth of the cut")
        })?;
        let wrong = |error| DiagnoseError::simulate(&case.path, error);
        let cutter = Cutter::new(tool, material, &cut, 1e-3 * depth_mm).map_err(wrong)?;
        let spindle_motion = SpindleMotion::new(recording, effects.spindle(Spindle::new(1.0)).fluctuation())?;
        let cutter = effects
            .cutter(cutter.at_speed(spindle_motion.rpm()))
            .map_err(wrong)?;
        check_sidecar(case, recording, spindle_motion.rpm())?;
        Ok(Self {
            cutter,
            spindle_motion,
            rate_hz: recording.sample_rate_hz,
            count: recording.len(),
            passes: None,
        })
    }

    /// The chips of every tooth along `motion` for a given spindle motion. `motion` has `finer` samples per sample of
    /// the record; `with_force` is true if the cutting force at the samples of the record is needed.
    pub(crate) fn chips(
        &self,
        spindle_motion: &SpindleMotion,
        motion: &SampledMotion,
        finer: usize,
        with_force: bool,
    ) -> Chips {
        let sampling = Sampling {
            rate_hz: self.rate_hz,
            count: self.count,
            finer,
            passes: self.passes,
        };
        // Without force sensors, no force is compared at the samples of the record.
        Chips::new(&self.cutter, spindle_motion, motion, sampling, |sample| {
            with_force && !self.is_beside(sample as f64 / self.rate_hz)
        })
    }

    /// Sample rate of the record, Hz.
    pub(crate) fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Lets teeth miss passes, as with a tool whose displacement varies by up to `amplitude_m`. Near the ends of a slot
    /// each pass adds only the share `SHALLOW` of the feed per tooth to the chip, so that teeth miss `amplitude_m` /
    /// (`SHALLOW` · feed per tooth) passes after one that cut deep, at most `MOST_MISSED`.
    pub(crate) fn let_miss(&mut self, amplitude_m: f64) {
        let missed = amplitude_m / (SHALLOW * self.cutter.feed_per_tooth_m).max(f64::MIN_POSITIVE);
        self.passes = Some((missed.ceil() as usize).min(MOST_MISSED) + 2);
    }

    /// Number of samples in the first revolutions of the record, whose chips depend on tooth passes before the record.
    pub(crate) fn first_revolutions(&self) -> usize {
        let passes = self.passes.unwrap_or(1).max(self.cutter.teeth.len());
        let revolutions = passes as f64 / self.cutter.teeth.len() as f64;
        ((revolutions * self.spindle_motion.revolution_s() * self.rate_hz).ceil() as usize).min(self.count)
    }

    /// True if a tooth enters or leaves within `UNCERTAIN_SAMPLES` samples of the time `t`.
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
