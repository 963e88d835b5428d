//! Thresholds by which this crate decides, each with the source of its number.
//!
//! They stand at the root of the crate, because checks of records, fits and the selection of a candidate model use them
//! alike. A number without a derivation and without a campaign behind it is marked "Unfounded". Step sizes, grids and
//! limits of iterations decide nothing about a record and stay beside the code that uses them.

use std::ops::RangeInclusive;

// Signals

/// Smallest white part of the noise power in a frequency band of a channel, as a share of all noise power in the band.
/// The white part is all noise minus the noise known from other sources; this share keeps it positive if the latter is
/// larger. Unfounded.
pub(crate) const LEAST_WHITE_SHARE: f64 = 0.05;

/// Least standard deviation assumed for the noise of a channel, as a share of the channel's root mean square: about −90
/// dB, the level to which the integration of a simulation accumulates errors.
pub(crate) const LEAST_RELATIVE_NOISE: f64 = 3e-5;

// Recorded cuts

/// Largest relative difference between the mean spindle speed from the tachometer and that in the sidecar with which a
/// recorded cut is accepted. A spindle without speed control may slip by up to 5 % at rated load (NEMA MG 1, induction
/// motors of design A and B). Counting one pulse too many or too few per revolution changes the speed by more than 5 %
/// if there are fewer than 20 pulses per revolution.
pub(crate) const SPEED_MISMATCH: f64 = 0.05;

/// Relative difference of the spindle speed by the tachometer from that in the sidecar up to which the latter is taken as
/// rounded or set by hand: a speed with three digits is rounded by up to 0.5 %.
pub(crate) const SPEED_AS_STATED: f64 = 5e-3;

/// Fewest tachometer edges, one per revolution, that determine the spindle angle within a fraction of a sample: two for
/// a straight line, and two residuals.
pub(crate) const LEAST_TACHOMETER_EDGES: usize = 4;

/// Least F-ratio of a speed modulation: the sum of squares of the tachometer edge times that it explains, per
/// parameter, over the residual sum of squares, per degree of freedom. With pure jitter, the largest of 500 F-ratios
/// (χ² of three parameters) exceeds 8 in one of a hundred records; the rest of the number is margin.
pub(crate) const LEAST_MODULATION_F_RATIO: f64 = 20.0;

/// Largest relative amplitude of a speed modulation that is accepted. At 1 the spindle would stop; the distance from 1
/// is unfounded.
pub(crate) const LARGEST_MODULATION: f64 = 0.9;

/// Distance in samples from the entry or exit of a tooth within which samples of force and acceleration in a cut are
/// not compared: the jitter of the tachometer leaves open on which side of the jump they lie. Unfounded.
pub(crate) const UNCERTAIN_SAMPLES: f64 = 0.375;

// Checks of records

/// Fewest samples of a record: four for each of the 32 bands of a noise floor.
pub(crate) const LEAST_SAMPLES: usize = 128;

/// Least duration of a record, in periods of the lowest natural frequency. Unfounded.
pub(crate) const LEAST_PERIODS: f64 = 3.0;

/// Share of a channel's samples that lie in flat tops (three or more equal samples) at one end of its range, above
/// which the channel counts as clipped if there are two flat tops or more. Unfounded.
pub(crate) const CLIPPED_SHARE: f64 = 0.002;

/// Numbers of equal samples in a single flat top with which an impact counts as clipped. With fewer than 3 a peak may
/// be rounded; with more than 64 it may be a held force. The 64 is unfounded.
pub(crate) const CLIPPED_IMPACT_SAMPLES: RangeInclusive<usize> = 3..=64;

/// Least distance, in steps of the channel's resolution, between the flat top of a clipped impact and the samples two
/// places beside it. A smooth peak with a flat top of three samples falls by at most 10 steps up to there.
pub(crate) const CLIPPED_IMPACT_STEP: f64 = 16.0;

/// Tolerance within which the ratio of a channel's measured to its predicted amplitude, or its inverse, counts as the
/// ratio of pounds to newtons, as a difference of natural logarithms. It is small, because stiffness errors of a
/// baseline reach this ratio too. Unfounded.
pub(crate) const POUND_TOLERANCE: f64 = 0.1;

/// Tolerance within which the ratio of a channel's measured to its predicted amplitude, or its inverse, counts as the
/// ratio of any other unit mix-up, as a difference of natural logarithms. The ratios of these units are about 10 and
/// more. Unfounded.
pub(crate) const UNIT_TOLERANCE: f64 = 0.4;

/// Ratio of measured to predicted amplitude of a channel above which a wrong unit is suspected: 4.448/e^0.1 = 4.02, the
/// smallest ratio of a unit in the list (pounds for newtons) less its tolerance.
pub(crate) const WRONG_UNIT_RATIO: f64 = 4.0;

/// Ratio of the measured to the predicted amplitude of a channel, or its inverse, that no resonance and no nonlinearity
/// of a machine reaches: a mode with a damping ratio of 0.2 % amplifies the static response by 250.
pub(crate) const IMPOSSIBLE_RATIO: f64 = 250.0;

/// Ratio of measured to predicted amplitude of a channel below which a wrong unit is suspected: e^0.4/9.81 = 0.152, the
/// ratio of accelerations in g read as m/s², with its tolerance. Newtons read as pounds (0.22) lie above, because
/// friction reduces a response as much; they are reported as a gain of the sensor.
pub(crate) const FRICTION_RATIO: f64 = 0.15;

/// Largest distance between the logarithms of an estimated gain and of a unit's ratio at which the gain is reported as
/// a likely wrong unit. Unfounded.
pub(crate) const GAIN_UNIT_TOLERANCE: f64 = 0.03;

/// Least energy of a channel's predicted response over that of its response to force-sensor noise, above which the
/// channel's unit is checked: an amplitude ratio of 5, below which much of the prediction is noise.
pub(crate) const LEAST_ENERGY_OVER_FORCE_NOISE: f64 = 25.0;

/// Smallest squared correlation of measured and predicted samples of a channel at which a wrong unit is reported, if
/// the ratio of their amplitudes is that of a common unit mix-up. Unfounded.
pub(crate) const LEAST_CORRELATION_OF_KNOWN_UNIT: f64 = 0.3;

/// Smallest squared correlation of measured and predicted samples of a channel at which a wrong unit is reported, if
/// the ratio of their amplitudes is that of no common unit mix-up. Unfounded.
pub(crate) const LEAST_CORRELATION_OF_UNKNOWN_UNIT: f64 = 0.8;

/// Root mean square of a channel over the standard deviation of its noise above which an axis that the channel reads
/// counts as moving: three standard deviations.
pub(crate) const MOVING_OVER_NOISE: f64 = 3.0;

/// Largest standard deviation that is assumed for a force sensor's noise, as a share of the root mean square of the
/// force. A force with a white spectrum hides its noise floor, and force sensors are better than this. Unfounded.
pub(crate) const LARGEST_FORCE_NOISE: f64 = 0.02;

/// Standard deviation of the error of a cut's predicted samples, as a share of the root mean square of the channel. The
/// instants at which teeth enter and leave, and so the steps of the force, are known to a fraction of a sample only.
/// Unfounded.
pub(crate) const RELATIVE_ERROR_OF_CUTS: f64 = 2e-4;

// Full engagement

/// Vibration level below which a revolution of a recorded cut counts as air if one channel is below it. The level is
/// the channel's standard deviation over the revolution, as a share of its median over all revolutions, or of that by
/// the feed alone if smaller. Unfounded.
pub(crate) const AIR_LEVEL: f64 = 0.2;

/// Vibration level above which the tool counts as engaged in a revolution if every channel is above it. The level is
/// the channel's standard deviation over the revolution, as a share of its median over all revolutions, or of that by
/// the feed alone if smaller. Unfounded.
pub(crate) const ENGAGED_LEVEL: f64 = 0.8;

/// Time from air to full engagement of the tool over the time from air until the vibration level reaches
/// `ENGAGED_LEVEL`: (1 − 0.2)/(0.8 − 0.2) = 4/3 for a level that grows linearly from `AIR_LEVEL`, with a margin of 5 %.
pub(crate) const ENGAGEMENT_AFTER_LEVEL: f64 = 1.4;

/// Factor on the time that the tool takes by geometry to enter the workpiece and, in chatter, to leave it: at the first
/// contact the vibration level is still below `AIR_LEVEL`, so that the entry is noticed late. Unfounded.
pub(crate) const ENTRY_MARGIN: f64 = 1.1;

/// Share of the time that the tool's exit takes by geometry which has passed, in a stable cut, when the vibration level
/// falls to `AIR_LEVEL`: the chips are thin at the end of the exit. Unfounded.
pub(crate) const EXIT_SHARE: f64 = 0.7;

/// Median standard deviation of a channel over the revolutions of a recorded cut, as a multiple of that which the feed
/// alone causes in the baseline, above which the cut counts as chatter. Unfounded.
pub(crate) const CHATTER_LEVEL: f64 = 2.0;

/// Vibration level of a channel in the cut (its median standard deviation over a revolution, or that by the feed alone
/// if smaller) over the standard deviation of its noise, above which the channel can distinguish air from cutting:
/// three standard deviations.
pub(crate) const AIR_OVER_NOISE: f64 = 3.0;

/// Smallest number of successive low-level revolutions that count as air at an end of a recording: a single one may be
/// a minimum of beating vibration. Unfounded.
pub(crate) const LEAST_AIR_AT_ENDS: usize = 2;

/// Smallest number of successive low-level revolutions that count as air inside a recording, where chatter may beat.
/// Unfounded.
pub(crate) const LEAST_AIR_WITHIN: usize = 4;

/// Smallest ratio of a channel's vibration level, beyond its noise, in the second revolution of a recording to that in
/// the first at which the recording begins with the cut, from rest. Two revolutions in air have equal levels.
/// Unfounded.
pub(crate) const GROWTH_FROM_REST: f64 = 2.0;

/// Fewest revolutions of full engagement with which a cut is diagnosed. Unfounded.
pub(crate) const LEAST_ENGAGED_REVOLUTIONS: f64 = 8.0;

/// Share of the power of each channel of motion that lies within the band of the motion. The upper end of the band is
/// the highest frequency of a record, to which delays and shapes of effects are scaled. Unfounded.
pub(crate) const MOTION_BAND_SHARE: f64 = 0.995;

/// Smallest inverse modal mass along an axis with which a mode counts as excited along that axis, as a share of the
/// largest inverse modal mass there. Unfounded.
pub(crate) const LEAST_INVERSE_MASS_SHARE: f64 = 1e-3;

// Physical parameters of candidates

/// Largest distance from 1 of the fitted coefficient of axial-depth modulation b = b₀ − z at which the cause is
/// accepted. The right equation gives 1, within the error of the other parameters; the distance is unfounded.
pub(crate) const AXIAL_DEPTH_COEFFICIENT_ERROR: f64 = 0.35;

/// Largest distance from 1 of the fitted coefficient of the speed modulation in the channels at which the records
/// confirm the modulation in the tachometer signal. It is half the way to 0, the coefficient of records without the
/// modulation.
pub(crate) const SPEED_MODULATION_COEFFICIENT_ERROR: f64 = 0.5;

/// Largest accepted share 1 − 1/g of a sensor gain g, which is a gain of 50. A reading with a larger gain would hardly
/// contain the true value. Unfounded.
pub(crate) const LARGEST_GAIN_SHARE: f64 = 0.98;

/// Smallest accepted gain of a force sensor: the inverse of the largest gain of 50 of other sensors
/// (`LARGEST_GAIN_SHARE`). Unfounded.
pub(crate) const LEAST_FORCE_GAIN: f64 = 0.02;

/// Largest ratio, and inverse of the smallest ratio, of the fitted sensor delay to the delay for which its regressor
/// was computed. Beyond it the fit does not describe a delay. Unfounded.
pub(crate) const ANOTHER_DELAY: f64 = 100.0;

/// Smallest response of a mode along the sensor's axis with which the mode has a sensor-to-tool-tip ratio of its own,
/// as a share of the largest modal response there. It lies far above rounding and below the least assumed noise of a
/// sensor (`LEAST_RELATIVE_NOISE`); the value between them is unfounded.
pub(crate) const LEAST_RESPONSE_WITH_RATIO: f64 = 1e-6;

/// Largest accepted share of a spring that does not act within a gap (backlash). A share cannot exceed 1; the tolerance
/// of 2 % for the scatter of the fit is unfounded.
pub(crate) const LARGEST_SPRING_SHARE: f64 = 1.02;

/// Smallest and largest change from 1 of the exponent of a chip law F ∝ h^p: exponents from 0.2 to 2. Published
/// exponents lie between 0.5 and 1 (Kienzle: 1 − m_c with m_c up to 0.5). The margins are unfounded.
pub(crate) const CHIP_EXPONENT_CHANGE: [f64; 2] = [-0.8, 1.0];

/// Relative change of a mass, damping constant or stiffness up to which a candidate is refused as not physical. At −1
/// the parameter vanishes; the distance of 5 % is unfounded.
pub(crate) const LEAST_RELATIVE_CHANGE: f64 = -0.95;

// Fits

/// Largest root mean square of the difference between the motion of a cut that a candidate model supplies and the
/// prediction along it, in standard deviations of the noise, at which their iteration has converged: it adds 0.03² =
/// 0.001 of the noise to χ².
pub(crate) const CLOSED_LOOP_SETTLED: f64 = 0.03;

/// Smallest decrease of χ² by a step of a prediction-error search. A smaller decrease ends the search: its step is
/// shorter than √0.1 = 0.3 standard deviations of the parameters.
pub(crate) const SEARCH_SETTLED: f64 = 0.1;

/// Excess of a candidate model's χ² over that of the best rival above which its prediction-error search may be given up
/// (`SLOW_CATCHING_UP`, `HOPELESS_PREDICTED_SHARE`). A candidate model is not selected if its χ² is 16 (`EQUIVALENT`)
/// larger; the linear prediction of a search errs by a multiple of that. Unfounded.
pub(crate) const HOPELESS_LAG: f64 = 300.0;

/// Share of its lag, the χ² beyond that of the best rival plus `HOPELESS_LAG`, that a step of a prediction-error search
/// may leave; a search whose step leaves more is given up, since it will not catch up. Unfounded.
pub(crate) const SLOW_CATCHING_UP: f64 = 0.6;

/// Share of the present χ² that the linearized model may predict for the next step of a search, if the prediction
/// exceeds the χ² of the best rival by more than `HOPELESS_LAG`; the search is given up if a larger share is predicted.
/// Unfounded.
pub(crate) const HOPELESS_PREDICTED_SHARE: f64 = 0.5;

/// Smallest decrease of χ² that the linear fit of the extended case must predict for a further prediction of the cuts:
/// half of what chance lets one parameter gain on average, which is 1.
pub(crate) const RELINEARIZATION_SETTLED: f64 = 0.5;

/// Addition to `HOPELESS_LAG` for the first prediction of the cuts, as a share of the best rival's χ². The first
/// prediction follows the measured motion, whose noise adds to χ². Unfounded.
pub(crate) const FIRST_PREDICTION_LAG: f64 = 0.1;

/// χ² of a simulated candidate model at the start of its search, over the χ² of its linear regression plus the number
/// of compared values, above which the search first fits the beginning of each record alone. Unfounded.
pub(crate) const FAR_START: f64 = 2.0;

/// χ² of a candidate model's regression, over the smallest χ² of the regressions of all candidate models that are
/// simulated (at least the number of compared values), from which on the start of its search is not improved by a fit
/// of the beginning of each record. Unfounded.
pub(crate) const FAR_BEHIND: f64 = 4.0;

/// χ² per compared value (1 for noise alone) above which a prediction-error search counts as stuck. A stuck search with
/// friction is restarted only if its χ² is below this factor times the χ² of the best rival. Unfounded.
pub(crate) const STUCK: f64 = 1.1;

/// Reduction of χ² by a candidate model, as a share of the reduction by the best one, above which its nonlinear
/// parameters are refined between the grid points. Unfounded.
pub(crate) const REFINED_SHARE: f64 = 0.5;

/// Least decrease of χ² by a Gauss–Newton step in the nonlinear parameters: that of a step of a tenth of a standard
/// deviation.
pub(crate) const LEAST_REFINEMENT: f64 = 0.01;

/// Additional variance of some parameter by force noise, as a share of its variance, above which the intervals of a
/// candidate model are widened: 2.5 % of a standard deviation, less than the draws resolve.
pub(crate) const LEAST_FORCE_NOISE_VARIANCE: f64 = 0.05;

// Selection

/// Least gain of a further cause: decrease of χ² minus the price ln n of each parameter for n values (Schwarz). It
/// bounds false alarms: one parameter that fits noise gains 20 with the probability P(χ²₁ > 20 + ln n) = 2e-7 for n =
/// 1000, which is one false alarm in 1 000 diagnoses with 5 000 candidate models (pairs of 100 candidates). A gain of
/// 10 would give one in five.
pub(crate) const LEAST_GAIN: f64 = 20.0;

/// Difference of gains below which two candidate models are equivalent. At the distance d of two models, twice their
/// log-likelihood ratio is normal with mean d² and standard deviation 2d: the wrong model leads by 16 with a
/// probability of at most Φ(−√16) = 3e-5 at any d, the four standard deviations of `CHANCE`.
pub(crate) const EQUIVALENT: f64 = 16.0;

/// χ² of a candidate model, per compared value or over that of another candidate model, below which it explains the
/// records nearly as well: it may still be the simpler truth. Unfounded.
pub(crate) const NEARLY_EXPLAINED: f64 = 1.5;

/// χ² of a candidate model's regression along the measured motion, over the χ² of a rival that explains the records (at
/// least the number of compared values), above which the candidate model is not simulated. Unfounded.
pub(crate) const REGRESSION_FAR_BEHIND: f64 = 6.0;

/// The same ratio as `REGRESSION_FAR_BEHIND` for a candidate model with fewer parameters than the rival. It may be the
/// truth that the rival contains. Unfounded.
pub(crate) const REGRESSION_FAR_BEHIND_SIMPLER: f64 = 30.0 * REGRESSION_FAR_BEHIND;

/// Largest number of simulated candidate models, by gain, whose parameters are refined by predicting the cuts again.
/// Unfounded.
pub(crate) const MOST_REFINED: usize = 4;

/// Largest numbers of candidate models that are simulated because one more cause explains most of the residual of a
/// simulated model with one cause less: the first for the best such model, the second for the next. Unfounded.
pub(crate) const MOST_EXTENDED: [usize; 2] = [6, 3];

/// Largest number of candidate models that are simulated because they fit best if the extended case of the best model
/// with one cause less is the baseline. Unfounded.
pub(crate) const MOST_REBASELINED: usize = 4;

/// Share of the baseline's residual energy that the right candidate model leaves along the measured motion, because
/// sampling hides the motion between samples. Unfounded.
pub(crate) const SAMPLING_RESIDUAL: f64 = 2e-3;

/// Share of the baseline's residual energy that the right candidate model leaves if it is simulated, because the
/// measured forces are interpolated between samples. Unfounded.
pub(crate) const SAMPLING_RESIDUAL_SIMULATED: f64 = 5e-5;

/// Share of the baseline's residual energy by which interpolation between samples biases the comparison of candidate
/// models. Unfounded.
pub(crate) const INTERPOLATION_ERROR: f64 = 1e-4;

/// Residual energy of a study above the noise, as a share of the noise energy, up to which its residual counts as
/// noise. It allows for errors of the noise floor and for chance. Unfounded.
pub(crate) const NOISE_TOLERANCE: f64 = 0.15;

/// Share of the residual energy above the noise, of the model without the cause, that a further cause must explain. A
/// cause that explains less may only compensate for a wrong equation. Unfounded.
pub(crate) const LEAST_SHARE: f64 = 0.2;

/// Residual energy, or decrease of χ² by a further cause, as a multiple of the energy of the computation errors in a
/// cut, above which it has another origin than these errors: twice their amplitude.
pub(crate) const OVER_COMPUTATION_ERROR: f64 = 4.0;

/// Addition to the smallest gain (`LEAST_GAIN`) of a further cause of a cut if fewer causes are sufficient, as a share
/// of the noise energy (one per compared value). The noise floor and the computation near a resonance err by about as
/// much. Unfounded.
pub(crate) const LEAST_SHARE_BESIDE_ENOUGH: f64 = 5e-3;

/// χ² of the baseline per compared value (1 for noise alone) below which nothing is to explain: the residual is then
/// smaller than the smallest noise that a sensor is assumed to have. Unfounded.
pub(crate) const NOTHING_TO_EXPLAIN: f64 = 0.5;

/// Largest excess of χ² over its mean, in its standard deviations √(2n) for n values, that counts as noise: four
/// standard deviations, which chance exceeds in 3 of 100 000 records.
pub(crate) const CHANCE: f64 = 4.0;

// Conclusion

/// Largest share of the baseline's residual energy above the noise that an accepted candidate model may leave, unless
/// all records are compared in force. The noise of records compared in motion is known from its floor. Unfounded.
pub(crate) const UNEXPLAINED_OF_RESPONSE: f64 = 0.012;

/// Largest share of the baseline's residual energy above the noise that an accepted candidate model may leave if all
/// records are compared in force, where derivatives of the motion add noise that is not white. Unfounded.
pub(crate) const UNEXPLAINED_OF_FORCE: f64 = 0.15;

/// Factor on `UNEXPLAINED_OF_RESPONSE` for each cause after the first of a simulated candidate model. Two or three
/// wrong causes imitate much of a residual, but leave more than this. Unfounded.
pub(crate) const UNEXPLAINED_PER_FURTHER_CAUSE: f64 = 0.05;

/// Residual energy of a simulated candidate model above the noise, as a share of the noise energy, above which the
/// model is doubted; chance (`CHANCE_OF_DOUBT`) is added to this share. Unfounded.
pub(crate) const DOUBTFUL_RESIDUAL: f64 = 0.03;

/// Random scatter that a residual above `DOUBTFUL_RESIDUAL` is granted before its candidate model is doubted, in
/// standard deviations √(2/n) of χ²/n over n compared values. Unfounded.
pub(crate) const CHANCE_OF_DOUBT: f64 = 5.0;

/// Factor on the confidence in a simulated candidate model whose residual energy exceeds `DOUBTFUL_RESIDUAL` plus
/// chance. Unfounded.
pub(crate) const DOUBT: f64 = 0.8;

/// NRMSE on the whole records, as a multiple of that on the held-out segments, above which the user is warned.
/// Unfounded.
pub(crate) const UNLIKE_SEGMENTS: f64 = 3.0;

/// Width of the logistic function that turns the lead of a candidate model over its best rival, as a difference of
/// gains, into a confidence. Bayes' theorem with exact likelihoods gives 2; the larger width for errors of the models
/// is unfounded.
pub(crate) const CONFIDENCE_WIDTH: f64 = 6.0;

/// Relative loss of confidence in a cause if the unexplained share of the residual energy is as large as allowed.
/// Unfounded.
pub(crate) const CONFIDENCE_LOSS: f64 = 0.5;

/// Highest confidence in a cause that an answer states. In the campaign `hidden-effects` 3 of 925 confident answers are
/// wrong, which is compatible with error rates of 0.09 to 0.84 % (90 % interval): 0.5 % lies within.
pub(crate) const HIGHEST_CONFIDENCE: f64 = 0.995;

/// Confidence in mass, stiffness and damping changed by one factor, if the gain of a sensor is equivalent: one over the
/// number of equivalent causes, which is four.
pub(crate) const COMMON_FACTOR_CONFIDENCE: f64 = 0.25;

/// Least share of the held-out residual energy that a guessed formula for the missing restoring force must explain.
/// Unfounded.
pub(crate) const LEAST_EXPLAINED_BY_GUESS: f64 = 0.1;

/// Residual power of a channel, averaged over nine spectral bins, as a multiple of the noise power, above which the bin
/// in the middle shows a missing force. The mean of nine bins of noise has a relative standard deviation of 1/3: six
/// standard deviations.
pub(crate) const MISSING_FORCE_OVER_NOISE: f64 = 3.0;

/// Displacement amplitude of a segment, as a share of the largest amplitude of all segments of the record, up to which
/// the stiffness and damping of the missing force in this segment are not shown. Unfounded.
pub(crate) const LEAST_AMPLITUDE: f64 = 0.02;

/// Share of all samples that lie in the first parts of long records, below which causes are searched in these parts
/// only. With a larger share, little time is gained. Unfounded.
pub(crate) const SHORTENED_SHARE: f64 = 0.5;

/// Largest difference between the immersion angles of a recorded cut and of the case at which the cut is drawn in the
/// case's stability chart, degrees. Unfounded.
pub(crate) const SAME_IMMERSION_DEG: f64 = 0.5;

/// Largest relative difference between the feeds per tooth of a recorded cut and of the case at which the cut is drawn
/// in the case's stability chart. Unfounded.
pub(crate) const SAME_FEED: f64 = 1e-3;

// Next test

/// Squared distance D² of two candidate models at which a test separates them. Twice their log-likelihood ratio is
/// normal with mean D² and standard deviation 2D. It exceeds `EQUIVALENT` with a probability of Φ((60 − 16)/(2·√60)) =
/// 99.8 %.
pub(crate) const SEPARATING_DISTANCE: f64 = 60.0;

/// Largest displacement of the tool in the simulation of a cut, as a multiple of the largest displacement in the
/// records, above which the cut is not proposed as the next test. Unfounded.
pub(crate) const LARGEST_PROPOSED_MOTION: f64 = 10.0;

/// Assumed standard deviation of the noise of a sensor that no record has, as a share of the root mean square of its
/// reading. Unfounded.
pub(crate) const ASSUMED_NOISE: f64 = 0.01;

#[cfg(test)]
mod tests {
    use quietcut_numerics::statistics::{chi_squared_probability, f_quantile, normal_probability};

    use super::*;

    #[test]
    fn probabilities_of_chance_are_those_that_the_sentences_state() {
        // The largest of 500 F-ratios of pure jitter, over 200 edges, exceeds 8 in one of a hundred records.
        let largest = f_quantile(1.0 - 0.01 / 500.0, [3.0, 200.0]);
        assert!((largest - 8.0).abs() < 1.0, "{largest}");
        assert!(LEAST_MODULATION_F_RATIO > largest);
        // One parameter that fits noise of 1 000 values.
        let by_chance = 1.0 - chi_squared_probability(LEAST_GAIN + 1000.0_f64.ln(), 1.0);
        assert!((by_chance / 2e-7 - 1.0).abs() < 0.5, "{by_chance:e}");
        let wrong_leads = normal_probability(-(EQUIVALENT.sqrt()));
        assert!((wrong_leads / 3e-5 - 1.0).abs() < 0.5, "{wrong_leads:e}");
        let separates = (SEPARATING_DISTANCE - EQUIVALENT) / (2.0 * SEPARATING_DISTANCE.sqrt());
        assert!((normal_probability(separates) - 0.998).abs() < 5e-4);
    }
}
