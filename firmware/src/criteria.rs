//! Settings of the fitted sample clock of the acquisition.
//!
//! The comment of each setting states the source of its number. "Unfounded" marks numbers without a derivation. Times
//! and capacities that follow from a data sheet or from the board stand where they are used.

/// Number of time stamps after which the weight of a stamp in the fitted sample clock has decayed to 1/e: 0.6 s of
/// blocks of 64 samples at 26 667 Hz. Unfounded.
pub(crate) const CLOCK_MEMORY_STAMPS: f32 = 256.0;

/// Largest relative deviation of the fitted sample rate from the nominal one. Data sheets allow 3 %. The bound is
/// wider, so that a fit with an error does not end on it.
pub(crate) const RATE_TOLERANCE: f32 = 0.05;

/// Initial estimate, in ns, of the standard deviation of the time stamps of the watermark line: eight ticks of the
/// device's timer. Unfounded.
pub(crate) const STAMP_JITTER_NS: f32 = 100.0;
