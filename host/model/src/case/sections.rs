//! Required keys of sections of a case, with units and example values, for messages about a missing section or key.

/// A section of a case with its required keys.
pub(super) struct Section {
    name: &'static str,
    /// Each required key with its unit or meaning and an example value.
    keys: &'static [(&'static str, &'static str, &'static str)],
}

/// Sections whose required keys are the same in every case.
const SECTIONS: [Section; 5] = [
    Section {
        name: "tool",
        keys: &[
            ("teeth", "number of teeth", "2"),
            ("edge_angle_deg", "degrees; 90 is a square end mill", "90.0"),
        ],
    },
    Section {
        name: "material",
        keys: &[
            ("ktc_mpa", "MPa, tangential cutting coefficient", "700.0"),
            ("krc_mpa", "MPa, radial cutting coefficient", "210.0"),
            ("kac_mpa", "MPa, axial cutting coefficient", "0.0"),
        ],
    },
    Section {
        name: "cut",
        keys: &[
            ("start_deg", "degrees, where a tooth enters", "90.0"),
            ("exit_deg", "degrees, where a tooth leaves", "180.0"),
            ("feed_per_tooth_mm", "mm", "0.1"),
        ],
    },
    Section {
        name: "limits",
        keys: &[
            ("rpm_min", "rev/min, slowest speed", "600.0"),
            ("rpm_max", "rev/min, fastest speed", "12000.0"),
        ],
    },
    Section {
        name: "uncertainty",
        keys: &[
            (
                "parameters",
                "names of uncertain parameters",
                "[\"material.ktc_mpa\"]",
            ),
            ("covariance", "one row for each parameter", "[[400.0]]"),
        ],
    },
];

impl Section {
    /// The section of this name; `None` if it is not among the [`SECTIONS`].
    pub(super) fn of(name: &str) -> Option<&'static Self> {
        SECTIONS.iter().find(|section| section.name == name)
    }

    /// The section whose header is the last one among the first `line` lines of the text of a case; `None` if there is
    /// no header, or if the section is not among the [`SECTIONS`].
    pub(super) fn at(text: &str, line: usize) -> Option<&'static Self> {
        let headers = text.lines().take(line).filter_map(|line| {
            let header = line.trim().strip_prefix('[')?;
            let name = header.trim_start_matches('[').split(']').next()?.trim();
            // A row of a matrix over several lines begins with a bracket too.
            name.starts_with(|first: char| first.is_alphabetic())
                .then_some(name)
        });
        Self::of(headers.last()?)
    }

    /// Required keys that a table of this section lacks.
    fn missing(&self, table: &toml::Table) -> Vec<&(&'static str, &'static str, &'static str)> {
        self.keys
            .iter()
            .filter(|(key, ..)| !table.contains_key(*key))
            .collect()
    }

    /// Message part: all required keys that the section lacks in the text of a case, with units, and lines to paste;
    /// `None` if it lacks none, or if the text is no TOML or has no such section.
    pub(super) fn lacks(&self, text: &str) -> Option<String> {
        let case: toml::Table = text.parse().ok()?;
        let missing = self.missing(case.get(self.name)?.as_table()?);
        (!missing.is_empty()).then(|| format!("[{}] lacks {}", self.name, described(&missing)))
    }

    /// Message part: the advice to add this section, with its required keys.
    pub(super) fn whole(&self) -> String {
        let keys: Vec<_> = self.keys.iter().collect();
        format!("add [{}] with {}", self.name, described(&keys))
    }
}

/// Keys with their units, and the lines to paste.
fn described(keys: &[&(&str, &str, &str)]) -> String {
    let words: Vec<String> = keys
        .iter()
        .map(|(key, unit, _)| format!("{key} ({unit})"))
        .collect();
    let lines: String = keys
        .iter()
        .map(|(key, _, example)| format!("\n  {key} = {example}"))
        .collect();
    format!("{}, such as{lines}", words.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_a_matrix_is_no_header() {
        let text = "[tool]\nteeth = 2\n[ uncertainty ] # of the material\ncovariance = [\n  [400.0, 1.0],\n[1.0]\n]\n\n[[cuts]]\n";
        let at = |line| Section::at(text, line).map(|section| section.name);
        assert_eq!(
            [at(2), at(4), at(7)],
            [Some("tool"), Some("uncertainty"), Some("uncertainty")]
        );
        assert_eq!(at(9), None);
    }
}
