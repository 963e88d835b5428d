//! Thresholds by which this crate decides: which Floquet multipliers (characteristic multipliers) are
//! followed, when a limit is accepted, which error is stated.
//!
//! The comment of each states where the number comes from. "Unfounded" marks a number that rests on experience with the
//! cases of `tests/cases` alone. Tolerances of pure numerics (the last step of Newton's method, rounding, sizes of
//! matrices) stand where they are used.

/// Least stated error of a Floquet multiplier, relative to max(1, |μ|), and of a limit from receptances or forced
/// orbits, relative to its depth; methods that step through the period state at least 1e-9 instead. Independent
/// computations confirm multipliers to this accuracy (`tests/multipliers.rs`: references good to 2e-8). Collocation
/// itself settles at 1e-10 and below.
pub const LEAST_ERROR: f64 = 1e-7;

/// Least stated error of a Floquet multiplier from the collocated map over a tooth period that Newton's method on the
/// characteristic matrix did not confirm, relative to max(1, |μ|). It is ten times the residual up to which block
/// Arnoldi accepts an eigenvalue as a starting value of Newton's method, 1e-7.
pub(crate) const UNCONFIRMED: f64 = 1e-6;

/// Factor in the stated error of a Floquet multiplier on its change from the working to the finer mesh of the period.
/// The change is the error of the working mesh, since the finer mesh errs by far less; the factor is a safety margin.
/// `tests/random.rs` checks on random machines that the stated errors hold.
pub(crate) const MESH_ROOM: f64 = 10.0;

/// Factor in the stated error of a Floquet multiplier on the error from Richardson extrapolation, for a method with a
/// known order in its time step. The order holds for small steps only; the factor is a safety margin.
/// `tests/agreement.rs` checks on all cases that the stated errors hold.
pub(crate) const STEP_ROOM: f64 = 3.0;

/// Rounding error, relative to max(1, |μ|), of a Floquet multiplier from the map over a period of some hundred time
/// steps. Unfounded: an estimate.
pub(crate) const STEP_ROUNDING: f64 = 1e-9;

// Multipliers of a period map.

/// Least |μ| of the Floquet multipliers that collocation computes at each depth of a scan, unless [`SCANNED_SHARE`] of
/// the largest is less and takes its place. It lies below [`LINE_FOLLOWED`], above which the scan follows multipliers;
/// the margin between the two is unfounded.
pub(crate) const SCANNED: f64 = 0.25;

/// Least |μ|, as a share of the largest, of the multipliers that collocation computes at a depth where this share lies
/// below [`SCANNED`]. It lies below [`CELL_FOLLOWED`], above which cell charts follow multipliers; the margin between
/// the two is unfounded.
pub(crate) const SCANNED_SHARE: f64 = 0.3;

/// Least |μ| of the multipliers that a method with an explicit period map computes. It lies below [`LINE_FOLLOWED`],
/// above which the scan follows multipliers; the margin between the two is unfounded.
pub(crate) const MAPPED: f64 = 0.25;

/// Least |μ| of the eigenvalues of a period map that are computed when the dominant one is wanted: the value of
/// [`MAPPED`]. If none is larger, those above half the largest are computed.
pub(crate) const KRYLOV_ANY: f64 = 0.25;

/// Largest number of eigenvalues that are candidates for the dominant one: of the collocated map over a tooth period if
/// block Arnoldi computes them, of other maps if none exceeds [`KRYLOV_ANY`]. More than that many of nearly one size
/// are the cluster near zero of a compact period map. Unfounded.
pub(crate) const CROWD: usize = 24;

/// Least |μ| of the largest Floquet multiplier at which multipliers are taken from the transition matrix Φ(w) alone,
/// which omits the surface of the preceding tooth. That surface acts with the factor 1/μ, so that the relative error of
/// the eigenvalue of Φ(w) is about 1e-6. Newton's method starts from that eigenvalue.
pub(crate) const GROWN: f64 = 1e6;

/// Largest entry of a period map, or of its projection on a Krylov space, relative to max(1, |μ|) of its largest
/// eigenvalue, at which the eigenvalues are trusted. Rounding of the map is then at most 1e-9 of the same base; the
/// condition number of the eigenvalue multiplies it. Maps with larger entries are so far from normal that rounding may
/// move their eigenvalues, and a winding number is used. The value is unfounded.
pub(crate) const NORMAL: f64 = 1e7;

/// Largest number of elements in a tooth period on the working mesh. The fastest motion turns by five radians in an
/// element, so that 4000 elements cover three thousand vibrations; cuts that need more are refused. Unfounded.
pub(crate) const ELEMENTS_MAX: f64 = 4000.0;

/// Share of the largest depth of a scan up to which the first mesh of the period is valid. Each further mesh is valid
/// to at least twice the depth of the one before, or to the largest depth. The share is chosen for computing time,
/// since every mesh resolves the depths it is built for; its value is unfounded.
pub(crate) const FIRST_MESH_SHARE: f64 = 0.125;

/// Largest number of instants in a revolution at which the displacement may have a kink: entries and exits of teeth,
/// and their echoes one or more delays later. A generation of echoes that would exceed it is left out, with all later
/// ones. The subintervals between these instants are then short, and later echoes are smooth. Unfounded.
pub(crate) const KINKS_MAX: usize = 300;

// Dominant multiplier of one cut.

/// Least |μ| of a Floquet multiplier on one mesh of the tooth period, as a share of the largest on that mesh, at which
/// it may be the largest on another mesh. The coarse mesh of the scan errs by 1e-8 where it converges; the margin of a
/// tenth is unfounded.
pub(crate) const RIVAL: f64 = 0.9;

/// Largest |1 − 1/μ| at which Newton's method on the characteristic matrix computes a multiplier, hence |μ| above about
/// a twentieth; smaller ones are taken from the period map. Unfounded; the random machines of `tests/random.rs` are
/// right with it.
pub(crate) const KAPPA_MAX: f64 = 20.0;

/// Least |μ| of a multiplier that the search by winding number looks for. The complex depth w (1 − 1/μ) is then at most
/// five times the axial depth w, for which the mesh of the search is built.
pub(crate) const WOUND: f64 = 0.25;

/// Radii of the circles in the plane of μ on which the winding number of the characteristic function is computed in
/// turn, as relative distances beyond the largest |μ| found (or beyond [`WOUND`] if none is): a count of zero shows
/// that no multiplier lies beyond the radius. The distance of the smallest radius with a count of zero enters the
/// stated error; the sequence is unfounded.
pub(crate) const MARGINS: [f64; 5] = [2.8, 0.3, 0.05, 0.01, 2e-3];

/// Relative distances beyond the largest |μ| found that follow [`MARGINS`]. They are used while the smallest radius
/// with a count of zero is 1 or more and that |μ| is 1 or less, so that the verdict on the cut is open. Unfounded.
pub(crate) const FINE_MARGINS: [f64; 2] = [4e-4, 1e-4];

/// Convergence of a winding number, which is the mean of a logarithmic derivative over points on a circle. The number
/// of points is doubled until the last three means, latest first, differ from one integer by less than these three
/// values. Each doubling squares the error once the points resolve the nearest zero: 0.4 becomes 0.16, and that 0.03.
pub(crate) const WINDING_ERRORS: [f64; 3] = [0.02, 0.1, 0.4];

// Limits along the depth.

/// Least number of steps in axial depth at which a line of a chart, one spindle speed, is sampled: limits of random machines
/// then agree with verdicts at eight depths of each line (`tests/multipliers.rs`).
pub(crate) const CHART_SAMPLES_MIN: usize = 40;

/// Largest number of halvings of a depth interval in which multipliers cannot be followed: 6e-6 of the depth range. A crossing
/// is then found by bisection on the number of multipliers outside the unit circle. Unfounded.
pub(crate) const LINE_LEVELS: u32 = 14;

/// Least |μ|, at an end of a depth interval, of a multiplier that must not be lost between the ends: if it has no
/// partner at the other end and may reach the unit circle, the interval is halved. Whatever their size, the crossings
/// found must also explain the change in the number of multipliers outside the unit circle between the ends. Unfounded.
pub(crate) const LINE_FOLLOWED: f64 = 0.3;

/// Distance of |μ| from 1 within which Newton's method corrects a multiplier of the scan over the depth before it
/// counts as inside or outside the unit circle. It is 1e5 times the error of the scan in each element of its mesh,
/// 1e-8.
pub(crate) const LINE_POLISHED: f64 = 1e-3;

/// Largest distance, half way between two sampled depths, between the tangents to a Floquet multiplier's path in the
/// complex plane from both depths, as a share of the distance that the multiplier travels between them; 1e-6 is added.
/// A pair with a larger distance is taken as two different multipliers. Unfounded.
pub(crate) const TANGENT_MISS: f64 = 0.25;

/// As [`TANGENT_MISS`], for the path of ln μ along a line. Newton's method half way confirms each pair that may reach
/// the unit circle. Unfounded; `tests/scan.rs` checks the switches of random machines.
pub(crate) const PATH_MISS: f64 = 0.25;

/// Largest error in ln μ, half way between two sampled depths, of the cubic by which a multiplier is followed along the
/// depth. An error up to this size is corrected by a quartic; a larger one halves the depth interval. Unfounded;
/// `tests/scan.rs` checks the switches of random machines.
pub(crate) const PATH_TOLERANCE: f64 = 5e-3;

/// Safety factor on |d(ln μ)/dw| × (step in depth), the linear estimate of the move of ln μ. A multiplier may reach the
/// unit circle within the step if |ln|μ|| is less than this factor times that move, plus [`REACH_LEAST`]. Unfounded.
pub(crate) const REACH_FACTOR: f64 = 3.0;

/// Distance of ln|μ| from 0 within which a multiplier may reach the unit circle, however small its derivative dμ/dw.
/// Unfounded.
pub(crate) const REACH_LEAST: f64 = 0.02;

/// Where ln|μ| comes nearest to 0 between two sampled depths without a change of sign, the share of its second
/// difference over sixteenths of the depth interval by which it must stay away from 0, beside the error of the cubic.
/// If it comes nearer, the multiplier may touch the unit circle, and the depth interval is halved. At an end of the
/// interval the share is one of the initial change of ln|μ| over a sixteenth. A parabola needs an eighth, at an end a
/// quarter. Unfounded.
pub(crate) const TOUCHING: f64 = 0.5;

// Charts between the requested speeds.

/// Largest error of a limit on the straight line between two speeds of a chart, relative to the depth of the limit: the
/// 1 % that a chart states.
pub(crate) const CHART_DEPTH: f64 = 0.01;

/// Largest gap between two speeds of a chart, relative to the speed, that is never divided, and the accepted relative
/// error in speed of a steep limit: 0.1 %, the accuracy to which a spindle holds its speed.
pub(crate) const CHART_SPEED: f64 = 1e-3;

/// Least number of lines of a chart, that is spindle speeds, per lobe. A lobe is the distance in speed over which the
/// number of vibrations in a tooth period changes by one, and the Floquet multiplier turns once about 0. Three lines
/// then lie in each quarter of that turn, so that the parabola through them bends as the limit does.
/// `tests/between_speeds.rs` checks nearly three thousand random points of random machines.
pub(crate) const LINES_OF_LOBE: f64 = 12.0;

/// Least change of the chatter frequency between two lines, in vibrations in a tooth period, from one lobe to another. A
/// choice: half of that between two of [`LINES_OF_LOBE`] lines.
pub(crate) const ONE_LOBE: f64 = 0.5 / LINES_OF_LOBE;

/// Estimated error of a line over a curve by that of a parabola. A choice; `tests/between_speeds.rs` tries it.
pub(crate) const PARABOLA_MARGIN: f64 = 1.25;

/// Largest gap between two speeds of a refined chart, relative to the speed. A region of stability or of chatter that
/// is wider appears in some line; a narrower one may not. Unfounded: a region of 2 % in speed and 5 % in depth is a
/// thousandth of a chart over a factor of 2.7 in speed, hence contains one of a thousand random points.
pub(crate) const CHART_GAP: f64 = 0.02;

/// Relative gap between two speeds down to which it is halved next to a line that shows a tongue of instability: half
/// of the half-power width 2ζ of a resonance with the damping ratio ζ = 0.5 % of a machine tool.
pub(crate) const TONGUE_GAP: f64 = 0.005;

/// Largest number of lines that are added to a chart: an hour at a second per line, as cubic terms may need. Gaps that
/// remain are listed in the chart. Unfounded.
pub(crate) const CHART_LINES_MAX: usize = 4000;

// Cell charts.

/// Error of the cubic in depth that interpolates a multiplier between two sampled depths, relative to the smaller of
/// the dominant |μ| at both, up to which the cells between them are interpolated: half of the 1e-4 that a cell may
/// have.
pub(crate) const CELL_TOLERANCE: f64 = 5e-5;

/// Error of the cubic in depth, relative to the smaller of the dominant |μ| at both depths, up to which cells are
/// interpolated if that |μ| is above [`CELL_FAR`]: of these only the verdict "unstable" matters. With an error of 0.5 %
/// such a multiplier is still larger than 2.
pub(crate) const CELL_TOLERANCE_FAR: f64 = 5e-3;

/// Least |μ| of the dominant multiplier at both ends of a depth interval at which the cells in it may have the error of
/// [`CELL_TOLERANCE_FAR`]. They are then unstable by more than a hundred times that error.
pub(crate) const CELL_FAR: f64 = 2.1;

/// Least |μ|, as a share of the largest, of the multipliers that are followed between two sampled depths of a cell
/// chart. Unfounded; `tests/cells.rs` compares whole charts with single points.
pub(crate) const CELL_FOLLOWED: f64 = 0.4;

// Spread of limits.

/// Number of machines in a batch that are drawn at random from the standard deviations of the case: a power of 2, as
/// stratification requires. The choice of 64 is unfounded.
pub(crate) const BATCH: u32 = 64;

/// Least and largest number of batches of randomly drawn machines. Four batches give an estimate of their scatter; 128
/// are 8 192 machines, a limit on computing time.
pub(crate) const BATCHES: std::ops::RangeInclusive<u32> = 4..=128;

/// Number of pilot batches, after which the directions of stratification are computed anew from the machines drawn: the
/// least of [`BATCHES`].
pub(crate) const PILOT: u32 = 4;

/// Largest half width of the 90 % confidence interval of a percentile of the limiting depth, relative to the
/// percentile, at which no further batch of machines is drawn. Unfounded: percentiles accurate to 1 % are the aim.
pub(crate) const PERCENTILE_SETTLED: f64 = 7e-3;

/// Largest share of drawn machines that are not valid (for example with negative damping or indefinite matrices);
/// beyond it the standard deviations of the case are refused. Unfounded.
pub(crate) const IMPOSSIBLE_MAX: f64 = 0.2;

/// Depth down to which the limit of a drawn machine is searched first, as a multiple of the limit predicted from
/// derivatives. A machine whose limit lies deeper is searched over the whole depth. Unfounded.
pub(crate) const SEARCHED_BEYOND: f64 = 1.2;

/// Least predicted limit of a drawn machine in the first search, as a share of the nominal limit. Unfounded.
pub(crate) const SHALLOWEST_SEARCH: f64 = 0.25;

/// Depth of the first search for a drawn machine's limit, as a share of the whole depth, from which on the whole depth
/// is searched at once. Unfounded.
pub(crate) const WORTH_SEARCHING_NEAR: f64 = 0.7;

/// Values of a single uncertain variable, in standard deviations, between which machines are computed and their limits
/// interpolated: 0.3 % of the machines lie beyond; they count as the last ones.
pub(crate) const ALONG_END: f64 = 3.0;

/// Distance of the machines that are computed first along a single uncertain variable, standard deviations; each gap is
/// halved at least once. An island of stability or chatter that exists only within half this distance may be missed: at
/// most 20 % of the machines. Unfounded.
pub(crate) const ALONG_STEP: f64 = 1.0;

/// Largest difference of a limit in the middle of a gap between two machines from the interpolated one, relative to the
/// limit, at which the gap is not divided further. It is the accuracy of percentiles,
/// [`PERCENTILE_SETTLED`], less their interpolation. Unfounded.
pub(crate) const ALONG_MISS: f64 = 5e-3;

/// Width of a gap between two machines along a single uncertain variable, standard deviations, that is not divided
/// further: 0.8 % of the machines at most.
pub(crate) const ALONG_GAP: f64 = 0.02;

/// Least number of batches of 64 machines for the probability that a cell is stable: 256 machines, whose share has a
/// standard error of √(0.25/256) = 3 % at most.
pub(crate) const BATCHES_OF_CELLS: u32 = 4;

// Loops of receptances.

/// Largest deviation of a structure that is fitted to a table of receptances, as a share of the largest entry, at which
/// limits are those of the fitted structure; else they follow from the table by harmonics. The error of each limit
/// contains the deviation to first order; at 5 % of a peak the second order is a few thousandths. Unfounded.
pub(crate) const FIT_ERROR_MAX: f64 = 0.05;

/// Deviation of a fitted structure, as above, below which no further mode is fitted: below the noise of measurements
/// and the digits of usual tables. Unfounded.
pub(crate) const FIT_SETTLED: f64 = 1e-6;

/// Least decrease of the deviation by which a further fitted mode is accepted. Modes that fit noise decrease it by
/// some percent. Unfounded.
pub(crate) const FIT_IMPROVEMENT: f64 = 0.3;

/// Largest number of modes that are fitted within the band of a table: a limit on computing time. Unfounded.
pub(crate) const FIT_MODES_MAX: usize = 12;

/// Largest number of lines from which the poles of a fitted structure are computed, a limit on computing time; the
/// residues and the deviation use all lines. Unfounded.
pub(crate) const FIT_LINES_MAX: usize = 1000;

/// Least size of an entry of the receptance matrix, as a share of the largest one, from which on it determines the
/// poles of a fitted structure. Unfounded.
pub(crate) const FIT_PART: f64 = 0.02;

/// Least half bandwidth of a fitted pole, as a share of the distance of the lines there: narrower poles are not
/// resolved. Unfounded.
pub(crate) const FIT_WIDTH_MIN: f64 = 0.5;

/// Factor in the stated error of a limit on its change, to first order, by the deviation of a fitted structure from the
/// table. It leaves room for the second order and for the direct solution's own interpolation. Unfounded.
pub(crate) const FIT_ROOM: f64 = 2.0;

/// Least norm of the receptance matrix at a peak of a table of receptances, as a share of its largest norm in the
/// table, at which the peak counts as a resonance and the frequency grid is refined about it. A peak of noise costs
/// computing time only. Unfounded.
pub(crate) const PEAK_SHARE: f64 = 0.01;

/// Damping ratio of a mode up to which, negative ones included, its receptance counts as infinite, so that methods from
/// receptances refuse the case. Unfounded.
pub(crate) const UNDAMPED: f64 = 1e-9;

/// Relative difference in depth up to which limits of two computations count as the same limit. The computations differ
/// in the lines of the receptance table or in the number of harmonics, and the stated error of the limit follows from
/// the difference. Unfounded.
pub(crate) const SAME_LIMIT: f64 = 0.1;

/// Largest relative change of a limit by doubling the harmonics at which no more are added. Doubling divides the
/// truncation error by four or more, so that the limits with the doubled number err by a third of the change at most.
pub(crate) const HARMONICS_SETTLED_LIMIT: f64 = 1e-4;

/// Largest change of a Floquet multiplier by doubling the harmonics, relative to max(1, |μ|), at which no more are
/// added. Doubling divides the truncation error by four or more, so that the multiplier with the doubled number errs by
/// a third of the change at most.
pub(crate) const HARMONICS_SETTLED_MULTIPLIER: f64 = 1e-6;

/// Relative difference in depth up to which a limit with twice the number of harmonics counts as the same limit as one
/// with the single number. Unfounded.
pub(crate) const SAME_WITH_TWICE_HARMONICS: f64 = 0.1;

/// Distance from an end of the frequency range, relative to the frequency of that end, at which the imaginary parts of
/// characteristic loci are evaluated. At the end itself the loci are real; next to it their imaginary parts tell the
/// direction in which a root crosses. At the end ω = 0 the first grid frequency is the base. The value lies far above
/// rounding and far below the width of a resonance; it is unfounded.
pub(crate) const REAL_END_OFFSET: f64 = 1e-5;

/// Largest number of halvings of a frequency interval in which characteristic loci are not straight or cannot be told
/// apart; twice as many where a solution along a locus is sought. Unfounded.
pub(crate) const LOCUS_LEVELS: u32 = 16;

/// Largest deviation of a characteristic locus, at the middle of a frequency interval, from the straight line between
/// its values at both ends, as a share of the larger of the two; beyond it the interval is halved. Unfounded.
pub(crate) const LOCUS_BEND: f64 = 0.1;

/// Largest distance between the values of a characteristic locus at both ends of a frequency interval, as a multiple of
/// the deviation from a straight line that [`LOCUS_BEND`] allows. Unfounded.
pub(crate) const LOCUS_MOVE: f64 = 6.0;

/// Largest change of the argument of a determinant over half a frequency interval, as a share of π; a larger one halves
/// the interval. The number of revolutions is unambiguous below 1; the factor of five is unfounded.
pub(crate) const ARGUMENT_CHANGE: f64 = 0.2;

/// Largest distance of the number of half revolutions of a determinant from an integer at which unstable roots are
/// counted from it. A distance of 1/2 would be ambiguous; the margin is unfounded.
pub(crate) const HALF_REVOLUTION_ERROR: f64 = 0.2;

/// Values σ of the lines Re s = σ along which the roots s of a loop of receptances are searched, as multiples of the
/// slowest decay rate of a resonance. Unfounded.
pub(crate) const ROOT_LINES: [f64; 14] = [
    0.0, -0.3, -0.6, -0.8, -0.9, -0.97, -1.2, -2.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0,
];

/// Least absolute value of a characteristic locus, as a share of the inverse axial depth 1/w, at which the locus is
/// traced along a line Re s = σ to predict roots away from the line. Unfounded.
pub(crate) const LOCUS_REACH: f64 = 0.05;

/// Range of the real part of the position, on the chord between two frequency samples of a characteristic locus, at
/// which the chord predicts a root: 0 at the lower frequency, 1 at the higher. A chord predicts poorly far beyond its
/// ends. Unfounded.
pub(crate) const PREDICTED_BETWEEN: std::ops::RangeInclusive<f64> = -0.6..=1.6;

/// Largest distance of a predicted root s from the line Re s = σ, as a multiple of the sum of the frequency interval of
/// the prediction and the slowest decay rate of a resonance. Unfounded.
pub(crate) const PREDICTED_DISTANCE: f64 = 20.0;

/// Distance of a predicted root to the left of the rightmost root found along the same line Re s = σ, in slowest decay
/// rates of a resonance, beyond which it is not computed. The distance of that rightmost root from the line is added.
/// Unfounded.
pub(crate) const PREDICTED_LAG: f64 = 3.0;

/// Factor on [`LOCUS_BEND`] for the zeroth-order approximation. With a tenth the phase mismatch ωτ − π + 2 arg(1/λ)
/// changes monotonically between two frequency samples, except where lobes touch. Unfounded.
pub(crate) const ZOA_BEND: f64 = 0.1;

// Forced orbits.

/// Velocity jump per force at the tool, relative to the largest entries of the output and input matrices times the
/// number of states, up to which the structure counts as having a mass at the tool. It lies far above rounding; the
/// value is unfounded.
pub(crate) const VELOCITY_JUMP: f64 = 1e-6;

/// Longest step along a branch of forced orbits: the norm of the relative changes of depth and orbit, with the largest
/// depth of the branch and the norm of the linearized orbit's start at that depth as bases. Unfounded: a branch up and
/// down takes about a hundred steps.
pub(crate) const BRANCH_STEP_MAX: f64 = 1.0 / 30.0;

/// Longest step along a branch of forced orbits on which no multiplier comes near the unit circle, in the units of
/// [`BRANCH_STEP_MAX`]: see [`CIRCLE_SHARE_MAX`]. Unfounded; the limits of `tests/answers` do not depend on it.
pub(crate) const BRANCH_STEP_CLEAR: f64 = 0.1;

/// Largest move of a multiplier, as a share of its distance from the unit circle before and after, in a step longer
/// than [`BRANCH_STEP_MAX`]; else the step is repeated with that length. A multiplier that crosses the circle and
/// returns within the step would have to move by more than twice this distance and turn back. Unfounded.
pub(crate) const CIRCLE_SHARE_MAX: f64 = 0.5;

/// Length up to which a step along a branch of forced orbits is not halved further, in the units of
/// [`BRANCH_STEP_MAX`]. In steps up to twice this length each multiplier is paired with the nearest one of the next
/// orbit, at any distance, since two real multipliers that meet move infinitely fast. Unfounded.
pub(crate) const BRANCH_STEP_MIN: f64 = 1e-5;

/// Factor in the stated error on the change of an orbit's multiplier and depth from the working to the finer mesh. Nine
/// Gauss nodes converge with the power 18 of the element length, so that the change is the error of the working mesh;
/// the factor is a safety margin and unfounded.
pub(crate) const ORBIT_ROOM: f64 = 10.0;

/// Largest change of a multiplier near the unit circle, relative to max(1, |μ|), in one step along a branch of forced
/// orbits; a larger change halves the step. Unfounded.
pub(crate) const MULTIPLIER_MOVE_MAX: f64 = 0.12;

/// Size |μ| above which the Floquet multipliers of a forced orbit are kept in cases with friction, backlash or
/// hysteresis; smaller ones are dropped. Unfounded.
pub(crate) const EQUIVALENT_FOLLOWED: f64 = 0.5;

/// Least number of steps in depth at which, in cases with friction, backlash or hysteresis, the number of multipliers
/// outside the unit circle is counted. A change between two steps is a stability limit. Unfounded.
pub(crate) const EQUIVALENT_SAMPLES_MIN: usize = 32;

/// Damping constant that stands for sticking friction, in units of k/ω with the static stiffness k of the axis and the
/// frequency ω of the slowest mode. A force at ω then moves the sticking axis by a twentieth of the static deflection.
/// Unfounded.
pub(crate) const STICKING_DAMPER: f64 = 20.0;

/// RMS displacement of the orbit times this factor is the amplitude of the small disturbance from which incremental
/// stiffness and damping are computed. Unfounded: small against the orbit, large against the relative 1e-8 to which
/// hysteresis loops close.
pub(crate) const DISTURBANCE: f64 = 0.02;

/// Number of periods of the orbit over which the force of friction, backlash or hysteresis is computed for an orbit
/// with a disturbance of another frequency; the second half is averaged. Unfounded.
pub(crate) const DISTURBANCE_PERIODS: usize = 40;

// Lobe tables.

/// Largest number of layers (feeds times feed directions) that refinement gives a lobe table for one case. Directions
/// too far apart for interpolation are divided beyond it. It limits the size of a table. Unfounded.
pub(crate) const LAYERS_MAX: usize = 12;

/// Number of spindle speeds at which limits half way between two feeds, or two feed directions, are compared with the
/// mean of the limits at both, to decide on a further layer of a lobe table. Unfounded.
pub(crate) const LAYER_PROBES: usize = 16;

/// Difference between a limit and the straight line between the neighbouring entries of a lobe table, as a share of the
/// largest depth, beyond which a speed, feed or feed direction is added. Unfounded.
pub(crate) const TABLE_TOLERANCE: f64 = 0.003;

/// Least number of spindle speeds at which a lobe table is checked between two neighbouring speeds of the table. With
/// two, one lies where the error of a straight line over the gap, 4 s (1 − s) of its largest value at the fraction s of
/// the gap, is at least 85 % of that value.
pub(crate) const LEAST_CHECKS: f64 = 2.0;

/// Largest distance between the spindle speeds at which a lobe table is first checked between two of its speeds,
/// relative to the speed. Unfounded; `lobe_table/accuracy_tests.rs` holds it for tables with four speeds over a factor
/// of three.
pub(crate) const CHECK_STEP: f64 = 0.01;

/// Disagreement between lobe table and method between two speeds of the table, as a share of the table's tolerance,
/// beyond which more speeds are checked there. A smooth limit that passed refinement errs by a quarter of the tolerance
/// at most, since the gap was halved after the check; twice as much means a corner.
pub(crate) const SUSPECT: f64 = 0.5;

/// Factor by which the largest disagreement between lobe table and method in a gap must grow with a doubling of the
/// speeds checked in that gap for another doubling. [`TABLE_ROOM`] contains the same factor.
pub(crate) const CHECK_GROWTH: f64 = 1.2;

/// Factor in the stated depth error of a lobe table on its largest disagreement with the method at the checked speeds.
/// Two checks of a smooth limit see 85 % of its largest error at least, and doubling stops at a growth by 1.2
/// ([`CHECK_GROWTH`]): together 1.2/0.85 = 1.4. Held by `lobe_table/accuracy_tests.rs` at 999 of 1000 random speeds per
/// table.
pub(crate) const TABLE_ROOM: f64 = 1.5;

// Check cuts.

/// Largest factor, and reciprocal of the smallest, between the natural frequency of a mode in the case and that of the running
/// spindle. Frequencies of spindles fall by some 10 to 20 % up to their highest speed. Unfounded.
pub(crate) const LARGEST_RESCALING: f64 = 1.25;

/// Step of the logarithm of a natural frequency at which predicted and measured chatter frequency are first compared: lobes
/// narrower than 1 % of the frequency may be missed. Unfounded.
pub(crate) const RESCALING_STEP: f64 = 0.01;

/// Factor by which a second mode must move further than the first, in ln of its frequency beyond the 90 % intervals of both,
/// for a measured chatter frequency to identify the first. Unfounded.
pub(crate) const RIVAL_RESCALING: f64 = 2.0;

/// Probability of a smaller scatter of check cuts up to which the errors of their frequencies explain it: one set of 20 has more.
pub(crate) const EXPECTED_SCATTER: f64 = 0.95;
