//! Assumptions behind a case, to be stated wherever limits from it are shown.

use super::Case;
use crate::milling::Process;
use crate::structure::Direction;

impl Case {
    /// Sentences that state the assumptions behind the structure of the case: those of its section `[provenance]` and,
    /// if the structure has no z, the [`effect_of_rigid_z`](Self::effect_of_rigid_z).
    pub fn assumptions(&self) -> Vec<String> {
        let mut assumptions = self.assumed.clone();
        let lacks_z = self.structure.as_ref().is_some_and(|structure| {
            let has = |direction| structure.directions.contains(&direction);
            !has(Direction::Z) && (has(Direction::X) || has(Direction::Y))
        });
        if lacks_z {
            assumptions.extend(self.effect_of_rigid_z());
        }
        assumptions
    }

    /// Sentence that says by which factor limits could differ if the tool is not rigid in z; `None` if tool, material
    /// or cut are missing, or if the factor is below 1.005 or not finite.
    ///
    /// The factor (1 + c)(1 + f) is an estimate with all receptances equal, at the middle of the engagement. The ratio
    /// c = |n_z|/|n_xy| compares z with x and y in the chip-thickness direction n, the ratio f = |k_z|/|k_xy| in the
    /// cutting force k.
    pub fn effect_of_rigid_z(&self) -> Option<String> {
        let (tool, material, cut) = (self.tool.as_ref()?, self.material.as_ref()?, self.cut.as_ref()?);
        let process = Process::new(tool, material, cut, self.axial_depth_modulation());
        let middle = 0.5 * (process.engagement.start + process.engagement.exit);
        let share = |vector: nalgebra::Vector3<f64>| vector.z.abs() / vector.x.hypot(vector.y);
        let chip = share(process.force.normal.at(middle));
        let force = share(process.force.cutting.at(middle));
        let factor = (1.0 + chip) * (1.0 + force);
        // A smaller factor rounds to 1.00; for a square end mill without axial force it is 1.
        (factor >= 1.005 && factor.is_finite()).then(|| {
            format!(
                "the tool is taken as rigid in z: with receptances hzz, hxz and hyz as large as hxx and hyy, limits could differ by a factor of {factor:.2}; \
                 measure z to know"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::case;
    use crate::structure::Direction;

    #[test]
    fn a_rigid_z_is_stated_where_it_can_change_limits() {
        // K_ac of 39.27 MPa beside K_tc = 119 and K_rc = 20.2 MPa: 39.27/√(119² + 20.2²) = 0.33.
        let mut acetal = case("kuka-kr90-acetal");
        assert!(acetal.assumptions().is_empty());
        acetal.structure.as_mut().unwrap().directions = vec![Direction::X, Direction::Y];
        acetal.assumed = vec!["hxy is taken as zero".into()];
        let found = acetal.assumptions();
        assert_eq!(found.len(), 2);
        assert_eq!(found[0], "hxy is taken as zero");
        assert!(
            found[1].contains("rigid in z") && found[1].contains("factor of 1.33"),
            "{found:?}"
        );
        // An edge at 45° to the axis: the chip follows z as much as the motion normal to the axis.
        acetal.tool.as_mut().unwrap().edge_angle_deg = 45.0;
        let steep = acetal.effect_of_rigid_z().unwrap();
        let factor = steep
            .split("factor of ")
            .nth(1)
            .and_then(|rest| rest.split(';').next());
        assert!(factor.unwrap().parse::<f64>().unwrap() > 2.0, "{steep}");
        // A square end mill without axial force.
        assert_eq!(case("insperger-2dof-ad0.5").effect_of_rigid_z(), None);
    }
}
