//! Report of the import of a file: which column became which channel, the sample rate, notes and warnings.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use super::{RecordedChannel, Sidecar};

/// Report of the import of one record: which column became which channel, with unit and sample rate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Understood {
    /// The file.
    pub file: PathBuf,
    /// Name of the group (TDMS), structure element (MAT) or block (LabVIEW) that holds the record; `None` for the only
    /// record of a TDMS or LabVIEW file, for variables of a MAT-file outside structures, and in other formats.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub record: Option<String>,
    /// Sample rate, samples per second.
    pub sample_rate_hz: f64,
    /// Source of the sample rate: `time column`, `file`, `sidecar` or `option`.
    pub rate_from: &'static str,
    /// Columns of the record in the order of the file, the time column included.
    pub columns: Vec<UnderstoodColumn>,
    /// Other facts about the reading of the record: separator, encoding, omitted columns.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Warnings, such as that a unit is probably wrong.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

/// Meaning of one column.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnderstoodColumn {
    /// Name of the column in the file.
    pub column: String,
    /// Name of the channel that the column became; `t` is time.
    pub channel: String,
    /// True if the sensor points against its axis, so that the samples of the channel changed their sign.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_negative: bool,
    /// Unit of the column, as the file, the sidecar or the option states it; `None` if none of them does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Sensitivity that converts the voltage in the column, in volts per SI unit, from the sidecar or the option;
    /// `None` if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity: Option<String>,
    /// SI unit of the samples of the channel.
    pub si_unit: &'static str,
    /// Reason for the meaning.
    pub from: Basis,
}

/// Reason why a column of a file became this channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Basis {
    /// The head of the column is a channel name, such as `ax`, or `time`.
    Head,
    /// Words in the head of the column, such as `Hammer` or `Acc X`, name the channel.
    Words,
    /// The sidecar names the channel.
    Sidecar,
    /// The user names the channel with the option `--map`.
    Option,
    /// Neither name nor unit shows the column to be a force, a motion, a tachometer or the time of the record: it is an
    /// auxiliary channel.
    Auxiliary,
}

impl Understood {
    /// True if the user should see how the file was read: a meaning comes from words or the option, the sample rate
    /// from the option, or there are notes or warnings.
    pub fn is_interpreted(&self) -> bool {
        !self.notes.is_empty()
            || !self.warnings.is_empty()
            || self.rate_from == "option"
            || self
                .columns
                .iter()
                .any(|column| matches!(column.from, Basis::Words | Basis::Option))
    }
}

impl Understood {
    /// A sidecar that states the result of the import: `before` with name, unit and sensitivity of every column that
    /// was understood from its words, the sidecar or an option, and with the sample rate if the sidecar or an option
    /// gave it.
    #[must_use]
    pub fn sidecar(&self, before: &Sidecar) -> Sidecar {
        let mut sidecar = before.clone();
        if matches!(self.rate_from, "option" | "sidecar") {
            sidecar.sample_rate_hz = Some(self.sample_rate_hz);
        }
        for column in &self.columns {
            if matches!(column.from, Basis::Head | Basis::Auxiliary) {
                continue;
            }
            let said = sidecar.channels.entry(column.column.clone()).or_default();
            let sign = if column.is_negative { "-" } else { "" };
            *said = RecordedChannel {
                name: Some(format!("{sign}{}", column.channel)),
                unit: column.unit.clone(),
                sensitivity: column.sensitivity.clone(),
                ..said.clone()
            };
        }
        sidecar
    }
}

impl fmt::Display for Understood {
    /// Report of an import in one line: file, record, sample rate, columns with unit and channel, notes, warnings.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(record) = &self.record {
            write!(f, ", {record}")?;
        }
        write!(f, ": {} samples/s ({})", self.sample_rate_hz, self.rate_from)?;
        for column in &self.columns {
            let unit = column.unit.as_deref().unwrap_or("no unit");
            let sign = if column.is_negative { "-" } else { "" };
            match column.from {
                Basis::Auxiliary => write!(f, "; {} [{unit}] is no force or motion", column.column)?,
                _ => write!(f, "; {} [{unit}] is {sign}{}", column.column, column.channel)?,
            }
        }
        for note in self.notes.iter().chain(&self.warnings) {
            write!(f, "; {note}")?;
        }
        Ok(())
    }
}
