//! Finds what a simulation model of a milling machine gets wrong: the physical causes, their parameters, and the
//! extension of the case that corrects them.
//!
//! The residual is computed along the measured motion: with H the receptance of the case, F the force and f_r a
//! restoring force that the case lacks, the reading y of a displacement satisfies y − H·F = −H·f_r(x, v) + free decay +
//! noise exactly, also for large f_r. A cause contributes one or few regressors f_r(x, v), and the fit of any set of
//! causes is linear least squares. The few best candidate models are then fitted by prediction error, whose regressors,
//! except near chatter, do not contain the noise of the measured motion: tests of structures are simulated; a study
//! with a cut is predicted again with the extended case. Without a cut, records that are compared in force keep the
//! linear fit.
//!
//! Data flows through these modules from the top to the bottom; a module uses only those above it:
//!
//! - `criteria`, `error`, `progress`, `signal`: thresholds; errors, options, stages; transforms and noise floors of
//!   sampled signals.
//! - `baseline`: the model of the case file. It knows no recording.
//! - `motion`: spindle angle, chips and cutting force of a recorded cut along a given motion, and free decays. It knows
//!   no `Record`.
//! - `orders`: a recorded cut reduced to its orders of the spindle frequency, with covariance. It knows no case.
//! - `records`: each recording beside what the baseline predicts of it, and the `Study` that holds them. It knows no
//!   cause.
//! - `cuts`: steady cuts whose orders are compared with those of the forced orbit.
//! - `candidates`: the causes that a baseline may lack, as regressors along the measured motion and as simulations. It
//!   fits nothing.
//! - `fit`: the parameters of one candidate model. It does not compare candidates.
//! - `selection`: which candidate model explains the records. It writes no text.
//! - `conclusion`: parameter estimates, intervals, residual views, gain, effect on the lobes, the answer.
//! - `next_test`: the experiment that separates confounded candidate models.
//!
//! `baseline` and `motion` stand before `records` because a `Record` holds the prediction of the baseline along the
//! motion.
//!
//! "The thesis" in this crate is *Chatter Vibrations in Robotic Milling Considering Structural Nonlinearity*, a
//! doctoral thesis of the University of Victoria; its equation numbers are given as "thesis eq. 5.16".
//!
//! The entry is [`diagnose`]. A baseline of one mode, and a sweep of a machine whose spring softens with the
//! displacement:
//!
//! ```
//! use std::path::Path;
//!
//! use quietcut_diagnose::answer::Outcome;
//! use quietcut_diagnose::{Options, diagnose};
//! use quietcut_model::case::Case;
//! use quietcut_model::structure::Direction;
//! use quietcut_simulate::Effects;
//! use quietcut_simulate::rig::{Noise, Rig, Signal};
//!
//! let text = r#"
//! [structure]
//! kind = "matrices"
//! directions = ["x"]
//! mass = [[188.0]]
//! damping = [[305.0]]
//! stiffness = [[2260000.0]]
//! "#;
//! let baseline = Case::parse(Path::new("baseline.toml"), text)?;
//! let sweep = Signal::Sweep {
//!     first_hz: 10.0,
//!     last_hz: 25.0,
//!     amplitude_n: 60.0,
//!     seconds: 20.0,
//! };
//! let mut rig = Rig::new(Direction::X, sweep, 256.0);
//! rig.effects = Effects::parse(["cubic-stiffness=-1e12"])?;
//! let (mut recording, _) = rig.record(baseline.structure()?, Path::new("sweep.csv"))?;
//! // Noise of 1 % on force, displacement and acceleration.
//! let noise = Noise { relative: 0.01, ..Noise::default() };
//! noise.add(&mut recording, 1);
//!
//! let diagnosis = diagnose(&baseline, &[recording], &Options::default())?;
//! assert_eq!(diagnosis.outcome, Outcome::Cause);
//! let cause = &diagnosis.causes[0];
//! assert_eq!(cause.name, "cubic-stiffness");
//! assert!((cause.parameters["k3_n_per_m3"].value / -1e12 - 1.0).abs() < 0.02);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! This crate reads no command line and prints nothing. It identifies no parameter of a case that has no recording
//! beside it; that is for the crate `quietcut-identify`.

mod baseline;
mod candidates;
mod conclusion;
mod criteria;
mod cuts;
mod error;
mod fit;
mod motion;
mod next_test;
// The speed without a tachometer, the spectrum between the lines and the distances are not used by `cuts` yet.
#[allow(dead_code)]
mod orders;
mod progress;
mod records;
mod selection;
mod signal;
#[cfg(test)]
mod tests;

pub use conclusion::answer::{self, Diagnosis};
pub use conclusion::lobes;
pub use conclusion::missing_force::{AtAmplitude, MissingForce};
pub use conclusion::places::{Place, PlaceKind};
pub use conclusion::recorded_cuts::recorded_cuts;
pub use conclusion::residual_views::{ResidualView, SpindleMotionView};
pub use conclusion::updates::{BaselineUpdate, Posterior};
pub use error::{DiagnoseError, FittingInput};
pub use progress::{Options, Stage};

use conclusion::{conclude, long_records};
use quietcut_model::case::Case;
use quietcut_recording::{Recording, TestKind};
use records::{checks, full_engagement};

/// Finds what the case gets wrong about the recordings, and why.
///
/// # Errors
/// No recording is given; the case lacks an entry or cannot be simulated; or a recording cannot be compared: for
/// example, it is too short, clipped, or without a required channel.
pub fn diagnose(
    case: &Case,
    recordings: &[Recording],
    options: &Options,
) -> Result<Diagnosis, DiagnoseError> {
    diagnose_watched(case, recordings, options, &|_| ())
}

/// [`diagnose`] with a callback at the beginning of each stage.
///
/// # Errors
/// No recording is given; the case lacks an entry or cannot be simulated; or a recording cannot be compared: for
/// example, it is too short, clipped, or without a required channel.
pub fn diagnose_watched(
    case: &Case,
    recordings: &[Recording],
    options: &Options,
    watch: &dyn Fn(Stage),
) -> Result<Diagnosis, DiagnoseError> {
    watch(Stage::Records);
    let (recordings, mut remarks) = full_engagement::in_full_engagement(case, recordings)?;
    for recording in recordings.iter() {
        checks::signals(recording)?;
        if recording.sidecar.kind == Some(TestKind::Cutting) {
            checks::cut(case, recording)?;
            remarks.extend(checks::speed_remark(recording));
        }
    }
    let of_cuts = cuts::diagnosis::diagnosed(case, &recordings, watch)?;
    let (concluded, remark) = match of_cuts {
        Some(diagnosis) => (Some(diagnosis), None),
        None => long_records::concluded(case, &recordings, options, watch),
    };
    let mut diagnosis = match concluded {
        Some(diagnosis) => diagnosis,
        None => {
            watch(Stage::Records);
            conclude::of_records(case, &recordings, options, watch)?
        }
    };
    diagnosis.warnings.extend(remark);
    match next_test::next_test(case, &recordings, &diagnosis) {
        Ok(test) => diagnosis.next_test = test,
        Err(reason) => diagnosis.warnings.push(format!(
            "no test is proposed that separates the candidate models: {reason}"
        )),
    }
    diagnosis.warnings.splice(0..0, remarks);
    Ok(diagnosis)
}
