//! Reads the structure of a robot from the case file: joints, links and tool position.

use nalgebra::{Cholesky, Matrix3, Unit, Vector3};
use toml::Spanned;

use super::Check;
use crate::case::file::{JointFile, Number, StructureFile};
use crate::case::{CaseError, Parameter};
use crate::structure::{Direction, Joint, Robot};

impl Check<'_> {
    /// Refuses joints and tool position, which only a robot has, in a structure of another kind.
    pub(super) fn no_joints_but_with_their_kind(
        &self,
        file: &Spanned<StructureFile>,
    ) -> Result<(), CaseError> {
        let table = file.get_ref();
        if table.kind.get_ref() == "joints" {
            return Ok(());
        }
        let expected = "kind = \"joints\" with it";
        if let Some(joint) = table.joint.as_ref().and_then(|joints| joints.first()) {
            return Err(self.wrong(joint, "structure.joint", "a joint", expected));
        }
        match &table.tool_m {
            Some(tool) => Err(self.wrong(tool, "structure.tool_m", "a place", expected)),
            None => Ok(()),
        }
    }

    pub(super) fn robot(
        &mut self,
        file: &Spanned<StructureFile>,
        directions: &[Direction],
        joints_deg: &[f64],
    ) -> Result<Robot, CaseError> {
        let table = file.get_ref();
        let only = "[[structure.joint]] tables only (kind = \"joints\")";
        self.no_matrices(table, only)?;
        if let Some(mode) = table.mode.as_ref().and_then(|modes| modes.first()) {
            return Err(self.wrong(mode, "structure.mode", "a mode", only));
        }
        if directions != [Direction::X, Direction::Y, Direction::Z] {
            let found = format!("{:?}", table.directions.get_ref());
            let expected = "x, y and z, those of the base (kind = \"joints\")";
            return Err(self.wrong(&table.directions, "structure.directions", found, expected));
        }
        let joints = table.joint.as_deref().unwrap_or_default();
        if joints.is_empty() {
            return Err(self.wrong(
                file,
                "structure.joint",
                "nothing",
                "at least one [[structure.joint]]",
            ));
        }
        let Some(tool) = &table.tool_m else {
            let expected = "[x, y, z] of the tool centre point with all joint angles at zero, m";
            return Err(self.wrong(file, "structure.tool_m", "nothing", expected));
        };
        if joints_deg.len() != joints.len() {
            let found = format!("{} angles", joints_deg.len());
            let expected = format!("one angle for each of the {} joints", joints.len());
            return Err(self.wrong(file, "posture.joints_deg", found, expected));
        }
        Ok(Robot {
            tool_m: self.place(tool, "structure.tool_m")?,
            joints: joints
                .iter()
                .enumerate()
                .map(|(index, joint)| self.joint(joint.get_ref(), index))
                .collect::<Result<_, _>>()?,
            angles_rad: joints_deg.iter().map(|angle| angle.to_radians()).collect(),
        })
    }

    fn place(&self, place: &Spanned<[f64; 3]>, key: &str) -> Result<Vector3<f64>, CaseError> {
        match place.get_ref().iter().find(|entry| !entry.is_finite()) {
            Some(entry) => Err(self.wrong(place, key, entry, "three finite numbers")),
            None => Ok(Vector3::from(*place.get_ref())),
        }
    }

    fn joint(&mut self, file: &JointFile, index: usize) -> Result<Joint, CaseError> {
        let key = |name: &str| format!("structure.joint[{}].{name}", index + 1);
        let direction = self.place(&file.axis, &key("axis"))?;
        let Some(axis) = Unit::try_new(direction, 1e-9) else {
            return Err(self.wrong(&file.axis, &key("axis"), "no length", "a direction"));
        };
        let not_negative = |value: &Option<Number>, key: &str| match value {
            Some(value) => self.number(value, key, |x| x >= 0.0, "a number of 0 or more"),
            None => Ok(0.0),
        };
        let joint = Joint {
            axis,
            point_m: self.place(&file.point_m, &key("point_m"))?,
            stiffness_nm_per_rad: self.positive(&file.stiffness_nm_per_rad, &key("stiffness_nm_per_rad"))?,
            damping_nms_per_rad: self.number(
                &file.damping_nms_per_rad,
                &key("damping_nms_per_rad"),
                |x| x >= 0.0,
                "a number of 0 or more",
            )?,
            cubic_stiffness_nm_per_rad3: self.finite_or(
                &file.cubic_stiffness_nm_per_rad3,
                &key("cubic_stiffness_nm_per_rad3"),
                0.0,
            )?,
            cubic_damping_nms3_per_rad3: self.finite_or(
                &file.cubic_damping_nms3_per_rad3,
                &key("cubic_damping_nms3_per_rad3"),
                0.0,
            )?,
            rotor_kg_m2: not_negative(&file.rotor_kg_m2, &key("rotor_kg_m2"))?,
            mass_kg: self.positive(&file.mass_kg, &key("mass_kg"))?,
            center_m: self.place(&file.center_m, &key("center_m"))?,
            inertia_kg_m2: self.inertia(&file.inertia_kg_m2, &key("inertia_kg_m2"))?,
        };
        self.deviation(
            &file.stiffness_nm_per_rad_std,
            &key("stiffness_nm_per_rad"),
            Parameter::JointStiffness(index),
        )?;
        self.deviation(
            &file.damping_nms_per_rad_std,
            &key("damping_nms_per_rad"),
            Parameter::JointDamping(index),
        )?;
        self.deviation(
            &file.cubic_stiffness_nm_per_rad3_std,
            &key("cubic_stiffness_nm_per_rad3"),
            Parameter::JointCubicStiffness(index),
        )?;
        self.deviation(
            &file.cubic_damping_nms3_per_rad3_std,
            &key("cubic_damping_nms3_per_rad3"),
            Parameter::JointCubicDamping(index),
        )?;
        self.deviation(&file.mass_kg_std, &key("mass_kg"), Parameter::LinkMass(index))?;
        Ok(joint)
    }

    /// Inertia tensor from its entries [xx, yy, zz] or [xx, yy, zz, xy, xz, yz], kg m²; it must be positive definite.
    fn inertia(&self, file: &Spanned<Vec<f64>>, key: &str) -> Result<Matrix3<f64>, CaseError> {
        let inertia = match file.get_ref()[..] {
            [xx, yy, zz] => Matrix3::from_diagonal(&Vector3::new(xx, yy, zz)),
            [xx, yy, zz, xy, xz, yz] => Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            _ => {
                let found = format!("{} numbers", file.get_ref().len());
                return Err(self.wrong(file, key, found, "[xx, yy, zz] or [xx, yy, zz, xy, xz, yz]"));
            }
        };
        let is_finite = inertia.iter().all(|entry| entry.is_finite());
        if is_finite && Cholesky::new(inertia).is_some() {
            Ok(inertia)
        } else {
            let found = format!("{:?}", file.get_ref());
            Err(self.wrong(
                file,
                key,
                found,
                "the moments of a body: a positive definite tensor",
            ))
        }
    }
}
