//! Thresholds by which this crate decides: which multipliers are followed, when a limit is accepted, which error is stated.
//!
//! Each has its own sentence where the number comes from. "Unfounded" marks those that rest on experience with the cases at
//! hand alone. Tolerances of pure numerics (the last step of Newton, rounding, sizes of matrices) stand where they are used.

/// Least error of a Floquet multiplier that is ever stated, relative to max(1, |μ|): the agreement that independent computations
/// have confirmed. Collocation itself settles at 1e-10 and below.
pub const LEAST_ERROR: f64 = 1e-7;

/// Error of a multiplier that the collocated map gave and Newton did not confirm, relative to max(1, |μ|): ten times the
/// residual at which Krylov spaces settle.
pub(crate) const UNCONFIRMED: f64 = 1e-6;

/// Factor on the change of a multiplier from the working to the finer mesh in its stated error. The change is the error of the
/// working mesh itself, since the finer one errs by far less; ten is room. Held on random machines by `tests/random.rs`.
pub(crate) const MESH_ROOM: f64 = 10.0;

/// Factor on the error that Richardson extrapolation gives for a method of some order in its step. The order holds for small
/// steps only; three is room. Held on all cases by `tests/agreement.rs`.
pub(crate) const STEP_ROOM: f64 = 3.0;

// Multipliers of a period map.

/// Size of a Floquet multiplier above which the scan by collocation computes it. A crossing of the unit circle is
/// found from multipliers above [`LINE_FOLLOWED`], which lies higher; the margin itself is unfounded.
pub(crate) const SCANNED: f64 = 0.25;

/// Share of the largest multiplier above which the scan computes others where all are small. It lies below
/// [`CELL_FOLLOWED`], which uses the result; the margin is unfounded.
pub(crate) const SCANNED_SHARE: f64 = 0.3;

/// Size of a multiplier above which a method with an explicit period map computes it; below [`LINE_FOLLOWED`] as for
/// [`SCANNED`], and as unfounded in its margin.
pub(crate) const MAPPED: f64 = 0.25;

/// Size above which all eigenvalues of a period map are of interest: the value of [`MAPPED`].
pub(crate) const KRYLOV_ANY: f64 = 0.25;

/// Number of eigenvalues of nearly one size from which they count as the crowd near zero of a compact map, and not as
/// rivals for the largest. Unfounded.
pub(crate) const CROWD: usize = 24;

/// Size from which a Floquet multiplier does not depend on the surface cut before. It is then an eigenvalue of the
/// transition matrix Φ(w) to a relative error of the inverse, 1e-6, which starts Newton's method.
pub(crate) const GROWN: f64 = 1e6;

/// Largest ratio of the norm of a period map to its largest multiplier at which Krylov spaces are trusted. Their residual
/// of 1e-7 relative to the norm then lies below the multiplier; beyond it they may see rounding only.
pub(crate) const NORMAL: f64 = 1e7;

/// Largest number of elements of the working mesh in a tooth period. Elements of five radians then cover some thousand
/// vibrations; more are refused. Unfounded.
pub(crate) const ELEMENTS_MAX: f64 = 4000.0;

// Dominant multiplier of one cut.

/// Share of the largest multiplier of the coarse scan above which another may be the largest on the working mesh. The
/// scan errs by 1e-8; a tenth is room for meshes on which it does not converge, and unfounded.
pub(crate) const RIVAL: f64 = 0.9;

/// Largest |1 − 1/μ| at which Newton on the characteristic matrix is used, hence |μ| above about a twentieth; smaller
/// multipliers are taken from the map. Unfounded; the random machines of `tests/random.rs` are right with it.
pub(crate) const KAPPA_MAX: f64 = 20.0;

/// Size of a multiplier above which the winding number looks for it. The complex depth w (1 − 1/μ) is then five times
/// w at most, which the meshes resolve.
pub(crate) const WOUND: f64 = 0.25;

/// Relative distances beyond the largest multiplier found, or beyond [`WOUND`], at which the winding number shows in turn
/// that no larger one exists. The last is the error of the bound; the sequence is unfounded.
pub(crate) const MARGINS: [f64; 5] = [2.8, 0.3, 0.05, 0.01, 2e-3];

/// Further relative distances, used while the verdict is open after [`MARGINS`]. Unfounded.
pub(crate) const FINE_MARGINS: [f64; 2] = [4e-4, 1e-4];

// Limits along the depth.

/// Fewest steps in depth of a chart. With 40, lines of random machines agree with single depths
/// (`tests/multipliers.rs`, eight depths of each line).
pub(crate) const CHART_SAMPLES_MIN: usize = 40;

/// Number of halvings of an interval of depths in which multipliers cannot be followed: parts of 6e-6 of the range
/// with 40 steps. Beyond that the number outside the circle is bisected. Unfounded.
pub(crate) const LINE_LEVELS: u32 = 12;

/// Size of a multiplier above which it is followed along the depth. The number outside the circle is compared at
/// every sample, so that a smaller one that crosses between two samples is noticed; the value is unfounded.
pub(crate) const LINE_FOLLOWED: f64 = 0.3;

/// Distance of |μ| from 1 beyond which multipliers are counted and not followed. Unfounded; lines of random machines
/// agree with single depths with it (`tests/multipliers.rs`).
pub(crate) const LINE_FAR: f64 = 0.5;

/// Distance of |μ| from 1 within which a multiplier of the scan is corrected by Newton before its side of the circle
/// is decided: 1e5 times the error of the scan, 1e-8 per element.
pub(crate) const LINE_POLISHED: f64 = 1e-3;

// Cell charts.

/// Relative error of the cubic in depth below which cells are interpolated: half of the 1e-4 that a cell may have.
pub(crate) const CELL_TOLERANCE: f64 = 5e-5;

/// The same for multipliers beyond [`CELL_FAR`], of which only the verdict matters. A hundred times as much still
/// leaves |μ| > 2.
pub(crate) const CELL_TOLERANCE_FAR: f64 = 5e-3;

/// Size beyond which a multiplier only has to be known as unstable: twice the circle with the error above.
pub(crate) const CELL_FAR: f64 = 2.1;

/// Share of the largest multiplier above which others are followed between samples in depth. Unfounded;
/// `tests/cells.rs` compares whole charts with single points.
pub(crate) const CELL_FOLLOWED: f64 = 0.4;

// Spread of limits.

/// Number of drawn machines in a batch: a power of 2, as stratification requires. The choice of 64 is unfounded.
pub(crate) const BATCH: u32 = 64;

/// Least and largest number of batches. Four give an estimate of their scatter; 128 are 8 192 machines, a limit on
/// computing time.
pub(crate) const BATCHES: std::ops::RangeInclusive<u32> = 4..=128;

/// Number of batches of the pilot, after which the directions of stratification are updated: the least of [`BATCHES`].
pub(crate) const PILOT: u32 = 4;

/// Half the relative width of the 90 % interval of a percentile at which no further batch is drawn. Unfounded: an
/// accuracy of 1 % was aimed at.
pub(crate) const PERCENTILE_SETTLED: f64 = 7e-3;

/// Share of drawn machines that may be impossible (negative damping, indefinite matrices) before the deviations are
/// refused. Unfounded.
pub(crate) const IMPOSSIBLE_MAX: f64 = 0.2;

/// Batches of 64 machines for the probability of stability: 256 machines, whose standard error is √(0.25/256) = 3 %
/// at most.
pub(crate) const BATCHES_OF_CELLS: u32 = 4;

// Loops of receptances.

/// Height of a peak in a table of receptances, as a share of the highest, above which it counts as a resonance. A
/// peak of noise costs computing time only. Unfounded.
pub(crate) const PEAK_SHARE: f64 = 0.01;

/// Damping ratio below which a mode counts as undamped and its receptance as infinite. Unfounded.
pub(crate) const UNDAMPED: f64 = 1e-9;

/// Relative change up to which limits of two computations (every second line of a table, other numbers of harmonics)
/// are one limit. Unfounded.
pub(crate) const SAME_LIMIT: f64 = 0.1;

/// Largest relative change of a limit with twice the harmonics at which they suffice. The truncation error falls by
/// four or more with each doubling, so that limits with twice the harmonics are right to a third of it.
pub(crate) const HARMONICS_SETTLED_LIMIT: f64 = 1e-4;

/// The same for multipliers, with the same argument.
pub(crate) const HARMONICS_SETTLED_MULTIPLIER: f64 = 1e-6;

/// Relative change of a limit with twice the harmonics beyond which it is another limit. Unfounded.
pub(crate) const SAME_WITH_TWICE_HARMONICS: f64 = 0.1;

// Forced orbits.

/// Longest step along a branch of forced orbits, as a share of the last depth or of the orbit there. Unfounded: a
/// branch up and down takes about a hundred steps.
pub(crate) const BRANCH_STEP_MAX: f64 = 1.0 / 30.0;

/// Shortest step along a branch. Multipliers that come together within it are paired by their distance alone.
/// Unfounded.
pub(crate) const BRANCH_STEP_MIN: f64 = 1e-5;

/// Factor on the change from the working to the finer mesh of an orbit in the stated error. Nine Gauss nodes converge
/// with the power 18 of the element length, so that the change is the error itself; ten is room and unfounded.
pub(crate) const ORBIT_ROOM: f64 = 10.0;

/// Largest move of a multiplier near the circle in one step of a branch; a larger one halves the step. Unfounded.
pub(crate) const MULTIPLIER_MOVE_MAX: f64 = 0.12;

/// Size of a multiplier above which it is followed where terms that are not smooth act by their equivalents.
/// Unfounded.
pub(crate) const EQUIVALENT_FOLLOWED: f64 = 0.5;

/// Damper in units of k/ω of the slowest mode that stands for sticking friction: the tool gives way by a twentieth.
/// Unfounded.
pub(crate) const STICKING_DAMPER: f64 = 20.0;

/// Size of a small disturbance as a share of the orbit, from which incremental stiffness and damping are computed.
/// Unfounded: small against the orbit, large against the 1e-8 to which the loop of a hysteresis closes.
pub(crate) const DISTURBANCE: f64 = 0.02;

/// Periods of the orbit over which a disturbance of another frequency is averaged. Unfounded.
pub(crate) const DISTURBANCE_PERIODS: usize = 40;

// Lobe tables.

/// Largest number of layers into which one case is divided. It limits the size of a table. Unfounded.
pub(crate) const LAYERS_MAX: usize = 12;

/// Share of the largest depth by which a limit may differ from the straight line between neighbouring entries before
/// a speed is added. Unfounded.
pub(crate) const TABLE_TOLERANCE: f64 = 0.003;

/// Fewest speeds checked in a gap. One of two lies where the error of a straight line between entries, 4 s (1 − s) of
/// the largest at the share s of the gap, is at least 85 %.
pub(crate) const LEAST_CHECKS: f64 = 2.0;

/// Largest relative distance between speeds checked in a gap. Unfounded; tables with four speeds over a factor of
/// three are held by `lobe_table/accuracy_tests.rs`.
pub(crate) const CHECK_STEP: f64 = 0.01;

/// Share of the tolerance beyond which a gap is checked at more speeds. A smooth limit that passed refinement errs by
/// a quarter of the tolerance at most, since the gap was halved after the check; twice that means a corner.
pub(crate) const SUSPECT: f64 = 0.5;

/// Factor by which the worst of a gap must grow for another doubling of its speeds. The room of [`TABLE_ROOM`] covers
/// as much.
pub(crate) const CHECK_GROWTH: f64 = 1.2;

/// Factor of the stated depth on the worst at the speeds checked: 1/0.85 for two checks of a smooth limit, times 1.2
/// for doubling that stops ([`CHECK_GROWTH`]), is 1.4. Held by `lobe_table/accuracy_tests.rs` at 1000 random speeds
/// per table.
pub(crate) const TABLE_ROOM: f64 = 1.5;
