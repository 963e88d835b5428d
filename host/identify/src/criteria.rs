//! Every threshold by which this crate decides, each with the source of its number.
//!
//! A number without a derivation or a campaign behind it is marked "Unfounded". Step sizes, grids and limits of iterations decide nothing
//! about a record and stay beside the code that uses them.

// Modes from receptances

/// Fewest frequency lines of a band. The highest model order is a third of the number of lines; with fewer than 16 lines it does not
/// exceed `LEAST_ORDERS`.
pub(crate) const LEAST_LINES: usize = 16;

/// Smallest standard deviation of a receptance relative to its RMS: −100 dB. No sensor measures better.
pub(crate) const LEAST_RELATIVE_DEVIATION: f64 = 1e-5;

/// Damping ratio from which a pole is not a mode. Beyond 1/√2 its receptance has no peak above the static compliance. Half is taken,
/// because so broad a peak is the residual of modes outside the band. Unfounded between 0.3 and 0.7.
pub(crate) const OVERDAMPED: f64 = 0.5;

/// Norm of the residues of a mode, in standard deviations, below which the mode is rejected. A normal variable exceeds three standard
/// deviations with a probability of 0.3 %.
pub(crate) const LEAST_RESIDUE_SIGNIFICANCE: f64 = 3.0;

/// NRMSE of the fitted receptances above which a warning says that the model does not fit. Unfounded.
pub(crate) const LARGEST_FIT_ERROR: f64 = 0.1;

/// Fewest frequency lines within the half-power bandwidth 2ζf of a mode. With fewer its damping is extrapolated from the flanks of the
/// peak, not measured.
pub(crate) const LINES_PER_HALF_POWER_WIDTH: f64 = 3.0;

/// Standard deviation of a damping ratio, relative to the ratio, above which the user is warned. Stability limits are about proportional
/// to the damping ratio, so that their 90 % intervals are then ±16 %. Unfounded.
pub(crate) const LARGEST_DAMPING_DEVIATION: f64 = 0.1;

/// Difference of two natural frequencies, in standard deviations of the difference, below which two modes are not separable. Equal
/// frequencies differ by more with a probability of 0.3 %.
pub(crate) const SEPARABLE_DEVIATIONS: f64 = 3.0;

/// Relative change of the natural frequency from one model order to the next up to which a pole is stable: 1 %, the usual value of
/// stabilization diagrams.
pub(crate) const SAME_FREQUENCY: f64 = 0.01;

/// Relative change of the damping ratio from one model order to the next up to which a pole is stable. Usual values are 5 to 10 %.
pub(crate) const SAME_DAMPING: f64 = 0.1;

/// Smallest modal assurance criterion between the residues of a pole and those of the previous order at which the pole is stable: the
/// usual 0.95.
pub(crate) const SAME_SHAPE: f64 = 0.95;

/// Number of consecutive orders over which a pole must be stable to be a mode, relative to the number of all orders. Unfounded.
pub(crate) const ORDERS_SHARE: f64 = 0.25;

/// Fewest consecutive orders over which a pole must be stable to be a mode. Unfounded.
pub(crate) const LEAST_ORDERS: usize = 4;

/// Distance of two stable poles, in units of `SAME_FREQUENCY` and `SAME_DAMPING`, up to which they are the same mode. Unfounded.
pub(crate) const SAME_POLE_DISTANCE: f64 = 3.0;

/// Modal assurance criterion of two stable poles above which they are the same mode. Unfounded.
pub(crate) const SAME_POLE_SHAPE: f64 = 0.9;

/// Peak height of a stable pole, relative to that of the strongest pole, below which it is not a mode. Unfounded.
pub(crate) const LEAST_HEIGHT: f64 = 3e-3;

// Modes from whole records

/// Largest number of frequency lines of all records together: a fit of more takes minutes on one core.
pub(crate) const MOST_RECORD_LINES: usize = 200_000;

/// Fewest frequency lines of a record in the band: the same number as `LEAST_LINES`.
pub(crate) const LEAST_RECORD_LINES: usize = 16;

/// Smallest noise of a channel relative to its RMS: −100 dB. No sensor measures better.
pub(crate) const LEAST_RELATIVE_NOISE: f64 = 1e-5;

// Dwells

/// Level of the force in a block, relative to the quietest blocks, above which the structure is excited. Unfounded.
pub(crate) const FORCE_ABOVE_NOISE: f64 = 3.0;

/// Smallest and largest threshold of the force level, relative to the largest block: the smallest applies to records without noise, the
/// largest to records without a pause. Unfounded.
pub(crate) const FORCE_BELOW_LARGEST: [f64; 2] = [0.02, 0.3];

/// Change of the local frequency, relative to its scatter, above which the excitation steps to another frequency. Noise does not reach
/// ten times its scatter.
pub(crate) const STEP_SCATTER: f64 = 10.0;

/// Relative change of the local frequency above which the excitation steps to another frequency, in records without noise. Unfounded.
pub(crate) const STEP_SHARE: f64 = 1e-3;

/// Relative difference of two frequencies up to which they belong to the same step of a step-sine test. With noise of 1 % at 20 samples
/// per period, the frequency of a dwell of ten periods has a standard deviation of 5e-5; the steps of the thesis are 3e-3. Unfounded
/// between.
pub(crate) const SAME_STEP: f64 = 1e-3;

/// Fewest periods of a dwell. Unfounded.
pub(crate) const LEAST_DWELL_PERIODS: f64 = 10.0;

/// Noise of a Fourier coefficient over the residual transient from which a dwell is settled. A bias of a fifth of the standard deviation
/// lowers the coverage of a 90 % interval to 89.3 %.
pub(crate) const NOISE_OVER_TRANSIENT: f64 = 5.0;

/// Relative change of the fundamental between the halves of a dwell up to which the motion is steady: a transient of this size biases
/// the parameters by less than noise of 1 % scatters them.
pub(crate) const STEADY_CHANGE: f64 = 1e-3;

/// Change of the fundamental between the halves of a dwell, in standard deviations, up to which the motion is steady: chance exceeds
/// 4 once in ten thousand dwells.
pub(crate) const STEADY_DEVIATIONS: f64 = 4.0;

// Fits to dwells

/// χ² per degree of freedom above which a law does not explain the data down to the noise; its covariance then comes from the scatter
/// between dwells (sandwich). At 1.3 the intervals from the noise are too narrow by √1.3 = 1.14, and a sandwich from 30 dwells scatters
/// by as much, 1/√58 = 13 %: below, it gains nothing. Unfounded for other numbers of dwells.
pub(crate) const LARGEST_MISFIT: f64 = 1.3;

/// Fewest force levels at a frequency for higher-order FRF: H₁, H₃ and H₅ are three unknowns.
pub(crate) const LEAST_LEVELS: usize = 3;

/// Fewest samples of a period of a multisine. Unfounded.
pub(crate) const LEAST_PERIOD_SAMPLES: usize = 16;

/// Fewest samples of a record per term of a restoring force. Unfounded.
pub(crate) const SAMPLES_PER_TERM: usize = 20;

/// Fewest samples in a slice of a restoring-force surface, to which three coefficients are fitted. Unfounded.
pub(crate) const LEAST_SLICE_SAMPLES: usize = 12;

// Linearity

/// Scatter of the response over force, relative to the largest response, that curvature within one region may cause. Unfounded.
pub(crate) const CURVATURE_SHARE: f64 = 2e-3;

/// Reduction of χ² above which the response over force is two lines instead of one. Chance reaches 25 with a probability of 6e-7; twice
/// that accounts for the choice of the break.
pub(crate) const REGION_EVIDENCE: f64 = 50.0;

/// Fewest points of a region of the response over force: a line has two parameters. Unfounded.
pub(crate) const LEAST_REGION_POINTS: usize = 6;

/// Difference of two neighbouring lines of the response over force, in standard deviations of the noise, above which the response jumps.
/// A normal variable exceeds six with a probability of 2e-9.
pub(crate) const JUMP_DEVIATIONS: f64 = 6.0;

/// Difference of two neighbouring lines, relative to the response, above which the response jumps. The curvature of a smooth response
/// gives less between two windows. Unfounded.
pub(crate) const JUMP_SHARE: f64 = 0.05;

/// Relative difference of two amplitudes at one frequency from which they count as two force levels. Unfounded.
pub(crate) const DIFFERENT_LEVELS: f64 = 0.05;

/// χ² of a linear structure above its mean, in standard deviations of χ², up to which a structure is linear. A normal variable exceeds
/// four with a probability of 3e-5.
pub(crate) const LINEAR_DEVIATIONS: f64 = 4.0;

/// χ² of the harmonics above its mean, in standard deviations of χ², above which harmonics are significant. A normal variable exceeds
/// five with a probability of 3e-7.
pub(crate) const HARMONIC_DEVIATIONS: f64 = 5.0;

/// Harmonic of the force, in standard deviations of its noise, that is not counted as a cause of motion. A normal variable exceeds three
/// with a probability of 0.1 %.
pub(crate) const FORCE_HARMONIC_DEVIATIONS: f64 = 3.0;

/// Change of stiffness with the level over −k·(X₂/X)², at which a quadratic spring causes the change. Harmonic balance gives 30; half of
/// it either way allows for damping, other modes and the next order of the balance. Unfounded.
pub(crate) const QUADRATIC_STIFFNESS_RATIO: [f64; 2] = [15.0, 45.0];

/// Reduction of χ² per parameter above which a kind of nonlinearity is named. Chance reaches 25 with a probability of 6e-7.
pub(crate) const KIND_EVIDENCE: f64 = 25.0;

/// Residual χ² of a kind of nonlinearity, relative to that of a linear structure, below which the kind explains the level dependence. A
/// describing function omits higher harmonics, an error of up to a tenth of its effect, which is 1 % in squares.
pub(crate) const EXPLAINED_SHARE: f64 = 0.01;

/// Fewest independent estimates in the common band of two sweeps. Unfounded.
pub(crate) const LEAST_SWEEP_ESTIMATES: f64 = 10.0;

/// Misfit of two sweeps above which they are not of one linear structure. The misfit of a linear structure reaches about 5, because the
/// variances have nine degrees of freedom per line and omit the noise of the force.
pub(crate) const SWEEP_MISFIT: f64 = 20.0;

/// Largest difference of the receptances of two sweeps, relative to the peak, below which it is not significant. Unfounded.
pub(crate) const LEAST_SWEEP_CHANGE: f64 = 0.005;

/// Misfit of two cross receptances above 1, in standard deviations of the mean of exponential variables, up to which the structure is
/// reciprocal. A normal variable exceeds five with a probability of 3e-7.
pub(crate) const RECIPROCAL_DEVIATIONS: f64 = 5.0;

/// Largest difference of two cross receptances, relative to the peak, up to which the structure is reciprocal. The position of a shaker
/// and its direction are not more accurate. Unfounded.
pub(crate) const LEAST_RECIPROCITY_CHANGE: f64 = 0.01;

/// Signal power over noise power from which a frequency belongs to the band of a restoring force. Unfounded.
pub(crate) const BAND_SIGNAL_TO_NOISE: f64 = 1e3;

// Cutting tests

/// Fewest revolutions of full engagement; intervals come from the scatter between revolutions. With four, Student's quantile exceeds the
/// normal one by a factor of 1.4, with two by 3.8. Unfounded.
pub(crate) const LEAST_REVOLUTIONS: usize = 4;

/// Mean force of a revolution, relative to that of full engagement, above which the tool is engaged. Unfounded.
pub(crate) const ENGAGED_SHARE: f64 = 0.9;

/// Relative difference of two feeds per tooth up to which they count as one feed. Unfounded.
pub(crate) const SAME_FEED: f64 = 0.02;

/// Difference between coefficients of two methods, relative to the largest coefficient, that is reported. Unfounded.
pub(crate) const LEAST_METHOD_DIFFERENCE: f64 = 0.05;

/// Growth rate ln |μ| of a trial cut, in relative errors of the depth, beyond which its outcome is certain. ln |μ| changes by about as
/// much as the relative depth, at most by a few times as much.
pub(crate) const CERTAIN_DEVIATIONS: f64 = 12.0;

/// Probability that the recorded outcome of a trial cut is wrong for reasons outside the model. Unfounded.
pub(crate) const MISJUDGED_SHARE: f64 = 1e-3;

/// Distance of a trial cut from the predicted limit on the wrong side, in standard deviations of the depth, beyond which it counts as
/// misjudged. A normal variable exceeds three with a probability of 0.1 %.
pub(crate) const WRONG_DEPTH_DEVIATIONS: f64 = 3.0;

/// Difference of measured and predicted chatter frequency, in standard deviations, beyond which a cut counts as misjudged. A normal
/// variable exceeds four in magnitude with a probability of 6e-5.
pub(crate) const WRONG_FREQUENCY_DEVIATIONS: f64 = 4.0;

/// Number of trial cuts per cut that the best structure may misjudge. Unfounded.
pub(crate) const CUTS_PER_MISJUDGED: usize = 20;

/// Width of a posterior interval, relative to that of the prior on a logarithmic scale, above which the cuts do not identify a parameter.
/// At half the width of a uniform prior the cuts give one bit of information.
pub(crate) const VAGUE_SHARE: f64 = 0.5;

// Robots

/// Smallest relative error of a receptance of a robot. The noise of the force in H1, and errors of sensors, windows and sample rates are
/// common to all lines, so that no scatter shows them. Unfounded.
pub(crate) const LEAST_RELATIVE_ERROR: f64 = 3e-3;

/// Frequency relative to that of the highest peak, r, below which a receptance counts as static in the first guess. The receptance of the
/// mode of that peak differs from the static one by r²/(1 − r²) = 19 % at most.
pub(crate) const NEARLY_STATIC: f64 = 0.4;

/// Smallest and largest ratio of a fitted static stiffness of a joint to that of the given robot at which the fitted one is the first
/// guess. Unfounded.
pub(crate) const GUESSED_STIFFNESS_RATIO: [f64; 2] = [0.1, 10.0];

/// Relative error of the equivalent linearization, which omits higher harmonics. Unfounded.
pub(crate) const LINEARIZATION_ERROR: f64 = 0.1;

// Ambient tests

/// Change of the frequency of a mode to a higher model order up to which the mode is stable: relative change, the usual 1 % of
/// stabilization diagrams; and in standard deviations, which chance exceeds in 0.3 % of cases.
pub(crate) const SAME_MODE: (f64, f64) = (0.01, 3.0);

/// Largest damping ratio of a mode from ambient vibration: a pole that decays faster describes the spectrum of the excitation.
/// Unfounded.
pub(crate) const LARGEST_AMBIENT_DAMPING: f64 = 0.3;

// Test plans

/// Largest number of tests of a plan. Unfounded.
pub(crate) const MOST_TESTS: usize = 30;

/// Smallest relative reduction of the excess width by a test that is added to a plan: `MOST_TESTS` tests with less reduce it by less
/// than 3 % together.
pub(crate) const LEAST_GAIN: f64 = 1e-3;

/// Distance of a lobe above the lowest lobe, in standard deviations of the difference, beyond which it is never the lowest: the
/// probability is 3e-5.
pub(crate) const NEVER_LOWEST: f64 = 4.0;

#[cfg(test)]
mod tests {
    use quietcut_numerics::statistics::{chi_squared_probability, chi_squared_quantile, normal_probability};

    use super::*;

    /// True where a computed probability has the stated order of magnitude and first digit.
    fn is_stated(probability: f64, stated: f64) -> bool {
        (probability / stated - 1.0).abs() < 0.5
    }

    #[test]
    fn probabilities_of_chance_are_those_that_the_sentences_state() {
        let exceeds = |deviations: f64| normal_probability(-deviations);
        assert!(is_stated(
            1.0 - chi_squared_probability(0.5 * REGION_EVIDENCE, 1.0),
            6e-7
        ));
        assert!(is_stated(1.0 - chi_squared_probability(KIND_EVIDENCE, 1.0), 6e-7));
        assert!((chi_squared_quantile(1.0 - 6e-7, 1.0) / KIND_EVIDENCE - 1.0).abs() < 0.01);
        assert!(is_stated(2.0 * exceeds(JUMP_DEVIATIONS), 2e-9));
        assert!(is_stated(exceeds(LINEAR_DEVIATIONS), 3e-5));
        assert!(is_stated(exceeds(HARMONIC_DEVIATIONS), 3e-7));
        assert!(is_stated(exceeds(FORCE_HARMONIC_DEVIATIONS), 1e-3));
    }
}
