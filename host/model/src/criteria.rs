//! Thresholds by which this crate decides, each with the source of its number.
//!
//! A number without a derivation or a campaign behind it is marked "Unfounded" or "a choice". Bounds of the values of a
//! case that are physical, such as a damping ratio below 1, stand in the code that reads the case.

/// Largest entry of C B, for modes the sum of their residues, relative to n·max|C|·max|B| with n states, above which
/// the velocity of the tool jumps with the force. C B is zero if the structure has a mass matrix. Mode shapes with
/// seven digits in the case file leave up to this much: two factors with an error of 5e-7 in each of n products.
pub(crate) const VELOCITY_JUMP: f64 = 1e-6;

/// Magnitude of an eigenvalue of a mass, damping or stiffness matrix with its positive diagonal entries scaled to 1,
/// relative to the largest magnitude, up to which it counts as zero, as for a free body. Matrix entries with ten digits
/// shift an eigenvalue by 5e-10 per degree of freedom; the number allows for two.
pub(crate) const ZERO_EIGENVALUE: f64 = 1e-9;

/// Ratio of two limits above which a sentence about assumptions says "far deeper" instead of the number: deeper than
/// the range in which anyone compares limits. A choice.
pub(crate) const FAR_DEEPER: f64 = 10.0;

/// Relative distance below which two poles form one mode, because the mode shapes of (nearly) repeated poles are not
/// defined individually. It lies above the rounding of a double eigenvalue, √(2e-16) ≈ 1.5e-8, and below the spacing of
/// distinct modes. The value between is unfounded.
pub(crate) const SAME_POLE: f64 = 1e-6;

/// Largest relative residual ‖A P − λ P‖/(|λ|·‖P‖) for a pole λ with as many mode shapes as its multiplicity, P being
/// the projector on its modes. Poles that form one mode differ by less than [`SAME_POLE`]; the factor of ten is margin.
/// Unfounded.
pub(crate) const DEFECTIVE: f64 = 10.0 * SAME_POLE;

/// Difference of a pitch angle from that of equal pitch, degrees, above which a tool has variable pitch. Case files
/// give angles with a few digits; a thousandth of a degree changes a delay, and with it the speed of a limit, by about
/// 1e-5 of itself.
pub(crate) const VARIABLE_PITCH_DEG: f64 = 1e-3;

/// Largest distance of the sum of the pitch angles of a case from 360°, degrees. Angles with three digits after the
/// point err by 5e-4° each: 20 teeth in sum by 0.01°.
pub(crate) const PITCH_SUM_DEG: f64 = 0.01;

/// Largest number of teeth of a tool in a case; a larger one is taken for a typing error. Large face mills have some 40
/// teeth. Unfounded.
pub(crate) const TEETH_MAX: i64 = 64;

/// Range of tool diameters in a case, mm; outside, the unit is taken for wrong. Micro end mills have 5 µm, the largest
/// face mills 600 mm; the distance from these is a choice.
pub(crate) const DIAMETER_MM: [f64; 2] = [1e-3, 1e3];

/// Largest feed per tooth in a case, mm. High-feed milling reaches 4 mm; a feed in µm is hundreds. The value between is
/// a choice.
pub(crate) const FEED_PER_TOOTH_MAX_MM: f64 = 20.0;

/// Largest magnitude of a cutting coefficient in a case, MPa. Hardened steel and superalloys at thin chips reach some
/// 10⁴; a coefficient in Pa is 10⁸ and more. The value between is a choice.
pub(crate) const COEFFICIENT_MAX_MPA: f64 = 1e6;

/// Largest spindle speed in the limits of a case, rev/min. Air-bearing spindles reach 300 000. A choice above them.
pub const SPEED_MAX_RPM: f64 = 1e6;

/// Largest error of a correlation in `[uncertainty]` of a case that counts as rounding: difference of the entries
/// (i, j) and (j, i), excess of a magnitude over 1 and, times the number of parameters, an eigenvalue below 0.
/// Covariances with seven digits err by up to 5e-7 of the product of the standard deviations; the factor of two above
/// it is a choice.
pub(crate) const COVARIANCE_ROUNDING: f64 = 1e-6;

/// Share of a parameter's variance that earlier parameters leave unexplained, up to which the parameter counts as
/// following from them. Up to 1e-4 of the standard deviation of the parameter is dropped, which hardly moves a limit;
/// rounding of a covariance of 16 digits leaves far smaller shares. The value between is a choice.
pub(crate) const DEPENDENT_PARAMETER: f64 = 1e-8;

/// Smallest modal assurance criterion (MAC) of two modes of a structure at neighbouring spindle speeds that are the same
/// mode. Identical shapes have 1, orthogonal ones 0; gyroscopic moments and preload change shapes gradually. Unfounded.
pub(crate) const LEAST_PAIRED_MAC: f64 = 0.8;

/// Largest ratio of the natural frequencies of two modes of a structure at neighbouring spindle speeds that are the same
/// mode. Frequencies of spindles fall by some 10 to 20 % up to their highest speed. Unfounded.
pub(crate) const LARGEST_PAIRED_RATIO: f64 = 1.3;
