//! Reads the job from the case file: material, cut and posture of the robot.

use toml::Spanned;

use super::Check;
use crate::case::file::{CutFile, MaterialFile, Number, PostureFile};
use crate::case::{CaseError, Parameter, Posture};
use crate::criteria::{COEFFICIENT_MAX_MPA, FEED_PER_TOOTH_MAX_MM};
use crate::milling::{Cut, Material, Tool};

impl Check<'_> {
    pub(super) fn material(&mut self, file: &MaterialFile) -> Result<Material, CaseError> {
        let material = Material {
            ktc_mpa: {
                self.positive(&file.ktc_mpa, "material.ktc_mpa")?;
                self.coefficient(&file.ktc_mpa, "material.ktc_mpa")?
            },
            krc_mpa: self.coefficient(&file.krc_mpa, "material.krc_mpa")?,
            kac_mpa: self.coefficient(&file.kac_mpa, "material.kac_mpa")?,
            kte_n_per_mm: self.finite_or(&file.kte_n_per_mm, "material.kte_n_per_mm", 0.0)?,
            kre_n_per_mm: self.finite_or(&file.kre_n_per_mm, "material.kre_n_per_mm", 0.0)?,
            kae_n_per_mm: self.finite_or(&file.kae_n_per_mm, "material.kae_n_per_mm", 0.0)?,
        };
        self.deviation(&file.ktc_mpa_std, "material.ktc_mpa", Parameter::Ktc)?;
        self.deviation(&file.krc_mpa_std, "material.krc_mpa", Parameter::Krc)?;
        self.deviation(&file.kac_mpa_std, "material.kac_mpa", Parameter::Kac)?;
        self.deviation(&file.kte_n_per_mm_std, "material.kte_n_per_mm", Parameter::Kte)?;
        self.deviation(&file.kre_n_per_mm_std, "material.kre_n_per_mm", Parameter::Kre)?;
        self.deviation(&file.kae_n_per_mm_std, "material.kae_n_per_mm", Parameter::Kae)?;
        Ok(material)
    }

    fn coefficient(&self, value: &Number, key: &str) -> Result<f64, CaseError> {
        let size = [-COEFFICIENT_MAX_MPA, COEFFICIENT_MAX_MPA];
        self.sized(value, key, size, ("MPa", 1e6, "Pa"))
    }

    pub(super) fn cut(&mut self, file: &CutFile, tool: Option<&Tool>) -> Result<Cut, CaseError> {
        let (start, exit) = (*file.start_deg.get_ref(), *file.exit_deg.get_ref());
        let expected = if start > exit {
            format!(
                "an angle from 0 to below 180, and below exit_deg: a tooth enters at start_deg and leaves at exit_deg; start_deg = {exit} and \
                 exit_deg = {start} if the two are swapped"
            )
        } else {
            "an angle from 0 to below 180".into()
        };
        let start_deg = self.number(
            &file.start_deg,
            "cut.start_deg",
            |x| (0.0..180.0).contains(&x),
            &expected,
        )?;
        let exit_deg = self.number(
            &file.exit_deg,
            "cut.exit_deg",
            |x| x > start_deg && x <= 180.0,
            &format!("an angle above cut.start_deg ({start_deg}) and up to 180"),
        )?;
        let feed_per_tooth_mm = self.sized(
            &file.feed_per_tooth_mm,
            "cut.feed_per_tooth_mm",
            [0.0, FEED_PER_TOOTH_MAX_MM],
            ("mm", 1e3, "µm"),
        )?;
        if let Some(diameter_mm) = tool.and_then(|tool| tool.diameter_mm)
            && feed_per_tooth_mm >= diameter_mm
        {
            let expected = format!(
                "less than the diameter of the tool (tool.diameter_mm = {diameter_mm}; {:.3} if the diameter was in m)",
                1e3 * diameter_mm
            );
            return Err(self.wrong(
                &file.feed_per_tooth_mm,
                "cut.feed_per_tooth_mm",
                feed_per_tooth_mm,
                expected,
            ));
        }
        let feed_direction_deg = self.finite_or(&file.feed_direction_deg, "cut.feed_direction_deg", 0.0)?;
        self.deviation(&file.start_deg_std, "cut.start_deg", Parameter::Start)?;
        self.deviation(&file.exit_deg_std, "cut.exit_deg", Parameter::Exit)?;
        self.deviation(
            &file.feed_per_tooth_mm_std,
            "cut.feed_per_tooth_mm",
            Parameter::FeedPerTooth,
        )?;
        self.deviation(
            &file.feed_direction_deg_std,
            "cut.feed_direction_deg",
            Parameter::FeedDirection,
        )?;
        Ok(Cut {
            start_deg,
            exit_deg,
            feed_per_tooth_mm,
            feed_direction_deg,
        })
    }

    pub(super) fn posture(&self, file: PostureFile) -> Result<Posture, CaseError> {
        let index = match &file.index {
            None => 0,
            Some(index) => u8::try_from(*index.get_ref())
                .map_err(|_| self.wrong(index, "posture.index", index.get_ref(), "0 to 255"))?,
        };
        if let Some(joints) = &file.joints_deg
            && let Some(angle) = joints.get_ref().iter().find(|angle| !angle.is_finite())
        {
            return Err(self.wrong(joints, "posture.joints_deg", angle, "finite angles"));
        }
        Ok(Posture {
            index,
            joints_deg: file.joints_deg.map_or_else(Vec::new, Spanned::into_inner),
        })
    }
}
