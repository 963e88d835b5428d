//! Thresholds by which the command decides, each with the source of its number.
//!
//! A number without a derivation or a campaign behind it is marked "Unfounded". Sizes of pictures, bounds of options
//! and waiting times decide nothing about a machine and stay beside the code that uses them.

// Frequency response functions

/// Largest relative error of the peak of a measured FRF from folding (aliasing of content above half the sample rate)
/// up to which `frf` answers; above, `frf` refuses the recordings. The limiting depth is inversely proportional to the
/// receptance, so that the depth errs by about ten per cent at this bound. Unfounded.
pub(crate) const LARGEST_FOLDING: f64 = 0.1;

/// Relative error of a line of a measured FRF from folding at which the line counts as noise where its coherence is not
/// known. A response of white noise has 0.4: its level at half the sample rate is that at the line. At half of this
/// error the response at the line is twice as large as at half the sample rate. A choice.
pub(crate) const FOLDING_OF_NOISE: f64 = 0.2;

/// Relative error of the peak of a measured FRF from folding (aliasing of content above half the sample rate) above
/// which `frf` warns. Sensors of the usual class of 1 % err as much. The stated interval of the peak includes the error
/// from folding, however small.
pub(crate) const SMALL_FOLDING: f64 = 0.01;

/// Ratio of the higher to the lower of two frequencies, of a peak before and a peak after a change of the tool, below
/// which the two may be the same peak. An overhang that is longer by a third lowers the frequency of a beam by a factor
/// of 1.8; only smaller changes are compared. Unfounded.
pub(crate) const SAME_PEAK: f64 = 1.2;

/// Least coherence at which the force counts as the cause of the response at a line: noise in the response then has at
/// most a quarter of the energy of the response to the force. With three averages the coherence of unrelated signals
/// exceeds it with a probability of 0.2² at one line, and of 6·10⁻⁴ at three or more of five neighbouring lines.
pub(crate) const RELATED_COHERENCE: f64 = 0.8;

// Identification

/// Time in s over which a tachometer without pulse means that the spindle stood still: it ran at less than 60 rev/min then. Effects of
/// rotation on modes grow with the speed or its square, and at 60 rev/min are a hundredth of those at 6000 rev/min at most.
pub(crate) const STANDSTILL_S: f64 = 1.0;

/// Relative difference of spindle speeds up to which recordings belong to the same speed, and of revolutions up to which the speed of
/// a recording is constant. Drives hold their speed to about this value under load. Unfounded.
pub(crate) const SAME_SPINDLE_SPEED: f64 = 0.02;

/// Relative difference of two frequencies up to which they belong to the same step of a step-sine test. Unfounded.
pub(crate) const SAME_FREQUENCY: f64 = 1e-3;

/// Relative difference of two force amplitudes below which they belong to the same level of a test. Force control of a
/// shaker keeps a level within 5 %, and levels of a test differ by more. Unfounded.
pub(crate) const SAME_LEVEL: f64 = 0.05;

/// Ratio of two force amplitudes above which they are different levels of a test, so that cubic terms of joints are
/// fitted. Unfounded.
pub(crate) const DIFFERENT_LEVELS: f64 = 1.2;

/// Difference of every joint angle below which two recordings are at the same posture, degrees. Postures stand in
/// sidecars as they were commanded, so that only their rounding differs.
pub(crate) const SAME_POSTURE_DEG: f64 = 1e-3;

/// χ² per degree of freedom of the receptances of a robot above which the user is warned that the model of its joints
/// does not explain them: the residual is twice the stated error. Unfounded.
pub(crate) const LARGEST_JOINT_MISFIT: f64 = 4.0;

/// Largest prediction error of a nonlinear model that is fitted to higher-order FRFs: (factor, offset). The user is
/// warned of a bias if the prediction error (NRMSE) of the steady responses exceeds factor × that of the
/// harmonic-balance fit to the same responses + offset. Noise alone makes the two errors about equal. Unfounded.
pub(crate) const BIASED_PREDICTION: (f64, f64) = (2.0, 1e-3);

// Stability

/// Interpolation error between the frequency lines of an FRF table, relative to the highest peak of the table, above
/// which the user is warned of a coarse frequency resolution. Unfounded.
pub(crate) const COARSE_TABLE: f64 = 0.01;

/// Largest relative change of a stability limit over all spindle speeds, by the extension of a case, below which the
/// report states that no limit changes. Floquet multipliers μ are accurate to 1e-7, and ln |μ| changes by about as much
/// as ln of the depth, so that limits are accurate to about 1e-7; the threshold is ten times that.
pub(crate) const UNCHANGED_LIMIT: f64 = 1e-6;

/// Share of the smaller of two depths by which they must differ for a tried cut to contradict a stability limit: the
/// depth of a cut with chatter and the larger lower end of the limit's interval, or the depth of a stable cut and the
/// smaller upper end. The interval follows from the standard deviations of the case, which need not contain the scatter
/// of cutting coefficients between batches of a material. Unfounded.
pub(crate) const CONTRADICTED_BEYOND: f64 = 0.1;

/// Probability that chance alone makes as many tried cuts contradict the limits, below which the limits count as
/// contradicted: the usual level of significance of a test. Of five cuts at least two must contradict the limits, of
/// ten at least three.
pub(crate) const CONTRADICTION_BY_CHANCE: f64 = 0.05;

// Reports

/// Relative change of the advised spindle speed up to which the speed counts as unchanged in the output of `replay` and
/// `monitor`. The tooth-passing rule follows every small change of the estimated chatter frequency. Unfounded.
pub(crate) const SAME_SPEED: f64 = 0.01;

/// Ratio of the largest to the smallest vibration amplitude in the recordings from which on the report of a diagnosis
/// draws the stiffness and damping that the case lacks over the amplitude. Unfounded.
pub(crate) const AMPLITUDE_RATIO: f64 = 1.2;

/// Range of plausible static stiffnesses at the tool, N/m; outside, `lobes` warns of a wrong unit or scale. Slender
/// tools and compliant robots have 10⁵ and more, the stiffest spindles some 10⁸; a decade or more on both sides is a
/// choice.
pub(crate) const PLAUSIBLE_STIFFNESS: [f64; 2] = [1e4, 1e10];

/// Smallest plausible dynamic stiffness at a resonance of the tool, N/m; below it, `lobes` warns of a wrong unit or
/// scale. A static stiffness of 10⁵ N/m with a damping ratio of 1 % gives twice this dynamic stiffness.
pub(crate) const LEAST_DYNAMIC_STIFFNESS: f64 = 1e3;
