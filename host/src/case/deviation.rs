//! How well a parameter is known.

/// The standard deviation of one parameter, in the unit of that parameter: a key `…_std` of the case.
///
/// Deviations are independent of one another and normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Which parameter.
    pub parameter: Parameter,
    /// Its standard deviation, positive.
    pub std: f64,
}

/// A parameter of a case that may carry a deviation. Indices count from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Parameter {
    /// An entry of the mass matrix.
    Mass(usize, usize),
    /// An entry of the damping matrix.
    Damping(usize, usize),
    /// An entry of the stiffness matrix.
    Stiffness(usize, usize),
    /// An entry of the matrix on the cubes of velocities.
    CubicDamping(usize, usize),
    /// An entry of the matrix on the cubes of displacements.
    CubicStiffness(usize, usize),
    /// Natural frequency of a mode, Hz.
    Frequency(usize),
    /// Damping ratio of a mode.
    DampingRatio(usize),
    /// Real (false) or imaginary (true) part of an entry of a left shape: mode, entry, part.
    Left(usize, usize, bool),
    /// Real (false) or imaginary (true) part of an entry of a right shape: mode, entry, part.
    Right(usize, usize, bool),
    /// Edge angle of the tool.
    EdgeAngle,
    /// Offset of the runout.
    RunoutOffset,
    /// Angle of the runout.
    RunoutAngle,
    /// K_tc.
    Ktc,
    /// K_rc.
    Krc,
    /// K_ac.
    Kac,
    /// K_te.
    Kte,
    /// K_re.
    Kre,
    /// K_ae.
    Kae,
    /// Start angle.
    Start,
    /// Exit angle.
    Exit,
    /// Feed per tooth.
    FeedPerTooth,
    /// Feed direction.
    FeedDirection,
}
