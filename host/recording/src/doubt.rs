//! A column of a recorded file whose meaning is in doubt, and the message that names what the user can state about it.

use super::channel_section::channel_section;

/// A column of a recorded file whose meaning is not certain, and a proposal of what the user can state about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubt {
    /// Sentence part: the column in doubt and what the file does not state about it.
    pub what: String,
    /// Name of the column in the file.
    pub column: String,
    /// Channel name that is possible.
    pub name: String,
    /// Proposed unit of the column in doubt; `None` if its unit is stated, or if a sensitivity is proposed.
    pub unit: Option<&'static str>,
    /// Proposed sensitivity of the sensor, if the column in doubt is a voltage; `None` otherwise.
    pub sensitivity: Option<&'static str>,
}

/// Message about columns in doubt: what the file does not state, and the option `--map` and the lines of the sidecar
/// that would state it.
pub(super) fn doubts_text(doubts: &[Doubt], lacks_rate: bool, sidecar: &std::path::Path) -> String {
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
    // The proposed option is quoted unless all its characters are plain, since a shell splits words at blanks and
    // interprets brackets.
    let is_plain = map
        .chars()
        .all(|letter| letter.is_alphanumeric() || "=,:-_./^".contains(letter));
    let map = if is_plain { map } else { format!("\"{map}\"") };
    let lines: Vec<String> = doubts
        .iter()
        .map(|doubt| {
            let mut line = format!("{} name = \"{}\"", channel_section(&doubt.column), doubt.name);
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
    let (rate, holds, key, no_rate) = if lacks_rate {
        (
            " --rate 25600",
            "names, units and rate",
            "sample_rate_hz = 25600; ",
            "; nor does it state the sample rate",
        )
    } else {
        ("", "names and units", "", "")
    };
    format!(
        "{}{no_rate}; add --map {map}{rate} with the {holds} that hold, or these keys to {}: {key}{}",
        what.join("; "),
        sidecar.display(),
        lines.join("; ")
    )
}
