//! Reads the spindle speeds at which the structure of the case holds, and its modes at further speeds.

use toml::Spanned;

use super::Check;
use crate::case::CaseError;
use crate::case::file::{AtSpeedFile, Number, StructureFile};
use crate::criteria::SPEED_MAX_RPM;
use crate::structure::{Form, ModesAtSpeed, SpeedDependence, Structure};

impl Check<'_> {
    /// The spindle speed at which the structure holds, rev/min; `None` if the case does not state it.
    pub(super) fn structure_rpm(&self, file: &StructureFile) -> Result<Option<f64>, CaseError> {
        let rpm = file.rpm.as_ref();
        rpm.map(|rpm| self.speed(rpm, "structure.rpm")).transpose()
    }

    fn speed(&self, rpm: &Number, key: &str) -> Result<f64, CaseError> {
        let expected = format!("a spindle speed of 0 (standstill) to {SPEED_MAX_RPM} rev/min");
        self.number(rpm, key, |rpm| (0.0..=SPEED_MAX_RPM).contains(&rpm), &expected)
    }

    /// The dependence of the structure on the spindle speed; `None` without `[[structure.at_speed]]`.
    pub(super) fn speed_dependence(
        &self,
        file: &Spanned<StructureFile>,
        structure: &Structure,
    ) -> Result<Option<SpeedDependence>, CaseError> {
        let Some(tables) = &file.get_ref().at_speed else {
            return Ok(None);
        };
        let Some(first) = tables.first() else {
            return Ok(None);
        };
        let key = "structure.at_speed";
        let Form::Modes(modes) = &structure.form else {
            return Err(self.wrong(
                first,
                key,
                "a structure without modes",
                "kind = \"modes\", since modes are interpolated over the speed,",
            ));
        };
        let Some(rpm) = self.structure_rpm(file.get_ref())? else {
            return Err(self.wrong(
                first,
                key,
                "no structure.rpm",
                "rpm = 0.0 under [structure], the speed at which its modes hold (0: standstill),",
            ));
        };
        let base = ModesAtSpeed {
            rpm,
            modes: modes.clone(),
        };
        let others = tables.iter().enumerate();
        let others = others
            .map(|(index, table)| self.modes_at_speed(table.get_ref(), index, structure.directions.len()))
            .collect::<Result<_, _>>()?;
        match SpeedDependence::new(base, others) {
            Ok(dependence) => Ok(Some(dependence)),
            Err(error) => Err(self.wrong(
                first,
                key,
                format!("structures that cannot be followed over the speed: {error}"),
                "a structure with the same modes at each speed",
            )),
        }
    }

    fn modes_at_speed(
        &self,
        file: &AtSpeedFile,
        index: usize,
        size: usize,
    ) -> Result<ModesAtSpeed, CaseError> {
        let table = format!("structure.at_speed[{}]", index + 1);
        let modes = file.mode.iter().enumerate();
        Ok(ModesAtSpeed {
            rpm: self.speed(&file.rpm, &format!("{table}.rpm"))?,
            modes: modes
                .map(|(mode, file)| {
                    self.poles_and_shapes(
                        (&file.frequency_hz, &file.damping_ratio),
                        (&file.left, &file.right),
                        size,
                        |name| format!("{table}.mode[{}].{name}", mode + 1),
                    )
                })
                .collect::<Result<_, _>>()?,
        })
    }
}
