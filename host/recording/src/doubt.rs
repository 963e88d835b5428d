//! A column in doubt, and the message that names what the user can state about it.

/// A column whose meaning is not certain, and what the user can state about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubt {
    /// Description: column and what is not stated.
    pub what: String,
    /// Name of the column in the file.
    pub column: String,
    /// Channel name that is possible.
    pub name: String,
    /// Unit that is possible; `None` if the file states it.
    pub unit: Option<&'static str>,
    /// Sensitivity that is possible, if the column is a voltage.
    pub sensitivity: Option<&'static str>,
}

/// Joins doubts: what is not stated, the option and the lines of the sidecar that state it.
pub(super) fn doubts_text(doubts: &[Doubt], sidecar: &std::path::Path) -> String {
    let what: Vec<&str> = doubts.iter().map(|doubt| doubt.what.as_str()).collect();
    let map: Vec<String> = doubts
        .iter()
        .map(
            |Doubt {
                 column,
                 name,
                 unit,
                 sensitivity,
                 ..
             }| {
                let unit = sensitivity
                    .or(*unit)
                    .map_or_else(String::new, |unit| format!(":{unit}"));
                format!("{column}={name}{unit}")
            },
        )
        .collect();
    let map = map.join(",");
    // A shell splits words at blanks and reads brackets.
    let is_plain = map
        .chars()
        .all(|letter| letter.is_alphanumeric() || "=,:-_./^".contains(letter));
    let map = if is_plain { map } else { format!("\"{map}\"") };
    let lines: Vec<String> = doubts
        .iter()
        .map(|doubt| {
            let is_bare = doubt
                .column
                .chars()
                .all(|letter| letter.is_ascii_alphanumeric() || letter == '_' || letter == '-');
            let key = if is_bare {
                doubt.column.clone()
            } else {
                format!("\"{}\"", doubt.column)
            };
            let mut line = format!("[channels.{key}] name = \"{}\"", doubt.name);
            if doubt.sensitivity.is_none()
                && let Some(unit) = doubt.unit
            {
                line += &format!(", unit = \"{unit}\"");
            }
            if let Some(sensitivity) = doubt.sensitivity {
                line += &format!(", unit = \"V\", sensitivity = \"{sensitivity}\"");
            }
            line
        })
        .collect();
    format!(
        "{}; add --map {map} with the names and units that hold, or these keys to {}: {}",
        what.join("; "),
        sidecar.display(),
        lines.join("; ")
    )
}
