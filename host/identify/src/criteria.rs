//! Every threshold by which this crate decides, each with the source of its number.
//!
//! A number without a derivation or a campaign behind it is marked "Unfounded". Step sizes, grids and limits of iterations decide nothing
//! about a record and stay beside the code that uses them.

// Modes from receptances

/// Fewest lines of a band. Unfounded.
pub(crate) const LEAST_LINES: usize = 16;

/// Least standard deviation of a receptance over its root mean square. No sensor measures better: −100 dB.
pub(crate) const LEAST_RELATIVE_DEVIATION: f64 = 1e-5;

/// Damping ratio from which a pole is no mode. It has no resonance peak above its static compliance beyond 1/√2; half is taken,
/// because a curve that bends so slowly is the residual of modes outside the band. Unfounded between 0.3 and 0.7.
pub(crate) const OVERDAMPED: f64 = 0.5;

/// Norm of the residue of a mode over its standard deviation below which the mode is rejected: 0.3 % of pure noise exceeds it.
pub(crate) const LEAST_RESIDUE_SIGNIFICANCE: f64 = 3.0;

/// Residual of the fit over the receptances above which a warning says that the model does not fit. Unfounded.
pub(crate) const LARGEST_FIT_ERROR: f64 = 0.1;

/// Fewest lines within the half-power bandwidth 2ζf of a mode. With fewer its damping is extrapolated from the flanks, not measured.
pub(crate) const LINES_PER_HALF_POWER_WIDTH: f64 = 3.0;

/// Relative change of the natural frequency from order to order up to which a pole is stable: 1 %, the usual value of stabilization
/// diagrams.
pub(crate) const SAME_FREQUENCY: f64 = 0.01;

/// Relative change of the damping ratio up to which a pole is stable. Usual values are 5 to 10 %.
pub(crate) const SAME_DAMPING: f64 = 0.1;

/// Least modal assurance criterion between the residues of a pole and those of the order before: the usual 0.95.
pub(crate) const SAME_SHAPE: f64 = 0.95;

/// Share of all orders over which a pole must be stable in a row to be a mode. Unfounded.
pub(crate) const ORDERS_SHARE: f64 = 0.25;

/// Fewest orders in a row over which a pole must be stable. Unfounded.
pub(crate) const LEAST_ORDERS: usize = 4;

/// Peak height of a stable pole over that of the strongest, below which it is no mode. Unfounded.
pub(crate) const LEAST_HEIGHT: f64 = 3e-3;

// Modes from whole records

/// Most lines of all records: a fit of more takes minutes on one core.
pub(crate) const MOST_RECORD_LINES: usize = 200_000;

/// Fewest lines of a record, as of a band of receptances.
pub(crate) const LEAST_RECORD_LINES: usize = 16;

/// Least noise of a channel over its root mean square. No sensor measures better: −100 dB.
pub(crate) const LEAST_RELATIVE_NOISE: f64 = 1e-5;

// Dwells

/// Fewest periods of a dwell. Unfounded.
pub(crate) const LEAST_DWELL_PERIODS: f64 = 10.0;

/// Relative change of the fundamental between the halves of a dwell up to which the motion is steady: a transient of this size moves
/// parameters by less than 1 % of noise does.
pub(crate) const STEADY_CHANGE: f64 = 1e-3;

/// Change of the fundamental between the halves of a dwell, in standard deviations, up to which the motion is steady: chance exceeds
/// 4 once in ten thousand dwells.
pub(crate) const STEADY_DEVIATIONS: f64 = 4.0;

// Linearity

/// Fall of the weighted sum of squares above which a receptance over force is two lines instead of one. Chance reaches 25 in 6e-7 of
/// cases; twice that pays for the choice of the break.
pub(crate) const REGION_EVIDENCE: f64 = 50.0;

/// Fewest points of a region: a line has two parameters. Unfounded.
pub(crate) const LEAST_REGION_POINTS: usize = 6;

/// Fall of the sum of squares per parameter above which a kind of nonlinearity is named. Chance reaches 25 in 6e-7 of cases.
pub(crate) const KIND_EVIDENCE: f64 = 25.0;

/// Share of the dependence on the level below which a kind explains it: a describing function omits higher harmonics, an error of up
/// to a tenth of its effect, 1 % in squares.
pub(crate) const EXPLAINED_SHARE: f64 = 0.01;

/// Misfit above which two sweeps are not of one linear structure. That of a linear one scatters to about 5, because its variances
/// have nine degrees of freedom per line and omit the noise of the force.
pub(crate) const SWEEP_MISFIT: f64 = 20.0;

/// Difference of two sweeps over the peak, below which it is not significant. Unfounded.
pub(crate) const LEAST_SWEEP_CHANGE: f64 = 0.005;

/// Least ratio of signal to noise, in power, for a frequency to belong to the band. Unfounded.
pub(crate) const BAND_SIGNAL_TO_NOISE: f64 = 1e3;

// Cutting tests

/// Fewest revolutions of full engagement: intervals come from the scatter between revolutions. Unfounded.
pub(crate) const LEAST_REVOLUTIONS: usize = 4;

/// Force of a revolution over that of full engagement above which the tool is engaged. Unfounded.
pub(crate) const ENGAGED_SHARE: f64 = 0.9;

/// Relative difference of two feeds per tooth below which they count as one feed. Unfounded.
pub(crate) const SAME_FEED: f64 = 0.02;

/// Distance of a trial cut from the limit, in errors of depth, beyond which its verdict is certain: ln |μ| changes by about the
/// relative change of depth, at most by a few times as much.
pub(crate) const CERTAIN_DEVIATIONS: f64 = 12.0;

/// Share of trial cuts whose verdict is wrong for reasons outside the model. Unfounded.
pub(crate) const MISJUDGED_SHARE: f64 = 1e-3;

// Robots

/// Least relative error of a receptance of a robot: noise of the force in H1, sensors, windows and sample rates are common to all
/// lines, and no scatter shows them. Unfounded.
pub(crate) const LEAST_RELATIVE_ERROR: f64 = 3e-3;

/// Frequency over that of the highest peak below which a receptance is taken as static for the first guess: the error of the
/// receptance of that mode is r²/(1 − r²) = 19 % at most.
pub(crate) const NEARLY_STATIC: f64 = 0.4;

/// Relative error of the equivalent linearization, which omits higher harmonics. Unfounded.
pub(crate) const LINEARIZATION_ERROR: f64 = 0.1;

// Ambient tests

/// Change of a mode from order to order up to which it is stable: relative, and in standard deviations. Unfounded.
pub(crate) const SAME_MODE: (f64, f64) = (0.01, 3.0);

/// Largest damping ratio of a mode from ambient vibration: a pole that decays faster describes the spectrum of the excitation.
/// Unfounded.
pub(crate) const LARGEST_AMBIENT_DAMPING: f64 = 0.3;

// Test plans

/// Most tests of a plan: more than anyone does. Unfounded.
pub(crate) const MOST_TESTS: usize = 30;

/// Share of the excess width that a test must take away to be worth it. Unfounded.
pub(crate) const LEAST_GAIN: f64 = 1e-3;

/// Distance of a lobe above the lowest, in standard deviations of the difference, beyond which it is never the lowest: the
/// probability is 3e-5.
pub(crate) const NEVER_LOWEST: f64 = 4.0;
