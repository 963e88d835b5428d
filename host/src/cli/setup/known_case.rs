//! Completing a case that exists: the sections that it lacks, and what it already says.

use super::given::Given;
use crate::case::Case;
use crate::cli::Error;
use crate::machine::Section;

/// Sections that `setup` can write and the case lacks, in the order of a case file.
pub(super) fn missing_sections(case: &Case) -> Vec<Section> {
    Section::ALL
        .into_iter()
        .filter(|section| match section {
            Section::Tool => case.tool.is_none(),
            Section::Material => case.material.is_none(),
            Section::Cut => case.cut.is_none(),
            Section::Limits => case.limits.is_none(),
        })
        .collect()
}

impl Given {
    /// Refuses options of the command line about sections that the case already has: they would change nothing.
    ///
    /// # Errors
    /// The first such option, with its section.
    pub(super) fn check_missing(&self, case: &Case) -> Result<(), Error> {
        let missing = missing_sections(case);
        let given = [
            (self.teeth.is_some(), "--teeth", Section::Tool),
            (self.diameter_mm.is_some(), "--diameter-mm", Section::Tool),
            (self.edge_angle_deg.is_some(), "--edge-angle-deg", Section::Tool),
            (self.material.is_some(), "--material", Section::Material),
            (self.ktc_mpa.is_some(), "--ktc-mpa", Section::Material),
            (self.down_milling_mm.is_some(), "--down-milling-mm", Section::Cut),
            (self.up_milling_mm.is_some(), "--up-milling-mm", Section::Cut),
            (self.slot, "--slot", Section::Cut),
            (
                self.feed_per_tooth_mm.is_some(),
                "--feed-per-tooth-mm",
                Section::Cut,
            ),
            (self.rpm.is_some(), "--rpm", Section::Limits),
            (self.power_w.is_some(), "--power-w", Section::Limits),
            (self.torque_nm.is_some(), "--torque-nm", Section::Limits),
        ];
        // The diameter of the tool is also needed for the immersion of a cut, where the case does not give it.
        let lacks_diameter = case.tool.as_ref().is_some_and(|tool| tool.diameter_mm.is_none());
        let in_vain = given.into_iter().find(|(is_given, option, section)| {
            *is_given && !missing.contains(section) && !(lacks_diameter && *option == "--diameter-mm")
        });
        match in_vain {
            Some((_, option, section)) => Err(Error::input(format!(
                "{option}: {} already has the section [{}]; change it there, or write the whole case anew with --replace",
                case.path.display(),
                section.name()
            ))),
            None => Ok(()),
        }
    }

    /// These answers, completed so that only what the missing sections of `case` need is asked for. Answers for
    /// sections that the case has are not written: any valid value stands for them.
    pub(super) fn known_from(self, case: &Case) -> Self {
        let tool = case.tool.as_ref();
        let has_cut = case.cut.is_some();
        let diameter_mm = tool.and_then(|tool| tool.diameter_mm);
        let known = Self {
            teeth: tool.and_then(|tool| u8::try_from(tool.teeth).ok()?.try_into().ok()),
            // With a known cut no immersion is computed, and any diameter serves.
            diameter_mm: diameter_mm.or((tool.is_some() && has_cut).then_some(1.0)),
            ktc_mpa: case.material.as_ref().map(|_| 1.0),
            slot: has_cut,
            feed_per_tooth_mm: case.cut.as_ref().map(|cut| cut.feed_per_tooth_mm),
            rpm: case.limits.as_ref().map(|_| "1:2".into()),
            ..Self::default()
        };
        self.or(known)
    }
}
