//! Every threshold by which this crate decides, each with the source of its number.
//!
//! A number without a derivation or a campaign behind it is marked "Unfounded". Tolerances of the integration method,
//! rounding of times and lengths of filters stand where they are used.

// Loss of contact

/// Chip thickness below zero at which a tooth loses contact, and above zero at which it regains contact, as a fraction
/// of the feed per tooth: a chip whose thickness tends to zero, as in a slot, must not lose contact by integration
/// errors. Ten times the relative tolerance of the integration, 1e-8, for a vibration as large as the feed.
pub(crate) const CONTACT_TOLERANCE: f64 = 1e-7;

/// Tolerance of contact, m, if [`CONTACT_TOLERANCE`] times the feed per tooth is smaller, as in a cut without feed.
/// Rounding of displacements up to 1 mm is 2e-19 m; the factor of 5000 is unfounded.
pub(crate) const CONTACT_TOLERANCE_MIN_M: f64 = 1e-15;

/// Time after its entry, in shortest tooth-passing periods, at which the chip thickness of a tooth decides whether it
/// is in contact. Long enough for a chip that grows from zero, short enough for linear extrapolation of the motion.
/// Unfounded.
pub(crate) const CONTACT_DECIDED: f64 = 1e-4;

/// Largest number of repeated changes of contact without an integration step between them; more end the run with an
/// error. Changes of regime are counted too. A tooth that can keep or lose contact needs none. Unfounded.
pub(crate) const REPEATED_CONTACT_CHANGES_MAX: u32 = 3;

// Regimes of restoring forces

/// Largest number of changes of regime without an integration step between them; more end the run with an error.
/// Repeated changes of contact are counted too. A consistent regime of a few restoring forces needs one change each.
/// Unfounded.
pub(crate) const REGIME_CHANGES_MAX: u32 = 10 * REPEATED_CONTACT_CHANGES_MAX;

// Motion

/// Local error of an integration step over its tolerance below which the tool counts as at rest, so that the excitation
/// limits the next step. The number lies between the error by rounding alone, 2e-16/1e-8 = 2e-8, and the 0.9⁵ = 0.6 to
/// which the step control adjusts the error; the value between is unfounded.
pub(crate) const AT_REST: f64 = 1e-6;

/// Displacement of the tool, or another state of the structure converted into one, beyond which the motion counts as
/// diverged, m. Cuts lose contact at amplitudes of about the feed, some 0.1 mm, so that a larger displacement is no
/// vibration of a tool. The factor of 1000 is unfounded.
pub(crate) const LARGEST_DISPLACEMENT_M: f64 = 0.1;

// Recorded tachometer

/// Smallest pitch of a tachometer wheel, in samples: two for the rise of a pulse, two for its fall, and one for each
/// level between them.
pub(crate) const SAMPLES_PER_PITCH_MIN: f64 = 6.0;
