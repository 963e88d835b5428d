//! A robot of rigid links on compliant joints, linearized at a posture.
//!
//! Let q be the deviations of the joint angles from the posture q₀. Then M(q₀) q̈ + C q̇ + K q + C₃ q̇∘³ + K₃ q∘³ = Jᵀ
//! F and u = J q. For six joints, let J₆ be J with three more rows for the rotation of the tool. Where J₆ has an
//! inverse, the linear part of these equations equals that of the tool-space matrices J₆⁻ᵀ M J₆⁻¹, J₆⁻ᵀ C J₆⁻¹ and J₆⁻ᵀ
//! K J₆⁻¹ (thesis eq. 3.14). The equations in joint angles also hold where J₆ has none (a straight wrist), and for any
//! number of joints.
//!
//! Two things are neglected: the change of M and J within a vibration, and gravity. Gravity deflects the joints by
//! about a milliradian from the commanded angles; q and its cubes count from the deflected position. For the robot of
//! the cases, gravity changes the height of peaks of the receptance by up to 0.3 %, as a test prints.

use nalgebra::{DMatrix, Matrix3, Matrix3xX, Rotation3, Unit, Vector3};

use super::Matrices;

/// A joint and the link that it carries. Positions are in the base frame, with all joint angles at zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Direction of the joint axis in the base frame, with all joint angles at zero: the link rotates about it by the
    /// right-hand rule.
    pub axis: Unit<Vector3<f64>>,
    /// A point on the joint's axis in the base frame, with all joint angles at zero, m.
    pub point_m: Vector3<f64>,
    /// Joint stiffness, N m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Joint damping, N m s/rad.
    pub damping_nms_per_rad: f64,
    /// Cubic stiffness coefficient of the joint angle, N m/rad³.
    pub cubic_stiffness_nm_per_rad3: f64,
    /// Cubic damping coefficient of the joint's angular velocity, N m s³/rad³.
    pub cubic_damping_nms3_per_rad3: f64,
    /// Moment of inertia of motor and gear about the joint axis, reflected to the link side, kg m².
    pub rotor_kg_m2: f64,
    /// Mass of the link, kg.
    pub mass_kg: f64,
    /// Centre of mass of the joint's link in the base frame, with all joint angles at zero, m.
    pub center_m: Vector3<f64>,
    /// Inertia tensor of the link about its centre of mass along the axes of the base frame, with all joint angles at
    /// zero, kg m².
    pub inertia_kg_m2: Matrix3<f64>,
}

/// A robot at a posture.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// The joints in their order from the base to the tool.
    pub joints: Vec<Joint>,
    /// Position of the tool centre point with all joint angles at zero, m.
    pub tool_m: Vector3<f64>,
    /// Joint angles of the posture, rad, one for each joint.
    pub angles_rad: Vec<f64>,
}

/// Positions and orientations of joints, links and tool at a posture, in the base frame.
struct PostureGeometry {
    /// For each joint, in the order from the base, the direction of its axis and a point on that axis, m.
    axes: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// For each link, in the order of its joint, the rotation from the position with all joint angles at zero, and the
    /// position of the centre of mass, m.
    links: Vec<(Rotation3<f64>, Vector3<f64>)>,
    tool_m: Vector3<f64>,
}

impl Robot {
    /// This robot in the posture of the joint angles `angles_rad`, rad.
    pub fn at(&self, angles_rad: &[f64]) -> Self {
        Self {
            angles_rad: angles_rad.to_vec(),
            ..self.clone()
        }
    }

    fn geometry(&self) -> PostureGeometry {
        let (mut rotation, mut shift) = (Rotation3::identity(), Vector3::zeros());
        let mut axes = Vec::with_capacity(self.joints.len());
        let mut links = Vec::with_capacity(self.joints.len());
        for (joint, angle) in self.joints.iter().zip(&self.angles_rad) {
            axes.push((
                rotation * joint.axis.into_inner(),
                rotation * joint.point_m + shift,
            ));
            let rotation_of_joint = Rotation3::from_axis_angle(&joint.axis, *angle);
            // A rotation of this joint moves a point x to `rotation_of_joint`·(x − point) + point; the joints nearer to
            // the base act after it.
            shift += rotation * (joint.point_m - rotation_of_joint * joint.point_m);
            rotation *= rotation_of_joint;
            links.push((rotation, rotation * joint.center_m + shift));
        }
        PostureGeometry {
            axes,
            links,
            tool_m: rotation * self.tool_m + shift,
        }
    }

    /// Position of the tool centre point in the base frame, m.
    pub fn tool_position_m(&self) -> Vector3<f64> {
        self.geometry().tool_m
    }

    /// Jacobian J, 3 × n: displacement of the tool centre point along x, y, z, m, per joint angle, rad.
    pub fn jacobian(&self) -> Matrix3xX<f64> {
        let geometry = self.geometry();
        jacobian(&geometry, self.joints.len(), geometry.tool_m)
    }

    /// Displacement of the centre of mass of the last link along x, y, z, m, per joint angle, rad; 3 × n.
    pub fn payload_jacobian(&self) -> Matrix3xX<f64> {
        let geometry = self.geometry();
        let center = geometry
            .links
            .last()
            .map_or(geometry.tool_m, |(_, center)| *center);
        jacobian(&geometry, self.joints.len(), center)
    }

    /// Mass matrix M(q₀) of the equation of motion in joint angles, kg m².
    pub fn mass(&self) -> DMatrix<f64> {
        let geometry = self.geometry();
        let mut mass = DMatrix::from_diagonal(&self.of_joints(|joint| joint.rotor_kg_m2).diagonal());
        for (index, (joint, (rotation, center))) in self.joints.iter().zip(&geometry.links).enumerate() {
            let moved = jacobian(&geometry, index + 1, *center);
            let axes = Matrix3xX::from_columns(
                &geometry.axes[..=index]
                    .iter()
                    .map(|(axis, _)| *axis)
                    .collect::<Vec<_>>(),
            );
            let inertia = rotation.matrix() * joint.inertia_kg_m2 * rotation.matrix().transpose();
            let own = moved.tr_mul(&moved) * joint.mass_kg + axes.tr_mul(&(inertia * &axes));
            let mut part = mass.view_mut((0, 0), (index + 1, index + 1));
            part += own;
        }
        mass
    }

    /// The matrices of the equation of motion in joint angles.
    pub fn matrices(&self) -> Matrices {
        let cubic = |of: fn(&Joint) -> f64| {
            let matrix = self.of_joints(of);
            (matrix.amax() > 0.0).then_some(matrix)
        };
        Matrices {
            mass: self.mass(),
            damping: self.of_joints(|joint| joint.damping_nms_per_rad),
            stiffness: self.of_joints(|joint| joint.stiffness_nm_per_rad),
            cubic_damping: cubic(|joint| joint.cubic_damping_nms3_per_rad3),
            cubic_stiffness: cubic(|joint| joint.cubic_stiffness_nm_per_rad3),
        }
    }

    /// Diagonal matrix with one property of each joint, such as its stiffness.
    fn of_joints(&self, of: impl Fn(&Joint) -> f64) -> DMatrix<f64> {
        let count = self.joints.len();
        DMatrix::from_fn(
            count,
            count,
            |i, j| if i == j { of(&self.joints[i]) } else { 0.0 },
        )
    }
}

/// Displacement of a point along x, y, z, m, per angle of each of the first `count` joints, rad; these joints move the
/// point.
fn jacobian(geometry: &PostureGeometry, count: usize, point: Vector3<f64>) -> Matrix3xX<f64> {
    let columns: Vec<Vector3<f64>> = geometry.axes[..count]
        .iter()
        .map(|(axis, on_axis)| axis.cross(&(point - on_axis)))
        .collect();
    Matrix3xX::from_columns(&columns)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The robot of the project's cases.
    pub(crate) fn robot() -> Robot {
        let path = format!(
            "{}/../../tests/cases/six-joint-robot.toml",
            env!("CARGO_MANIFEST_DIR")
        );
        match crate::case::Case::read(path).unwrap().structure.unwrap().form {
            crate::structure::Form::Joints(robot) => *robot,
            _ => panic!("no robot"),
        }
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_tool_and_mass_that_of_the_kinetic_energy() {
        let robot = robot();
        let (h, jacobian, mass) = (1e-6, robot.jacobian(), robot.mass());
        let moved = |joint: usize, by: f64| {
            let mut angles = robot.angles_rad.clone();
            angles[joint] += by;
            robot.at(&angles).geometry()
        };
        for joint in 0..6 {
            let (low, high) = (moved(joint, -h), moved(joint, h));
            let slope = (high.tool_m - low.tool_m) / (2.0 * h);
            // Errors of the central differences of lengths of some metres: 1e-12 by truncation, 1e-10 by rounding.
            assert!((slope - jacobian.column(joint)).norm() < 1e-8, "{joint}");
            // Kinetic energy at 1 rad/s of one joint, summed over the links, from central differences of positions and
            // rotations.
            let mut twice = robot.joints[joint].rotor_kg_m2;
            for (link, body) in robot.joints.iter().enumerate() {
                let speed = (high.links[link].1 - low.links[link].1) / (2.0 * h);
                let rotation = robot.geometry().links[link].0;
                let derivative = (high.links[link].0.matrix() - low.links[link].0.matrix()) / (2.0 * h);
                let spin = derivative * rotation.matrix().transpose();
                let spin = Vector3::new(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]);
                let local = rotation.inverse() * spin;
                twice += body.mass_kg * speed.norm_squared() + local.dot(&(body.inertia_kg_m2 * local));
            }
            assert!((twice / mass[(joint, joint)] - 1.0).abs() < 1e-7, "{joint}");
        }
        assert!((mass.clone() - mass.transpose()).amax() < 1e-12 * mass.amax());
    }
}
