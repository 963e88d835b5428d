//! Reads and changes the value of a parameter in a case.

use num_complex::Complex64;

use super::Case;
use super::deviation::Parameter;
use crate::structure::{Form, Joint, Matrices, Mode};

impl Parameter {
    /// All parameters of a case that may be uncertain, in the order structure, tool, material, cut; not those of
    /// extensions.
    pub fn of_case(case: &Case) -> Vec<Self> {
        let structure = case.structure.as_ref();
        let size = structure.map_or(0, |structure| structure.directions.len());
        let mut all = match structure.map(|structure| &structure.form) {
            None => Vec::new(),
            Some(Form::Matrices(_)) => of_matrices(size),
            Some(Form::Modes(modes)) => (0..modes.len()).flat_map(|mode| of_mode(mode, size)).collect(),
            Some(Form::Joints(robot)) => (0..robot.joints.len()).flat_map(of_joint).collect(),
        };
        all.extend([
            Self::EdgeAngle,
            Self::RunoutOffset,
            Self::RunoutAngle,
            Self::Ktc,
            Self::Krc,
            Self::Kac,
            Self::Kte,
            Self::Kre,
            Self::Kae,
            Self::Start,
            Self::Exit,
            Self::FeedPerTooth,
            Self::FeedDirection,
        ]);
        let mut slots = case.clone();
        all.retain(|parameter| parameter.slot(&mut slots).is_some());
        all
    }

    /// Value of this parameter in a case, in the unit of its key; `None` if the case has no such parameter.
    pub fn value(self, case: &Case) -> Option<f64> {
        // The function `slot` gives mutable access to the value, so reading works on a copy of the case.
        self.slot(&mut case.clone()).map(|value| *value)
    }

    /// Adds `by` to the value of the parameter in a case.
    ///
    /// Start and exit angle are limited to 0 to 180 degrees, since a tooth cuts no chip beyond. Returns false if the
    /// case lacks the parameter, if its new value is outside its physical range, or if the start angle is not below the
    /// exit angle; in the last two cases the new value stays in the case.
    pub fn shift(self, case: &mut Case, by: f64) -> bool {
        let Some(value) = self.slot(case) else {
            return false;
        };
        *value += by;
        match self {
            Self::Start | Self::Exit => {
                *value = value.clamp(0.0, 180.0);
                case.cut.is_some_and(|cut| cut.start_deg < cut.exit_deg)
            }
            Self::Frequency(_) | Self::Ktc | Self::JointStiffness(_) | Self::LinkMass(_) => *value > 0.0,
            Self::JointDamping(_) => *value >= 0.0,
            Self::DampingRatio(_) => (0.0..1.0).contains(value),
            Self::EdgeAngle => *value > 0.0 && *value <= 90.0,
            Self::FeedPerTooth | Self::RunoutOffset => *value >= 0.0,
            _ => true,
        }
    }

    fn slot(self, case: &mut Case) -> Option<&mut f64> {
        match self {
            Self::Mass(..)
            | Self::Damping(..)
            | Self::Stiffness(..)
            | Self::CubicDamping(..)
            | Self::CubicStiffness(..) => match &mut case.structure.as_mut()?.form {
                Form::Matrices(matrices) => self.of_matrices(matrices),
                Form::Modes(_) | Form::Joints(_) => None,
            },
            Self::Frequency(mode)
            | Self::DampingRatio(mode)
            | Self::Left(mode, ..)
            | Self::Right(mode, ..) => match &mut case.structure.as_mut()?.form {
                Form::Modes(modes) => self.of_mode(modes.get_mut(mode)?),
                Form::Matrices(_) | Form::Joints(_) => None,
            },
            Self::JointStiffness(joint)
            | Self::JointDamping(joint)
            | Self::JointCubicStiffness(joint)
            | Self::JointCubicDamping(joint)
            | Self::LinkMass(joint) => match &mut case.structure.as_mut()?.form {
                Form::Joints(robot) => self.of_joint(robot.joints.get_mut(joint)?),
                Form::Matrices(_) | Form::Modes(_) => None,
            },
            Self::EdgeAngle => Some(&mut case.tool.as_mut()?.edge_angle_deg),
            Self::RunoutOffset => Some(&mut case.tool.as_mut()?.runout.as_mut()?.offset_um),
            Self::RunoutAngle => Some(&mut case.tool.as_mut()?.runout.as_mut()?.angle_deg),
            Self::Ktc => Some(&mut case.material.as_mut()?.ktc_mpa),
            Self::Krc => Some(&mut case.material.as_mut()?.krc_mpa),
            Self::Kac => Some(&mut case.material.as_mut()?.kac_mpa),
            Self::Kte => Some(&mut case.material.as_mut()?.kte_n_per_mm),
            Self::Kre => Some(&mut case.material.as_mut()?.kre_n_per_mm),
            Self::Kae => Some(&mut case.material.as_mut()?.kae_n_per_mm),
            Self::Start => Some(&mut case.cut.as_mut()?.start_deg),
            Self::Exit => Some(&mut case.cut.as_mut()?.exit_deg),
            Self::FeedPerTooth => Some(&mut case.cut.as_mut()?.feed_per_tooth_mm),
            Self::FeedDirection => Some(&mut case.cut.as_mut()?.feed_direction_deg),
        }
    }

    fn of_matrices(self, matrices: &mut Matrices) -> Option<&mut f64> {
        match self {
            Self::Mass(i, j) => matrices.mass.get_mut((i, j)),
            Self::Damping(i, j) => matrices.damping.get_mut((i, j)),
            Self::Stiffness(i, j) => matrices.stiffness.get_mut((i, j)),
            Self::CubicDamping(i, j) => matrices.cubic_damping.as_mut()?.get_mut((i, j)),
            Self::CubicStiffness(i, j) => matrices.cubic_stiffness.as_mut()?.get_mut((i, j)),
            _ => None,
        }
    }

    fn of_joint(self, joint: &mut Joint) -> Option<&mut f64> {
        match self {
            Self::JointStiffness(_) => Some(&mut joint.stiffness_nm_per_rad),
            Self::JointDamping(_) => Some(&mut joint.damping_nms_per_rad),
            Self::JointCubicStiffness(_) => Some(&mut joint.cubic_stiffness_nm_per_rad3),
            Self::JointCubicDamping(_) => Some(&mut joint.cubic_damping_nms3_per_rad3),
            Self::LinkMass(_) => Some(&mut joint.mass_kg),
            _ => None,
        }
    }

    fn of_mode(self, mode: &mut Mode) -> Option<&mut f64> {
        match self {
            Self::Frequency(_) => Some(&mut mode.frequency_hz),
            Self::DampingRatio(_) => Some(&mut mode.damping_ratio),
            Self::Left(_, entry, imaginary) => part_of(mode.left.get_mut(entry)?, imaginary),
            Self::Right(_, entry, imaginary) => part_of(mode.right.get_mut(entry)?, imaginary),
            _ => None,
        }
    }
}

fn of_matrices(size: usize) -> Vec<Parameter> {
    let entry: [fn(usize, usize) -> Parameter; 5] = [
        Parameter::Mass,
        Parameter::Damping,
        Parameter::Stiffness,
        Parameter::CubicDamping,
        Parameter::CubicStiffness,
    ];
    let entries = entry
        .into_iter()
        .flat_map(|entry| (0..size).flat_map(move |i| (0..size).map(move |j| entry(i, j))));
    entries.collect()
}

fn of_mode(mode: usize, size: usize) -> Vec<Parameter> {
    let parts = || (0..size).flat_map(|entry| [(entry, false), (entry, true)]);
    let left = parts().map(|(entry, imaginary)| Parameter::Left(mode, entry, imaginary));
    let right = parts().map(|(entry, imaginary)| Parameter::Right(mode, entry, imaginary));
    let pole = [Parameter::Frequency(mode), Parameter::DampingRatio(mode)];
    pole.into_iter().chain(left).chain(right).collect()
}

fn of_joint(joint: usize) -> [Parameter; 5] {
    [
        Parameter::JointStiffness(joint),
        Parameter::JointDamping(joint),
        Parameter::JointCubicStiffness(joint),
        Parameter::JointCubicDamping(joint),
        Parameter::LinkMass(joint),
    ]
}

fn part_of(entry: &mut Complex64, imaginary: bool) -> Option<&mut f64> {
    Some(if imaginary { &mut entry.im } else { &mut entry.re })
}
