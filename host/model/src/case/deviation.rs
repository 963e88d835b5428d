//! Standard deviations of the parameters of a case.

/// Standard deviation of one parameter.
///
/// The errors of the parameters in [`Case::deviations`](super::Case::deviations) are normally distributed and
/// independent, except that entries (i, j) and (j, i) of a matrix vary together if their values and standard deviations
/// are equal. For other correlations see [`ParameterCovariance`](super::ParameterCovariance).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// The uncertain parameter.
    pub parameter: Parameter,
    /// Standard deviation of the parameter, in the unit of the parameter. It is positive in a case. In
    /// [`independent_parts`](super::ParameterCovariance::independent_parts) it is negative if the parameter falls when
    /// the variable rises.
    pub std: f64,
}

/// A parameter of a case that may have a standard deviation. Indices count from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Parameter {
    /// Mass matrix entry: row, column.
    Mass(usize, usize),
    /// Damping matrix entry: row, column.
    Damping(usize, usize),
    /// Stiffness matrix entry: row, column.
    Stiffness(usize, usize),
    /// Entry of the matrix of cubic damping, which multiplies the cubes of the velocities: row, column.
    CubicDamping(usize, usize),
    /// Entry of the matrix of cubic stiffness, which multiplies the cubes of the displacements: row, column.
    CubicStiffness(usize, usize),
    /// Natural frequency of a mode, Hz: index of the mode.
    Frequency(usize),
    /// Damping ratio of a mode: index of the mode.
    DampingRatio(usize),
    /// Real (false) or imaginary (true) part of one entry of a left mode shape: index of the mode, index of the entry,
    /// part.
    Left(usize, usize, bool),
    /// Real (false) or imaginary (true) part of one entry of a right mode shape: index of the mode, index of the entry,
    /// part.
    Right(usize, usize, bool),
    /// Stiffness of a robot joint: index of the joint.
    JointStiffness(usize),
    /// Damping of a robot joint: index of the joint.
    JointDamping(usize),
    /// Cubic stiffness of a robot joint, which multiplies the cube of the vibration of the joint angle: index of the
    /// joint.
    JointCubicStiffness(usize),
    /// Cubic damping of a robot joint, which multiplies the cube of the angular velocity: index of the joint.
    JointCubicDamping(usize),
    /// Mass of the link that a robot joint carries: index of the joint.
    LinkMass(usize),
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

impl Parameter {
    /// Key of the parameter in the case file, with rows, columns, modes, joints and entries of mode shapes counted from
    /// 1, such as `structure.mass[1][2]` or `structure.mode[1].left[2] real`.
    pub fn key(self) -> String {
        let entry = |matrix: &str, i: usize, j: usize| format!("structure.{matrix}[{}][{}]", i + 1, j + 1);
        let shape = |mode: usize, side: &str, index: usize, imaginary: bool| {
            let part = if imaginary { "imaginary" } else { "real" };
            format!("structure.mode[{}].{side}[{}] {part}", mode + 1, index + 1)
        };
        let of_joint = |joint: usize, key: &str| format!("structure.joint[{}].{key}", joint + 1);
        match self {
            Self::Mass(i, j) => entry("mass", i, j),
            Self::Damping(i, j) => entry("damping", i, j),
            Self::Stiffness(i, j) => entry("stiffness", i, j),
            Self::CubicDamping(i, j) => entry("cubic_damping", i, j),
            Self::CubicStiffness(i, j) => entry("cubic_stiffness", i, j),
            Self::Frequency(mode) => format!("structure.mode[{}].frequency_hz", mode + 1),
            Self::DampingRatio(mode) => format!("structure.mode[{}].damping_ratio", mode + 1),
            Self::Left(mode, index, imaginary) => shape(mode, "left", index, imaginary),
            Self::Right(mode, index, imaginary) => shape(mode, "right", index, imaginary),
            Self::JointStiffness(joint) => of_joint(joint, "stiffness_nm_per_rad"),
            Self::JointDamping(joint) => of_joint(joint, "damping_nms_per_rad"),
            Self::JointCubicStiffness(joint) => of_joint(joint, "cubic_stiffness_nm_per_rad3"),
            Self::JointCubicDamping(joint) => of_joint(joint, "cubic_damping_nms3_per_rad3"),
            Self::LinkMass(joint) => of_joint(joint, "mass_kg"),
            Self::EdgeAngle => "tool.edge_angle_deg".into(),
            Self::RunoutOffset => "tool.runout_um".into(),
            Self::RunoutAngle => "tool.runout_angle_deg".into(),
            Self::Ktc => "material.ktc_mpa".into(),
            Self::Krc => "material.krc_mpa".into(),
            Self::Kac => "material.kac_mpa".into(),
            Self::Kte => "material.kte_n_per_mm".into(),
            Self::Kre => "material.kre_n_per_mm".into(),
            Self::Kae => "material.kae_n_per_mm".into(),
            Self::Start => "cut.start_deg".into(),
            Self::Exit => "cut.exit_deg".into(),
            Self::FeedPerTooth => "cut.feed_per_tooth_mm".into(),
            Self::FeedDirection => "cut.feed_direction_deg".into(),
        }
    }
}
