//! Every threshold by which this crate decides, each with the source of its number.
//!
//! A number without a derivation or a campaign behind it is marked "Unfounded". Step sizes, grids and limits of
//! iterations decide nothing about a record and stay beside the code that uses them.

// Modes from receptances

/// Fewest frequency lines in the band of a modal fit to receptances. With n lines the highest model order is at most
/// (n−1)/3; with fewer than 16 lines it does not exceed `LEAST_ORDERS`.
pub(crate) const LEAST_LINES: usize = 16;

/// Smallest standard deviation of a receptance value that a modal fit assumes, relative to the RMS of the receptance, and
/// of a sample of a decay, relative to the largest one: −100 dB. No sensor measures better.
pub(crate) const LEAST_RELATIVE_DEVIATION: f64 = 1e-5;

/// Damping ratio from which a fitted pole does not count as a mode. Beyond 1/√2 its receptance has no peak above the
/// static compliance. A lower limit is taken, because a peak so broad is the residual of modes outside the band.
/// Unfounded between 0.3 and 0.7.
pub(crate) const OVERDAMPED: f64 = 0.5;

/// Probability that the residues of a pole that stays the same over the model orders have their χ² by chance, above
/// which the pole is rejected as a mode: that of three standard deviations of one number.
pub(crate) const CHANCE_OF_RESIDUES: f64 = 0.003;

/// NRMSE of the fitted receptances below which no further mode is searched: a mode of this size moves no stability
/// limit by a percent. Unfounded.
pub(crate) const FURTHER_ERROR: f64 = 1e-3;

/// Probability that noise has a further mode at one of the poles that are tried in the residual of a modal fit: one
/// identification in a thousand.
pub(crate) const CHANCE_OF_FURTHER_MODE: f64 = 1e-3;

/// Damping ratio of a further mode, in standard deviations, below which it is none: its damping could be 0. A normal
/// variable falls below −3 with a probability of 0.1 %.
pub(crate) const LEAST_DAMPING_DEVIATIONS: f64 = 3.0;

/// NRMSE of the fitted receptances above which a warning says that the modal model does not fit. Unfounded.
pub(crate) const LARGEST_FIT_ERROR: f64 = 0.1;

/// Fewest frequency lines of a receptance within the half-power bandwidth 2ζf of a mode without a warning. With fewer,
/// the damping of the mode is extrapolated from the flanks of the peak, not measured.
pub(crate) const LINES_PER_HALF_POWER_WIDTH: f64 = 3.0;

/// Largest standard deviation of an identified damping ratio without a warning, relative to the ratio. Stability limits
/// are about proportional to the damping ratio, so that their 90 % intervals are then ±16 %. Unfounded.
pub(crate) const LARGEST_DAMPING_DEVIATION: f64 = 0.1;

/// Difference of the natural frequencies of two neighbouring modes, in standard deviations of the difference, below
/// which the modes are not separable. Equal frequencies differ by more with a probability of 0.3 %.
pub(crate) const SEPARABLE_DEVIATIONS: f64 = 3.0;

/// Probability with which a natural frequency stays below the χ² from which it counts as different between the recordings
/// of a roving test, if it is the same.
pub(crate) const SHIFT_PROBABILITY: f64 = 0.99;

/// Relative change of the natural frequency of a pole from one model order to the next up to which the pole is stable
/// in the stabilization diagram: 1 %, the usual value.
pub(crate) const SAME_FREQUENCY: f64 = 0.01;

/// Relative change of the damping ratio of a pole from one model order to the next up to which the pole is stable in
/// the stabilization diagram. Usual values are 5 to 10 %.
pub(crate) const SAME_DAMPING: f64 = 0.1;

/// Smallest modal assurance criterion between the residues of a pole and those of the pole of the previous model order
/// at which the pole is stable in the stabilization diagram: the usual 0.95.
pub(crate) const SAME_SHAPE: f64 = 0.95;

/// Number of consecutive model orders that a stable pole must exceed to be a mode, relative to the number of all orders
/// of the stabilization diagram. Unfounded.
pub(crate) const ORDERS_SHARE: f64 = 0.25;

/// Smallest number of consecutive model orders that a stable pole must exceed to be a mode, whatever the number of all
/// orders of the stabilization diagram. Unfounded.
pub(crate) const LEAST_ORDERS: usize = 4;

/// Larger one of the relative differences of frequency and damping ratio of two stable poles up to which they are the
/// same mode if their residues agree (`SAME_POLE_SHAPE`), in multiples of `SAME_FREQUENCY` and `SAME_DAMPING`.
/// Unfounded.
pub(crate) const SAME_POLE_DISTANCE: f64 = 3.0;

/// Modal assurance criterion between the residues of two stable poles above which they are the same mode if frequency
/// and damping ratio agree (`SAME_POLE_DISTANCE`). Unfounded.
pub(crate) const SAME_POLE_SHAPE: f64 = 0.9;

/// Height of the resonance peak of a stable pole, relative to that of the strongest pole, below which the pole is not a
/// mode. Unfounded.
pub(crate) const LEAST_HEIGHT: f64 = 3e-3;

/// Fewest frequency lines per receptance from which the correlation between the residuals of receptances is estimated.
/// With fewer, the estimate is too inaccurate for weights. Unfounded.
pub(crate) const LINES_PER_RECEPTANCE: usize = 6;

/// Smallest modal assurance criterion between the shapes of modes of two tests at which they may be one mode. Shapes above 0.9 count as
/// those of one mode, below 0.1 as those of different modes (Ewins, Modal Testing); with two or three directions shapes scatter more.
/// Unfounded between.
pub(crate) const SAME_MODE_SHAPE: f64 = 0.8;

/// Ratio of the natural frequencies of modes of two tests below which they may be one mode. Half the overhang of a tool changes its
/// frequency by a factor of four; a change of the clamping or wear of the bearings by some percent. Unfounded.
pub(crate) const SAME_MODE_FREQUENCY: f64 = 1.2;

// Modes from whole records

/// Largest number of frequency lines of all records together in a modal fit to whole records: a fit of more takes
/// minutes on one core.
pub(crate) const MOST_RECORD_LINES: usize = 200_000;

/// Fewest frequency lines in the band of each record in a modal fit to whole records: the same number as `LEAST_LINES`.
pub(crate) const LEAST_RECORD_LINES: usize = 16;

/// Smallest standard deviation of the noise of a channel that a modal fit to whole records assumes, relative to the RMS
/// of the channel: −100 dB. No sensor measures better.
pub(crate) const LEAST_RELATIVE_NOISE: f64 = 1e-5;

// Dwells

/// RMS force in a block of a step-sine record above which the structure is excited, relative to the RMS of the quietest
/// blocks. Unfounded.
pub(crate) const FORCE_ABOVE_NOISE: f64 = 3.0;

/// Smallest and largest RMS force above which a block of a step-sine record is excited, relative to the RMS of the
/// strongest block. The smallest applies to records without noise, the largest to records without a pause. Unfounded.
pub(crate) const FORCE_BELOW_LARGEST: [f64; 2] = [0.02, 0.3];

/// Change of the local excitation frequency above which a new frequency step begins, in multiples of the scatter of
/// that frequency: its median change from one period to the next. Noise hardly reaches ten times its scatter.
pub(crate) const STEP_SCATTER: f64 = 10.0;

/// Relative change of the local excitation frequency above which a new frequency step begins, in records without noise.
/// Unfounded.
pub(crate) const STEP_SHARE: f64 = 1e-3;

/// Relative difference of the excitation frequencies of two dwells up to which they belong to the same step of a
/// step-sine test. With noise of 1 % at 20 samples per period, the frequency of a dwell of ten periods has a standard
/// deviation of 5e-5; the steps of the thesis are 3e-3. Unfounded between.
pub(crate) const SAME_STEP: f64 = 1e-3;

/// Fewest excitation periods of the steady part of a dwell. Unfounded.
pub(crate) const LEAST_DWELL_PERIODS: f64 = 10.0;

/// Standard deviation of a Fourier coefficient of a dwell's motion, over the remaining amplitude of its transient, from
/// which the dwell counts as settled. A bias of a fifth of the standard deviation lowers the coverage of a 90 %
/// interval to 89.3 %.
pub(crate) const NOISE_OVER_TRANSIENT: f64 = 5.0;

/// Change of the fundamental of the motion between the two halves of a dwell up to which the motion is steady, relative
/// to the fundamental. A transient of this size biases the parameters by less than noise of 1 % scatters them.
pub(crate) const STEADY_CHANGE: f64 = 1e-3;

/// Change of the fundamental of the motion between the two halves of a dwell up to which the motion is steady, in
/// standard deviations of the real or imaginary part of the change. Chance exceeds 4 with a probability of e^(−4²/2) =
/// 3e-4.
pub(crate) const STEADY_DEVIATIONS: f64 = 4.0;

// Fits to dwells

/// χ² per degree of freedom above which an equation of motion does not explain the dwells down to the noise. The
/// covariance of its parameters then comes from the scatter between dwells (sandwich). At 1.3 the intervals from the
/// noise are too narrow by √1.3 = 1.14, and a sandwich from 30 dwells scatters by as much, 1/√58 = 13 %: below, it
/// gains nothing. Unfounded for other numbers of dwells.
pub(crate) const LARGEST_MISFIT: f64 = 1.3;

/// Largest receptance of a point that is paired with a point on the other side of the resonance peak, relative to the
/// peak. Two points at the peak have nearly one frequency and phase, so that noise determines their damping. Unfounded.
pub(crate) const LARGEST_PAIRED_RECEPTANCE: f64 = 0.98;

/// Share of the force power below the frequency up to which the first guess of a fit to the periods of a multisine uses
/// force and motion. Above it the derivatives of the measured motion are noise. Unfounded.
pub(crate) const FORCE_BAND_SHARE: f64 = 0.99;

/// Fewest force levels at a frequency for higher-order FRF: H₁, H₃ and H₅ are three unknowns.
pub(crate) const LEAST_LEVELS: usize = 3;

/// Fewest samples in one period of a multisine whose periods are fitted by an equation of motion. Unfounded.
pub(crate) const LEAST_PERIOD_SAMPLES: usize = 16;

/// Fewest samples of a record for each term of a force law that is fitted to it by the restoring-force method.
/// Unfounded.
pub(crate) const SAMPLES_PER_TERM: usize = 20;

/// Fewest samples in a slice through a restoring-force surface; three coefficients are fitted to it. Unfounded.
pub(crate) const LEAST_SLICE_SAMPLES: usize = 12;

// Linearity

/// Deviation of the response amplitude X(F) from a straight line that curvature within one linear region of the force F
/// may cause, relative to the largest response. Unfounded.
pub(crate) const CURVATURE_SHARE: f64 = 2e-3;

/// Reduction of χ² above which the response amplitude X(F) over the force F is fitted by two lines instead of one. For
/// one parameter, chance reaches 25 with a probability of 6e-7; twice that accounts for the choice of the break between
/// the lines.
pub(crate) const REGION_EVIDENCE: f64 = 50.0;

/// Fewest measured points of a linear region of the response amplitude over the force: a line has two parameters.
/// Unfounded.
pub(crate) const LEAST_REGION_POINTS: usize = 6;

/// Difference between two neighbouring lines of the response amplitude X(F), at the force F where they meet, above
/// which the response jumps; in standard deviations of the noise of X. A normal variable exceeds six in magnitude with
/// a probability of 2e-9.
pub(crate) const JUMP_DEVIATIONS: f64 = 6.0;

/// Difference between two neighbouring lines of the response amplitude X(F), at the force F where they meet, above
/// which the response jumps; relative to X there. The curvature of a smooth response gives less between two lines.
/// Unfounded.
pub(crate) const JUMP_SHARE: f64 = 0.05;

/// Relative difference of two motion amplitudes at one frequency above which they count as two excitation levels.
/// Unfounded.
pub(crate) const DIFFERENT_LEVELS: f64 = 0.05;

/// Excess of the χ² of a linear model over its degrees of freedom up to which a structure counts as linear, in standard
/// deviations of χ². A normal variable exceeds four with a probability of 3e-5.
pub(crate) const LINEAR_DEVIATIONS: f64 = 4.0;

/// Excess of the χ² of a harmonic of the motion over its mean above which the harmonic is significant, in standard
/// deviations of χ². A normal variable exceeds five with a probability of 3e-7.
pub(crate) const HARMONIC_DEVIATIONS: f64 = 5.0;

/// Part of the amplitude of a harmonic of the force that counts as noise and not as a cause of motion, in standard
/// deviations of the force noise. A normal variable exceeds three with a probability of 0.1 %.
pub(crate) const FORCE_HARMONIC_DEVIATIONS: f64 = 3.0;

/// Range of the ratio of the change of stiffness with the excitation level to −k·(X₂/X)² at which a quadratic spring
/// causes the change; X₂/X is the second harmonic of the motion over its fundamental. Harmonic balance gives 30; half
/// of it either way allows for damping, other modes and the next order of the balance. Unfounded.
pub(crate) const QUADRATIC_STIFFNESS_RATIO: [f64; 2] = [15.0, 45.0];

/// Reduction of χ² per parameter of a describing function above which its kind of nonlinearity is named. For one
/// parameter, chance reaches 25 with a probability of 6e-7.
pub(crate) const KIND_EVIDENCE: f64 = 25.0;

/// Residual χ² of a kind of nonlinearity, relative to that of a linear structure, below which the kind explains the
/// dependence of stiffness on the level. A describing function omits higher harmonics, an error of up to a tenth of its
/// effect, which is 1 % in squares.
pub(crate) const EXPLAINED_SHARE: f64 = 0.01;

/// Smoothed power of a sweep's force, relative to its maximum, above which a frequency lies within the sweep.
/// Unfounded: −10 dB.
pub(crate) const SWEPT_POWER_SHARE: f64 = 0.1;

/// Least width of the common band of two sweeps that are compared, in distances between neighbouring independent
/// estimates of the receptance. Unfounded.
pub(crate) const LEAST_SWEEP_ESTIMATES: f64 = 10.0;

/// Misfit between the receptances of two sweeps, their mean squared difference over its variance, from which the sweeps
/// are not of one linear structure, if the difference also reaches `LEAST_SWEEP_CHANGE`. The misfit of a linear
/// structure reaches about 5, because the variances have nine degrees of freedom per line and omit the noise of the
/// force.
pub(crate) const SWEEP_MISFIT: f64 = 20.0;

/// Largest difference between the receptances of two sweeps, relative to the peak receptance, below which the
/// difference is not significant. Unfounded.
pub(crate) const LEAST_SWEEP_CHANGE: f64 = 0.005;

/// Excess over 1 of the misfit between the cross receptances H_ij and H_ji, their mean squared difference over its
/// variance, up to which a structure is reciprocal; in standard deviations of a mean of as many exponential variables
/// as there are frequencies. A normal variable exceeds five with a probability of 3e-7.
pub(crate) const RECIPROCAL_DEVIATIONS: f64 = 5.0;

/// Largest difference between the cross receptances H_ij and H_ji, relative to their peak, up to which a structure is
/// reciprocal. The position of a shaker and its direction are not more accurate. Unfounded.
pub(crate) const LEAST_RECIPROCITY_CHANGE: f64 = 0.01;

/// Ratio of the smoothed power of the motion to its noise power from which a frequency belongs to the band of a
/// restoring-force fit. Unfounded.
pub(crate) const BAND_SIGNAL_TO_NOISE: f64 = 1e3;

/// Largest number of blocks into which the equations of a free decay are divided; each block is left out once for the
/// intervals of the force law. With 10, 20 and 40 blocks the 90 % intervals of k3 held the truth in 94, 91 and 90 % of
/// 400 random decays through sensor filters.
pub(crate) const DECAY_BLOCKS: usize = 40;

/// Factors on the length of the modulating function with each of which the law of a free decay is fitted once more: the
/// scatter belongs into the interval. The two bands differ in width by a factor of two; a user may choose them as well
/// as the first.
pub(crate) const DECAY_SUPPORTS: [f64; 2] = [0.7, 1.4];

/// Smallest ratio of the amplitude of a free decay in a window to its standard deviation. The noise of a window's transform
/// is circular, so that the pole Z′/Z has no bias of second order in it; its variance grows by the part 1/8² = 1.6 %. The
/// amplitude |Z| is too large by 1/16 of its deviation, with which a 90 % interval holds the truth in 89.9 %.
pub(crate) const LEAST_DECAY_TO_NOISE: f64 = 8.0;

/// Factor by which the amplitude of a decay rises from one window to the next if the structure is excited again. Two
/// beating modes raise it by less over a third of a window, except close to a node of the beat. Unfounded.
pub(crate) const DECAY_AGAIN: f64 = 2.0;

/// Factor by which the rate of a decay has grown since its beginning if it ends within a window. A viscous decay keeps its
/// rate, with noise of at most an eighth. Unfounded.
pub(crate) const DECAY_ENDS: f64 = 1.5;

/// Fewest windows of a curve of frequency and damping over the amplitude: a smooth law of two terms leaves two degrees
/// of freedom.
pub(crate) const LEAST_CURVE_POINTS: usize = 4;

/// Standard deviation of the correction of a window's bias, as a part of the correction. The correction is that of a
/// smooth law with four terms; in decays with cubic stiffness or friction it is right to a few percent. Unfounded for
/// other laws.
pub(crate) const CURVE_BIAS_SHARE: f64 = 0.1;

/// Probability with which a linear decay stays below the F ratio from which frequency, and likewise damping, count as
/// dependent on the amplitude: of 200 linear decays, one is said to be nonlinear.
pub(crate) const FLAT_PROBABILITY: f64 = 0.9975;

/// Probability with which a decay whose frequency and damping are smooth functions of the amplitude stays below the F
/// ratio from which they count as no such function. Neighbouring windows are correlated, which the ratio leaves out;
/// the small error probability is margin for it.
pub(crate) const SMOOTH_PROBABILITY: f64 = 0.9999;

// Cutting tests

/// Fewest revolutions of full engagement in a cutting test with measured forces; the intervals of the force
/// coefficients come from the scatter between revolutions. With four, Student's quantile exceeds the normal one by a
/// factor of 1.4, with two by 3.8. Unfounded.
pub(crate) const LEAST_REVOLUTIONS: usize = 4;

/// Mean magnitude of the force in a revolution, relative to that in full engagement, above which the tool is fully
/// engaged. Unfounded.
pub(crate) const ENGAGED_SHARE: f64 = 0.9;

/// Largest length of the last Gauss–Newton step with which a fit of force coefficients that does not converge is
/// accepted, in standard deviations of the parameters. Chips at the edge of contact may change with every step. The
/// parameters then lie within 0.3 of a standard deviation of a minimum, which adds 4 % to their mean error (√(1 +
/// 0.3²)); the share is unfounded.
pub(crate) const LARGEST_LAST_STEP: f64 = 0.3;

/// Relative difference of the feeds per tooth of two cutting tests up to which they count as one feed. Unfounded.
pub(crate) const SAME_FEED: f64 = 0.02;

/// Smallest reported difference between a force coefficient from mean forces and from instantaneous forces, beyond both
/// 90 % half-widths, relative to the largest coefficient of its kind, or for edge coefficients to the force of the mean
/// feed per tooth if that is larger. Unfounded.
pub(crate) const LEAST_METHOD_DIFFERENCE: f64 = 0.05;

/// Predicted growth rate ln |μ| of a trial cut, as a multiple of the relative standard deviation of its depth, beyond
/// which its predicted outcome is certain. ln |μ| changes by about as much as the relative depth, at most by a few
/// times as much.
pub(crate) const CERTAIN_DEVIATIONS: f64 = 12.0;

/// Probability that the observed outcome of a trial cut, chatter or stable, is wrong for reasons outside the model.
/// Unfounded.
pub(crate) const MISJUDGED_SHARE: f64 = 1e-3;

/// Distance of a trial cut from the predicted stability limit, on the side that contradicts its outcome, beyond which
/// the structure misjudges it; in standard deviations of the depth. A normal variable exceeds three with a probability
/// of 0.1 %.
pub(crate) const WRONG_DEPTH_DEVIATIONS: f64 = 3.0;

/// Difference of measured and predicted chatter frequency of a trial cut, in standard deviations of the measured one,
/// beyond which the structure misjudges the cut. A normal variable exceeds four in magnitude with a probability of
/// 6e-5.
pub(crate) const WRONG_FREQUENCY_DEVIATIONS: f64 = 4.0;

/// Number of trial cuts among which the best structure of the posterior may misjudge one; with more misjudged cuts the
/// result is refused. Unfounded.
pub(crate) const CUTS_PER_MISJUDGED: usize = 20;

/// Width of the posterior 90 % interval of a modal parameter, relative to that of its prior on a logarithmic scale,
/// above which the trial cuts do not identify the parameter. At half the width of a uniform prior the cuts give one bit
/// of information.
pub(crate) const VAGUE_SHARE: f64 = 0.5;

// Robots

/// Smallest relative error of a measured receptance of a robot; also the relative standard deviation of a calibration
/// error that all its receptances have in common, and the standard deviation, in radians at the highest frequency, of a
/// common delay. The noise of the force in H1, and errors of sensors, windows and sample rates are common to all lines,
/// so that no scatter shows them. Unfounded.
pub(crate) const LEAST_RELATIVE_ERROR: f64 = 3e-3;

/// Frequency up to which a receptance of a robot counts as static in the first guess of joint stiffnesses, as a ratio r
/// to the frequency of the highest peak. The receptance of the mode of that peak differs from the static one by r²/(1 −
/// r²) = 19 % at most.
pub(crate) const NEARLY_STATIC: f64 = 0.4;

/// Smallest and largest ratio of the joint stiffness from static receptances to that of the given robot with which the
/// fit of a robot's joints starts from the former. Unfounded.
pub(crate) const GUESSED_STIFFNESS_RATIO: [f64; 2] = [0.1, 10.0];

/// Relative error of the displacement at the tool that the equivalent linearization of cubic joints predicts; it omits
/// higher harmonics. Unfounded.
pub(crate) const LINEARIZATION_ERROR: f64 = 0.1;

// Ambient tests

/// Change of the natural frequency of a mode from ambient vibration, to a higher model order, up to which the mode is
/// accepted; one of two values suffices. First value: relative change, the usual 1 % of stabilization diagrams. Second
/// value: in standard deviations, which chance exceeds in 0.3 % of cases.
pub(crate) const SAME_MODE: (f64, f64) = (0.01, 3.0);

/// Smallest and largest number of blocks into which an ambient record is divided. The smallest number gives the
/// covariance of the modes eleven degrees of freedom. Unfounded.
pub(crate) const AMBIENT_BLOCKS: [usize; 2] = [12, 40];

/// Largest damping ratio of a mode from ambient vibration: a pole that decays faster describes the spectrum of the
/// excitation. Unfounded.
pub(crate) const LARGEST_AMBIENT_DAMPING: f64 = 0.3;

// Test plans

/// Largest number of tests in a plan of experiments. Unfounded.
pub(crate) const MOST_TESTS: usize = 30;

/// Smallest reduction, by one more test of a plan, of the excess of the intervals of stability limits over the wanted
/// width, relative to that excess. `MOST_TESTS` tests with less reduce it by less than 3 % together.
pub(crate) const LEAST_GAIN: f64 = 1e-3;

/// Distance of a stability lobe above the lowest lobe at a speed, in standard deviations of the difference of their
/// depths, beyond which it is never the lowest: the probability is 3e-5.
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
