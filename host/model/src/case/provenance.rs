//! Assumptions behind a case, to be stated wherever limits from it are shown.

use nalgebra::{Matrix2, Rotation2};

use super::Case;
use crate::criteria::FAR_DEEPER;
use crate::milling::Process;
use crate::structure::Direction;

/// Assumption of a structure that was measured at standstill.
pub const AT_STANDSTILL: &str = "the structure was measured at standstill: a running spindle may have other natural frequencies and damping ratios, \
    and lobes move with the frequencies; take taps at the speeds of use with the spindle running (several [[structure.at_speed]]), or check a limit by a cut";

impl Case {
    /// Sentences that state the assumptions behind the structure of the case: those of its section `[provenance]`, the
    /// receptances that it states as zero and, if the structure has no z, the
    /// [`effect_of_rigid_z`](Self::effect_of_rigid_z).
    pub fn assumptions(&self) -> Vec<String> {
        let mut assumptions = self.assumed.clone();
        assumptions.extend(self.effect_of_zero_receptances());
        let lacks_z = self.structure.as_ref().is_some_and(|structure| {
            let has = |direction| structure.directions.contains(&direction);
            !has(Direction::Z) && (has(Direction::X) || has(Direction::Y))
        });
        if lacks_z {
            assumptions.extend(self.effect_of_rigid_z());
        }
        assumptions.extend(self.speed_of_structure());
        assumptions
    }

    /// Sentence about the receptances that the section `[provenance]` states as zero.
    fn effect_of_zero_receptances(&self) -> Option<String> {
        let names = &self.zero_receptances;
        if names.is_empty() {
            return None;
        }
        let verb = if names.len() > 1 { "were" } else { "was" };
        let taken = format!("{} {verb} not measured and taken as zero", names.join(", "));
        let has = |name: &str| names.iter().any(|known| known == name);
        let effect = (has("hxy") && has("hyx")).then(|| self.effect_of_uncoupled_xy());
        Some(match effect.flatten() {
            Some(effect) => format!("{taken}: {effect}"),
            None => taken,
        })
    }

    /// Part of a sentence that says how much limits may differ if hxy and hyx are not zero; `None` without tool, material or
    /// cut.
    ///
    /// With h_xx = h_yy = h and uncoupled directions, the averaged loop of the cut has the gains λh with the eigenvalues λ of
    /// the averaged directional matrix A of x and y. With h_xy = h_yx = ±h, as a mode at ±45° has them, it has one gain,
    /// (a_xx + a_yy ± (a_xy + a_yx)) h. The receptance of a lightly damped mode runs through a circle about −ir of radius r =
    /// 1/(4kζ), so that the lowest limit 1/(2 max Re λh) (Altintas and Budak) is inversely proportional to |λ| + |Im λ|.
    pub fn effect_of_uncoupled_xy(&self) -> Option<String> {
        let [least, most] = self.depth_ratio_of_coupled_xy()?;
        let range = if most > FAR_DEEPER {
            format!("{least:.2} times as deep, or far deeper")
        } else {
            let [least, most] = [least, most].map(|ratio| format!("{ratio:.2}"));
            let between = if least == most {
                least
            } else {
                format!("{least} to {most}")
            };
            format!("{between} times as deep")
        };
        Some(format!(
            "with hxy and hyx as large as hxx and hyy, as of a mode at 45° to x, the lowest limit could be {range}; measure them to know"
        ))
    }

    /// Lowest limit with a mode at +45° and at −45° to x, divided by that with hxy = hyx = 0: the smaller ratio first.
    fn depth_ratio_of_coupled_xy(&self) -> Option<[f64; 2]> {
        let (tool, material, cut) = (self.tool.as_ref()?, self.material.as_ref()?, self.cut.as_ref()?);
        let process = Process::new(tool, material, cut, self.axial_depth_modulation());
        let averaged = process
            .force
            .averaged(&process.engagement, process.feed_per_tooth_m);
        let rotation = Rotation2::new(cut.feed_direction_deg.to_radians());
        let of_feed: Matrix2<f64> = averaged.directional.fixed_view::<2, 2>(0, 0).into_owned();
        let matrix = rotation.matrix() * of_feed * rotation.matrix().transpose();
        let uncoupled = matrix
            .complex_eigenvalues()
            .iter()
            .map(|value| value.norm() + value.im.abs())
            .fold(0.0, f64::max);
        let ratio = |sign: f64| uncoupled / (matrix.trace() + sign * (matrix[(0, 1)] + matrix[(1, 0)])).abs();
        let (one, other) = (ratio(1.0), ratio(-1.0));
        let ratios = [one.min(other), one.max(other)];
        (ratios[0].is_finite() && !ratios[1].is_nan()).then_some(ratios)
    }

    /// Sentence about the spindle speeds of the structure: that it was measured at standstill, or between which speeds it
    /// is interpolated; `None` if the case states no speed, or one speed other than 0.
    fn speed_of_structure(&self) -> Option<String> {
        if let Some(dependence) = &self.speed_dependence {
            let speeds: Vec<String> = dependence.speeds_rpm().iter().map(ToString::to_string).collect();
            return Some(format!(
                "the modes are interpolated over the spindle speed between {} rev/min, and level beyond; their deviations are those of the first \
                 structure at all speeds",
                speeds.join(", ")
            ));
        }
        (self.structure_rpm == Some(0.0)).then(|| AT_STANDSTILL.into())
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
    fn uncoupled_directions_are_stated_with_the_limits_of_a_mode_at_45_degrees() {
        // Slot with K_rc = 0.2 K_tc: A = N K_tc/4 [[−K_r, −1], [1, −K_r]] (Altintas and Budak 1995), with the eigenvalues −K_r ± i, so
        // that the limit of the mode at 45° is (√(1 + K_r²) + 1)/(2 K_r) times as deep.
        let mut slot = case("insperger-2dof-ad0.5");
        assert!(slot.assumptions().is_empty());
        slot.zero_receptances = ["hxy", "hyx"].map(String::from).to_vec();
        let (cut, material) = (slot.cut.as_mut().unwrap(), slot.material.as_mut().unwrap());
        (cut.start_deg, cut.exit_deg) = (0.0, 180.0);
        material.krc_mpa = 0.2 * material.ktc_mpa;
        let expected: f64 = (1.04_f64.sqrt() + 1.0) / 0.4;
        for feed_deg in [0.0, 30.0] {
            slot.cut.as_mut().unwrap().feed_direction_deg = feed_deg;
            for ratio in slot.depth_ratio_of_coupled_xy().unwrap() {
                assert!((ratio / expected - 1.0).abs() < 1e-12, "{ratio} {expected}");
            }
        }
        let found = slot.assumptions();
        assert_eq!(found.len(), 1);
        assert!(
            found[0].starts_with("hxy, hyx were not measured and taken as zero")
                && found[0].contains("5.05 times as deep;"),
            "{found:?}"
        );
        // Other receptances are named without an effect.
        slot.zero_receptances = vec!["hxz".into()];
        assert_eq!(slot.assumptions(), ["hxz was not measured and taken as zero"]);
    }

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
