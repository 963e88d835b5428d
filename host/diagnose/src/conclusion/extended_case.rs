//! The case with the extensions of the estimated causes.

use std::fmt::Write as _;

use toml::Table;

use crate::candidates::extension_tables::joined;
use crate::conclusion::answer::{Diagnosis, EstimatedCause, Figure, Outcome};
use crate::conclusion::lobes::IntervalEnds;
use crate::conclusion::updated_case::updated;
use quietcut_model::case::Case;

/// TOML comment with the 90 % intervals of the parameter `key` in all `causes` that have it, numbered keys (`ratio_1`,
/// `ratio_2` …) included; empty if none has it.
fn intervals(causes: &[&EstimatedCause], key: &str) -> String {
    let is_of_key = |known: &str| {
        let behind = known
            .strip_prefix(key)
            .map(|rest| rest.strip_prefix('_').unwrap_or(rest));
        behind.is_some_and(|number| number.chars().all(|digit| digit.is_ascii_digit()))
    };
    let said: Vec<String> = causes
        .iter()
        .flat_map(|cause| &cause.parameters)
        .filter(|(known, _)| is_of_key(known))
        .map(|(_, Figure { ci90: [from, to], .. })| format!("{from:.6e} to {to:.6e}"))
        .collect();
    if said.is_empty() {
        String::new()
    } else {
        format!(" # 90 % interval {}", said.join(", "))
    }
}

impl Diagnosis {
    fn found(&self) -> impl Iterator<Item = (&str, &Table)> {
        let found = self.causes.iter().take(self.acting);
        found.map(|cause| (cause.name, &cause.extension))
    }

    /// The case with the extensions of the acting causes and the values of its uncertain parameters after the records; `None` if
    /// the outcome is none of a cause, confounded and update, or a value is not valid.
    pub fn extended(&self, case: &Case) -> Option<Case> {
        if !self.extends() {
            return None;
        }
        let mut extended = case.clone();
        extended.extensions.extend(joined(self.found()));
        let is_valid = self
            .posterior
            .as_ref()
            .is_none_or(|posterior| posterior.shift(&mut extended));
        is_valid.then_some(extended)
    }

    fn extends(&self) -> bool {
        self.acting > 0 || self.outcome == Outcome::Update
    }

    /// The extended case with parameters at both ends of the 90 % interval along each principal direction of the
    /// correlation of a cause's fitted parameters, for one cause after the other. The parameters of different causes
    /// are taken as independent, and those of the case are at their values after the records.
    pub fn moved(&self, case: &Case) -> Vec<IntervalEnds> {
        let found = &self.causes[..self.acting];
        let choices = found
            .iter()
            .map(|cause| cause.choice)
            .max()
            .map_or(0, |last| last + 1);
        let Some(center) = self.extended(case) else {
            return Vec::new();
        };
        let mut all = Vec::new();
        for choice in 0..choices {
            let directions = found
                .iter()
                .find(|cause| cause.choice == choice)
                .map_or(0, |cause| cause.moved.len());
            for direction in 0..directions {
                all.push([0, 1].map(|end| {
                    let tables = found.iter().map(|cause| match cause.choice == choice {
                        true => (cause.name, &cause.moved[direction][end]),
                        false => (cause.name, &cause.extension),
                    });
                    let mut moved = center.clone();
                    moved.extensions.extend(joined(tables));
                    moved
                }));
            }
        }
        all
    }

    /// The text of the extended case: that of the case, with its uncertain parameters after the records, a table
    /// `[extension.NAME]` for each acting cause, and the 90 % intervals of its parameters as comments. `None` if the outcome is none
    /// of a cause, confounded and update.
    ///
    /// Of confounded candidate models it contains the first.
    pub fn extended_case(&self, case_text: &str) -> Option<String> {
        if !self.extends() {
            return None;
        }
        let mut text = match &self.posterior {
            Some(posterior) => updated(case_text, posterior)?,
            None => case_text.into(),
        };
        text.truncate(text.trim_end().len());
        text.push('\n');
        let found = &self.causes[..self.acting];
        for (name, table) in joined(self.found()) {
            let causes: Vec<&EstimatedCause> = found.iter().filter(|cause| cause.name == name).collect();
            // Writing to a string cannot fail.
            let _ = write!(text, "\n[extension.{name}]\n");
            for (key, value) in &table {
                let _ = writeln!(text, "{key} = {value}{}", intervals(&causes, key));
            }
        }
        Some(text)
    }
}
