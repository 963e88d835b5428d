//! Reads the tool from the case file: teeth, edge angle, diameter, pitch and runout.

use toml::Spanned;

use super::Check;
use crate::case::file::ToolFile;
use crate::case::{CaseError, Parameter};
use crate::criteria::{DIAMETER_MM, PITCH_SUM_DEG, TEETH_MAX};
use crate::milling::{Runout, Tool};

impl Check<'_> {
    pub(super) fn tool(&mut self, file: &ToolFile) -> Result<Tool, CaseError> {
        let teeth = *file.teeth.get_ref();
        if !(1..=TEETH_MAX).contains(&teeth) {
            let expected = format!("a whole number of teeth from 1 to {TEETH_MAX}");
            return Err(self.wrong(&file.teeth, "tool.teeth", teeth, expected));
        }
        // The number of teeth is from 1 to TEETH_MAX, so that the conversion is exact.
        let teeth = teeth as usize;
        let edge_angle_deg = self.number(
            &file.edge_angle_deg,
            "tool.edge_angle_deg",
            |x| x > 0.0 && x <= 90.0,
            "an angle above 0 and up to 90",
        )?;
        let diameter_mm = match &file.diameter_mm {
            Some(diameter) => {
                Some(self.sized(diameter, "tool.diameter_mm", DIAMETER_MM, ("mm", 1e3, "µm"))?)
            }
            None => None,
        };
        self.deviation(
            &file.edge_angle_deg_std,
            "tool.edge_angle_deg",
            Parameter::EdgeAngle,
        )?;
        Ok(Tool {
            teeth,
            edge_angle_deg,
            diameter_mm,
            pitch_deg: self.pitch(&file.pitch_deg, teeth)?,
            runout: self.runout(file)?,
        })
    }

    fn pitch(&self, pitch: &Option<Spanned<Vec<f64>>>, teeth: usize) -> Result<Vec<f64>, CaseError> {
        let Some(pitch) = pitch else {
            return Ok(vec![360.0 / teeth as f64; teeth]);
        };
        let angles = pitch.get_ref();
        let key = "tool.pitch_deg";
        if angles.len() != teeth {
            let found = format!("{} angles", angles.len());
            return Err(self.wrong(pitch, key, found, format!("one angle for each of {teeth} teeth")));
        }
        if let Some(angle) = angles.iter().find(|angle| !(angle.is_finite() && **angle > 0.0)) {
            return Err(self.wrong(pitch, key, angle, "angles greater than 0"));
        }
        let sum: f64 = angles.iter().sum();
        if (sum - 360.0).abs() > PITCH_SUM_DEG {
            return Err(self.wrong(pitch, key, format!("the sum {sum}"), "angles that sum to 360"));
        }
        Ok(angles.iter().map(|angle| angle * 360.0 / sum).collect())
    }

    fn runout(&mut self, file: &ToolFile) -> Result<Option<Runout>, CaseError> {
        let angle_deg = self.finite_or(&file.runout_angle_deg, "tool.runout_angle_deg", 0.0)?;
        self.deviation(&file.runout_um_std, "tool.runout_um", Parameter::RunoutOffset)?;
        self.deviation(
            &file.runout_angle_deg_std,
            "tool.runout_angle_deg",
            Parameter::RunoutAngle,
        )?;
        match (&file.runout_um, &file.runout_angle_deg) {
            (Some(offset), _) => {
                let offset_um = self.number(offset, "tool.runout_um", |x| x >= 0.0, "0 or more")?;
                Ok(Some(Runout { offset_um, angle_deg }))
            }
            (None, Some(angle)) => Err(self.wrong(
                angle,
                "tool.runout_angle_deg",
                "an angle alone",
                "runout_um beside it",
            )),
            (None, None) => Ok(None),
        }
    }
}
