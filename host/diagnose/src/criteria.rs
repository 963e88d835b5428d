//! Every threshold by which this crate decides, each with the source of its number.
//!
//! They stand at the ground of the crate, because checks of records, fits and the selection of a candidate model decide alike. A number
//! without a derivation or a campaign behind it is marked "Unfounded". Step sizes, grids and limits of iterations decide nothing about a
//! record and stay beside the code that uses them. Thresholds of the fit of cuts in closed loop stand beside that code.

use std::ops::RangeInclusive;

// Signals

/// Least white part of the noise of a band, as a share of all noise there. Less cannot be told from chance in one band. Unfounded.
pub(crate) const LEAST_WHITE_SHARE: f64 = 0.05;

/// Least noise of a channel over its root mean square: −90 dB, the level to which the integration of a simulation accumulates errors.
pub(crate) const LEAST_RELATIVE_NOISE: f64 = 3e-5;

// Recorded cuts

/// Largest difference between the speed of the tachometer and that of the sidecar, relative. A wrong number of pulses per revolution
/// makes at least a few times as much. Unfounded.
pub(crate) const SPEED_MISMATCH: f64 = 0.05;

/// Fewest edges of the tachometer that determine the spindle angle to a fraction of a sample: a line and two residuals.
pub(crate) const LEAST_TACHOMETER_EDGES: usize = 4;

/// Least F-ratio of a speed modulation: edge variance that it explains per parameter over the residual variance per edge. The
/// largest of 500 F-ratios of pure jitter exceeds 8 once in a hundred records (χ² of three parameters); the rest is margin.
pub(crate) const LEAST_MODULATION_F_RATIO: f64 = 20.0;

/// Largest relative amplitude of a speed modulation: near 1 the spindle would stop.
pub(crate) const LARGEST_MODULATION: f64 = 0.9;

/// Samples of force and acceleration nearer than this to an entry or exit of a tooth, in samples, are not compared: the jitter of the
/// tachometer leaves open on which side of the step they lie. Unfounded.
pub(crate) const UNCERTAIN_SAMPLES: f64 = 0.375;

// Checks of records

/// Fewest samples of a record: with fewer than four for each of its 32 bands no noise floor is estimated.
pub(crate) const LEAST_SAMPLES: usize = 128;

/// Fewest periods of the slowest mode in a record. Unfounded.
pub(crate) const LEAST_PERIODS: f64 = 3.0;

/// Share of the samples in flat tops at the end of the range above which a channel is clipped. Unfounded.
pub(crate) const CLIPPED_SHARE: f64 = 0.002;

/// Equal samples in the flat top of a clipped impact: fewer may be a rounded peak, more are a held force.
pub(crate) const CLIPPED_IMPACT_SAMPLES: RangeInclusive<usize> = 3..=64;

/// Least step of a clipped impact two samples beside its flat top, in steps of the channel's resolution. A smooth peak with a flat top of
/// three samples lies at most 12 steps lower there.
pub(crate) const CLIPPED_IMPACT_STEP: f64 = 16.0;

/// Distance of a ratio from that of pounds and newtons, in its logarithm, within which the unit is suspected. Narrow, because stiffness
/// errors of a baseline reach this factor too. Unfounded.
pub(crate) const POUND_TOLERANCE: f64 = 0.1;

/// The same for all other units, which are factors of 10 and more. Unfounded.
pub(crate) const UNIT_TOLERANCE: f64 = 0.4;

/// Ratio of a measured to a predicted channel from which on a unit is suspected. Unfounded.
pub(crate) const WRONG_UNIT_RATIO: f64 = 4.0;

/// Ratio of a measured to a predicted channel that no resonance and no nonlinearity of a machine reaches: a damping ratio of 0.2 %
/// amplifies by 250.
pub(crate) const IMPOSSIBLE_RATIO: f64 = 250.0;

/// Least ratio of a measured to a predicted channel that friction explains. Below it a unit is suspected; above it newtons read as
/// pounds are reported as a gain of the sensor. Unfounded.
pub(crate) const FRICTION_RATIO: f64 = 0.15;

/// Relative distance within which an estimated gain is reported as a likely unit. Unfounded.
pub(crate) const GAIN_UNIT_TOLERANCE: f64 = 0.03;

/// Least energy of a predicted channel over that by the noise of the force sensors: an amplitude ratio of 5, below which the prediction
/// is noise.
pub(crate) const LEAST_ENERGY_OVER_FORCE_NOISE: f64 = 25.0;

/// Least squared correlation of measured and predicted samples at which a known unit is reported. Unfounded.
pub(crate) const LEAST_CORRELATION_OF_KNOWN_UNIT: f64 = 0.3;

/// The same where no known unit has that ratio. Unfounded.
pub(crate) const LEAST_CORRELATION_OF_UNKNOWN_UNIT: f64 = 0.8;

/// Least root mean square of a channel over its noise for the axis to count as moving: three standard deviations.
pub(crate) const MOVING_OVER_NOISE: f64 = 3.0;

/// Largest noise of a force sensor over the root mean square of the force. A white force has no noise floor of its own; force sensors are
/// better than this. Unfounded.
pub(crate) const LARGEST_FORCE_NOISE: f64 = 0.02;

/// Relative error of a predicted cut. The instants at which a tooth enters or leaves are known to a fraction of a sample, and so is the
/// step of the force there. Unfounded.
pub(crate) const RELATIVE_ERROR_OF_CUTS: f64 = 2e-4;

// Full engagement

/// Level of a revolution in air, in some channel, over that in the cut. Unfounded.
pub(crate) const AIR_LEVEL: f64 = 0.2;

/// Level at which the tool is well engaged, in every channel, over that in the cut. Unfounded.
pub(crate) const ENGAGED_LEVEL: f64 = 0.8;

/// Time from air to full engagement over that from air to `ENGAGED_LEVEL`: 4/3 for a depth that grows linearly from `AIR_LEVEL`, with
/// a margin of 5 %.
pub(crate) const ENGAGEMENT_AFTER_LEVEL: f64 = 1.4;

/// Margin on the way in: the first contact itself is below `AIR_LEVEL`. Unfounded.
pub(crate) const ENTRY_MARGIN: f64 = 1.1;

/// Share of the way out that is over when the level falls to `AIR_LEVEL`: the chips are thin at its end. Unfounded.
pub(crate) const EXIT_SHARE: f64 = 0.7;

/// Level over that by the feed alone at which a cut chatters. Unfounded.
pub(crate) const CHATTER_LEVEL: f64 = 2.0;

/// Level in the cut over the noise from which on a channel shows air: three standard deviations.
pub(crate) const AIR_OVER_NOISE: f64 = 3.0;

/// Fewest revolutions of air at an end of a recording: one may be a beat of the motion. Unfounded.
pub(crate) const LEAST_AIR_AT_ENDS: usize = 2;

/// Fewest revolutions of air within a recording, where chatter may beat. Unfounded.
pub(crate) const LEAST_AIR_WITHIN: usize = 4;

/// Least growth from the first to the second revolution of a resonance that starts from rest. Revolutions in air are alike. Unfounded.
pub(crate) const GROWTH_FROM_REST: f64 = 2.0;

/// Fewest revolutions of full engagement that are diagnosed. Unfounded.
pub(crate) const LEAST_ENGAGED_REVOLUTIONS: f64 = 8.0;

// Fits

/// Largest distance of a motion from its closed loop, in units of the noise, at which the iteration of a cut has settled:
/// it adds a thousandth to χ².
pub(crate) const CLOSED_LOOP_SETTLED: f64 = 0.03;

/// Least gain of χ² per step of a search. A step of a standard deviation gains 1.
pub(crate) const SEARCH_SETTLED: f64 = 0.1;

/// χ² behind that of another candidate model at which a search is given up. A candidate model is not selected if its χ² is 16 behind;
/// the linear prediction of a search errs by a multiple of that. Unfounded.
pub(crate) const HOPELESS_LAG: f64 = 300.0;

/// χ² of a start over that of the regression above which the beginning of each record is fitted first. Unfounded.
pub(crate) const FAR_START: f64 = 2.0;

/// χ² of a candidate model over the least of all above which its start is not improved. Unfounded.
pub(crate) const FAR_BEHIND: f64 = 4.0;

/// χ² per number at which a search counts as stuck, and over that of another model up to which it is repeated. Unfounded.
pub(crate) const STUCK: f64 = 1.1;

/// Share of the best reduction of χ² from which on the nonlinear parameters of a candidate model are refined. Unfounded.
pub(crate) const REFINED_SHARE: f64 = 0.5;

/// Least gain of χ² of a Gauss–Newton step in the nonlinear parameters: a tenth of a standard deviation.
pub(crate) const LEAST_REFINEMENT: f64 = 0.01;

/// Least additional variance by noise of the forces, as a share of the variance of a parameter, that widens intervals: 2.5 % of a
/// standard deviation, less than the draws resolve.
pub(crate) const LEAST_FORCE_NOISE_VARIANCE: f64 = 0.05;

// Selection

/// Least gain of a further cause: twice the log-likelihood ratio minus the price of its parameters (Schwarz). 20 is an odds
/// ratio of e¹⁰; why not e⁵ is unfounded.
pub(crate) const LEAST_GAIN: f64 = 20.0;

/// Difference of gains below which two candidate models are equivalent: a likelihood ratio of e⁸. Unfounded.
pub(crate) const EQUIVALENT: f64 = 16.0;

/// Share of the residual energy that a right candidate model leaves along the measured motion, because sampling hides the motion between
/// samples. Unfounded.
pub(crate) const SAMPLING_RESIDUAL: f64 = 2e-3;

/// The same of a simulated candidate model, which interpolates only the measured forces. Unfounded.
pub(crate) const SAMPLING_RESIDUAL_SIMULATED: f64 = 5e-5;

/// Share of the residual energy by which interpolation between samples biases the comparison of candidate models. Unfounded.
pub(crate) const INTERPOLATION_ERROR: f64 = 1e-4;

/// Residual energy above the noise that is not explained, as a share of the noise: the error of the noise floor and chance. Unfounded.
pub(crate) const NOISE_TOLERANCE: f64 = 0.15;

/// Least share of the residual energy above the noise that a further cause explains. With less, one wrong equation compensates for
/// another. Unfounded.
pub(crate) const LEAST_SHARE: f64 = 0.2;

/// Least energy over that of the errors of the computation which is something else: twice their amplitude.
pub(crate) const OVER_COMPUTATION_ERROR: f64 = 4.0;

/// Of a cut: least gain of a further cause beside a sufficient model, as a share of the noise. The noise floor and the computation near
/// a resonance err by about as much. Unfounded.
pub(crate) const LEAST_SHARE_BESIDE_ENOUGH: f64 = 5e-3;

/// Residual energy over the least noise of the sensors below which there is nothing to explain. Unfounded.
pub(crate) const NOTHING_TO_EXPLAIN: f64 = 0.5;

/// Standard deviations of χ² (√(2n) for n numbers) within which a residual is noise.
pub(crate) const CHANCE: f64 = 4.0;

// Conclusion

/// Largest share of the residual energy above the noise that a candidate model may leave of responses, whose noise is known by its
/// floor. Unfounded.
pub(crate) const UNEXPLAINED_OF_RESPONSE: f64 = 0.012;

/// The same of forces, where derivatives of the motion add noise that is not white. Unfounded.
pub(crate) const UNEXPLAINED_OF_FORCE: f64 = 0.15;

/// Factor on `UNEXPLAINED_OF_RESPONSE` for each further cause of a simulated candidate model: two or three terms imitate much, but
/// leave more than this. Unfounded.
pub(crate) const UNEXPLAINED_PER_FURTHER_CAUSE: f64 = 0.05;

/// Residual energy above the noise and chance, as a share of the noise, at which a simulated candidate model is not the whole truth.
/// Unfounded.
pub(crate) const DOUBTFUL_RESIDUAL: f64 = 0.03;

/// Standard deviations of χ² that count as chance beside `DOUBTFUL_RESIDUAL`. Unfounded.
pub(crate) const CHANCE_OF_DOUBT: f64 = 5.0;

/// Factor on the confidence in a candidate model that leaves `DOUBTFUL_RESIDUAL`. Unfounded.
pub(crate) const DOUBT: f64 = 0.8;

/// NRMSE of the whole records over that of the held-out segments from which on the user is warned. Unfounded.
pub(crate) const UNLIKE_SEGMENTS: f64 = 3.0;

/// Scale of the logistic function from the difference of gains beside a rival to the confidence. Unfounded.
pub(crate) const CONFIDENCE_WIDTH: f64 = 6.0;

/// Loss of confidence where the residual is as large as allowed. Unfounded.
pub(crate) const CONFIDENCE_LOSS: f64 = 0.5;

/// Highest confidence: no campaign is large enough to support more. Unfounded.
pub(crate) const HIGHEST_CONFIDENCE: f64 = 0.995;

/// Confidence in mass, stiffness and damping by one factor beside the gain of a sensor that is equivalent. Unfounded.
pub(crate) const COMMON_FACTOR_CONFIDENCE: f64 = 0.25;

/// Least share of the held-out residual energy that a guessed formula explains. Unfounded.
pub(crate) const LEAST_EXPLAINED_BY_GUESS: f64 = 0.1;

/// Residual power over that of the noise from which on a bin shows a missing force: six standard deviations of the mean
/// of nine bins above the noise.
pub(crate) const MISSING_FORCE_OVER_NOISE: f64 = 3.0;

/// Amplitude of a segment, over the largest, below which its stiffness and damping are not shown. Unfounded.
pub(crate) const LEAST_AMPLITUDE: f64 = 0.02;

/// Records are shortened if less than this share of their samples is left to search. With more, little time is gained. Unfounded.
pub(crate) const SHORTENED_SHARE: f64 = 0.5;

/// Immersion angles closer than this, in degrees, belong to the same chart. Unfounded.
pub(crate) const SAME_IMMERSION_DEG: f64 = 0.5;

/// Feeds closer than this, relative, belong to the same chart. Unfounded.
pub(crate) const SAME_FEED: f64 = 1e-3;

// Next test

/// Squared distance D² of two candidate models at which a test separates them nearly always. The difference of twice their
/// log-likelihoods is D² ± 2D, and `EQUIVALENT` of it is required.
pub(crate) const SEPARATING_DISTANCE: f64 = 60.0;

/// Displacement of a cut over that of the records above which it is not proposed. Unfounded.
pub(crate) const LARGEST_PROPOSED_MOTION: f64 = 10.0;

/// Noise of a sensor that no record has, over its root mean square. Unfounded.
pub(crate) const ASSUMED_NOISE: f64 = 0.01;
