//! The case with what was found.

use std::fmt::Write as _;

use super::answer::{Diagnosis, Outcome};
use crate::case::Case;

impl Diagnosis {
    /// The extended case; `None` where nothing was found.
    pub fn extended(&self, case: &Case) -> Option<Case> {
        let found = &self.causes[..self.acting];
        (!found.is_empty()).then(|| {
            let mut extended = case.clone();
            let tables = found
                .iter()
                .map(|cause| (cause.name.to_owned(), cause.extension.clone()));
            extended.extensions.extend(tables);
            extended
        })
    }

    /// The text of the extended case: that of the case, with a table `[extension.NAME]` for each cause that acts, and
    /// standard deviations of its parameters as comments. `None` where nothing was found.
    ///
    /// Where causes are confounded, those named first are taken.
    pub fn extended_case(&self, case_text: &str) -> Option<String> {
        if !matches!(self.outcome, Outcome::Cause | Outcome::Confounded) {
            return None;
        }
        let mut text = case_text.trim_end().to_owned();
        text.push('\n');
        for cause in self.causes.iter().take(self.acting) {
            // Writing to a string cannot fail.
            let _ = write!(text, "\n[extension.{}]\n", cause.name);
            for (key, value) in &cause.extension {
                let interval = cause
                    .parameters
                    .get(key.as_str())
                    .map_or_else(String::new, |figure| {
                        format!(
                            " # 90 % interval {:.6e} to {:.6e}",
                            figure.ci90[0], figure.ci90[1]
                        )
                    });
                let _ = writeln!(text, "{key} = {value}{interval}");
            }
        }
        Some(text)
    }
}
