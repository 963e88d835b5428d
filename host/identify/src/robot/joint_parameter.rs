//! The parameters of a robot's joints that a fit may determine.

use quietcut_model::structure::Robot;

/// A parameter of a robot that a fit may determine. Joints are counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointParameter {
    /// Stiffness of a joint, N m/rad.
    Stiffness(usize),
    /// Viscous damping of a joint, N m s/rad.
    Damping(usize),
    /// Cubic stiffness of a joint, N m/rad³.
    CubicStiffness(usize),
    /// Cubic damping of a joint, N m s³/rad³.
    CubicDamping(usize),
    /// Mass of the last link including the tool and the payload on it, kg.
    Payload,
}

impl JointParameter {
    /// The key of the parameter in a case file.
    pub fn key(self) -> &'static str {
        match self {
            Self::Stiffness(_) => "stiffness_nm_per_rad",
            Self::Damping(_) => "damping_nms_per_rad",
            Self::CubicStiffness(_) => "cubic_stiffness_nm_per_rad3",
            Self::CubicDamping(_) => "cubic_damping_nms3_per_rad3",
            Self::Payload => "mass_kg",
        }
    }

    /// Index of the joint of the parameter, from 0, in a robot with `joints` joints.
    pub fn joint(self, joints: usize) -> usize {
        match self {
            Self::Stiffness(joint)
            | Self::Damping(joint)
            | Self::CubicStiffness(joint)
            | Self::CubicDamping(joint) => joint,
            Self::Payload => joints.saturating_sub(1),
        }
    }

    /// True for the cubic terms of a joint: they have no effect at vanishing force and may be negative.
    pub fn is_cubic(self) -> bool {
        matches!(self, Self::CubicStiffness(_) | Self::CubicDamping(_))
    }

    /// Name of the parameter for messages, with the joint counted from 1.
    pub fn name(self) -> String {
        match self {
            Self::Payload => format!("payload {}", self.key()),
            Self::Stiffness(joint)
            | Self::Damping(joint)
            | Self::CubicStiffness(joint)
            | Self::CubicDamping(joint) => format!("joint {} {}", joint + 1, self.key()),
        }
    }

    pub(super) fn slot(self, robot: &mut Robot) -> Option<&mut f64> {
        Some(match self {
            Self::Stiffness(joint) => &mut robot.joints.get_mut(joint)?.stiffness_nm_per_rad,
            Self::Damping(joint) => &mut robot.joints.get_mut(joint)?.damping_nms_per_rad,
            Self::CubicStiffness(joint) => &mut robot.joints.get_mut(joint)?.cubic_stiffness_nm_per_rad3,
            Self::CubicDamping(joint) => &mut robot.joints.get_mut(joint)?.cubic_damping_nms3_per_rad3,
            Self::Payload => &mut robot.joints.last_mut()?.mass_kg,
        })
    }

    /// The value of the parameter in `robot`; NaN if the robot has no such joint.
    pub fn value(self, robot: &Robot) -> f64 {
        self.slot(&mut robot.clone()).map_or(f64::NAN, |value| *value)
    }

    /// Sets the value of the parameter in `robot`, if the robot has such a joint.
    pub(crate) fn set(self, robot: &mut Robot, value: f64) {
        if let Some(slot) = self.slot(robot) {
            *slot = value;
        }
    }
}
