//! What the simulation gets wrong, why, and what to add.
//!
//! The residual is taken with the *measured* motion: with H the receptance of the case and f_r a term that it lacks,
//! y − H·F = −H·f_r(x, v) + free decay + noise holds exactly, also for large terms. A cause is then one or few regressors
//! ([`cause`]), fits of any set of causes are linear least squares ([`regression`]), and what competes is judged by
//! likelihood, parsimony and records that were held out ([`evidence`]).
//!
//! That finds the few explanations that are worth more: the extended case itself is then fitted, without the noise of the measured
//! motion in it. Tests of structures are simulated (`output_error`), cuts are read again with the extended case
//! (`relinearization`), near a lobe and in chatter along the measured motion still (`amplification`).

mod amplification;
pub mod answer;
mod around;
mod beginning;
pub mod cause;
mod causes;
#[cfg(test)]
mod chatter_tests;
mod checks;
pub mod chips;
mod closed_fit;
mod closed_loop;
mod closed_selection;
mod cubic;
pub mod cut;
mod cutting;
#[cfg(test)]
mod cutting_tests;
mod decay;
mod error;
pub mod evidence;
mod extension;
mod force_noise;
mod full_cut;
mod gram;
mod grid;
mod guess;
#[cfg(test)]
mod hammer_tests;
mod judge;
mod leftover;
pub mod lobes;
mod mean_slopes;
mod missing_force;
mod motion;
mod named;
mod next_test;
pub mod noise;
mod output_error;
mod own_slopes;
mod part;
mod receptance;
mod record;
mod recorded_cuts;
mod refine;
pub mod regression;
mod relinearization;
mod restarts;
mod scene;
mod selection;
#[cfg(test)]
mod sensor_tests;
mod stepwise;
mod stiffness;
#[cfg(test)]
mod tests;
mod together;
pub mod turning;
#[cfg(test)]
mod two_effects_tests;
mod unknowns;
#[cfg(test)]
mod velocity_jump_tests;
mod views;
#[cfg(test)]
mod virtual_records;
mod whitening;

pub use answer::Diagnosis;
pub use cutting::Cutting;
pub use error::DiagnoseError;
pub use grid::Grid;
pub use missing_force::{AtAmplitude, MissingForce};
pub use receptance::Receptance;
pub use record::{Observed, Record};
pub use recorded_cuts::recorded_cuts;
pub use scene::{Baseline, Domain, Scene};
pub use views::{TurningView, View};

use quietcut_model::case::Case;
use quietcut_recording::Recording;
pub use quietcut_simulate::path::{Motion, restoring_along};

/// How to diagnose.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Seed of whatever is drawn.
    pub seed: u64,
}

/// How far a diagnosis is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Recordings are set against what the case predicts.
    Records,
    /// What each cause would look like in them.
    Library,
    /// So many causes at a time are tried.
    Causes(usize),
    /// What was found is put into figures.
    Answer,
}

/// What the case gets wrong about the recordings, and why.
///
/// # Errors
/// The case cannot be simulated, or a recording tells nothing: too short, clipped, without a channel that is needed.
pub fn diagnose(
    case: &Case,
    recordings: &[Recording],
    options: &Options,
) -> Result<Diagnosis, DiagnoseError> {
    diagnose_watched(case, recordings, options, &|_| ())
}

/// The same, with word of each stage as it begins.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_watched(
    case: &Case,
    recordings: &[Recording],
    options: &Options,
    watch: &dyn Fn(Stage),
) -> Result<Diagnosis, DiagnoseError> {
    watch(Stage::Records);
    let (recordings, shortened) = full_cut::in_full_cut(case, recordings)?;
    let mut diagnosis = match beginning::diagnosed(case, &recordings, options, watch) {
        Some(diagnosis) => diagnosis,
        None => {
            watch(Stage::Records);
            let scene = Scene::new(case, &recordings)?;
            judge::judge(&scene, &recordings, options, watch)
        }
    };
    diagnosis.next_test = next_test::next_test(case, &recordings, &diagnosis);
    diagnosis.warnings.splice(0..0, shortened);
    Ok(diagnosis)
}
