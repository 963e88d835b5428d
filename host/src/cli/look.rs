//! `quietcut look`: channels, units, rate and quality of a file, and the sidecar that states them.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::segment::RecordedSegment;
use super::{Error, Output};
use crate::frf::FrfTable;
use crate::recording::{ChannelSummary, Import, Imported, Recording, Sidecar, Understood, envelope};
use crate::report::digits::significant;

/// Shows how a file is understood: channels, units, sample rate, peaks, clipping, dropouts, and the sidecar that states
/// them.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --experiment hammer --direction y --force-n 300 --sample-rate-hz 512 --noise-percent 0.1 --out tap.csv\n  quietcut look tap.csv\n\n\
                  Recordings: CSV and other text tables, MAT (also v7.3), LVM, TDMS, UFF 58, WAV. Tables of frequency response functions: text tables, UFF 58.\n\
                  --map and --rate state what a file does not; --write-sidecar keeps it in NAME.toml beside the file, where every verb reads it."
)]
pub struct Args {
    /// Recordings or tables of frequency response functions.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    segment: RecordedSegment,
    /// Write the sidecar NAME.toml beside each recording. An existing file is not overwritten.
    #[arg(long)]
    write_sidecar: bool,
    #[command(flatten)]
    output: Output,
}

/// Output of `quietcut look --json`.
#[derive(Serialize)]
struct LookOutput {
    records: Vec<RecordOutput>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    tables: Vec<TableOutput>,
    written: Vec<PathBuf>,
}

/// One record of a file.
#[derive(Serialize)]
struct RecordOutput {
    #[serde(flatten)]
    understood: Understood,
    samples: usize,
    start_s: f64,
    duration_s: f64,
    channels: Vec<ChannelSummary>,
    sidecar: String,
}

/// Summary of one file that holds a table of frequency response functions.
#[derive(Serialize)]
struct TableOutput {
    file: PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    understood: Option<String>,
    frequency_hz: [f64; 2],
    lines: usize,
    receptances: Vec<ReceptanceSummary>,
}

/// Peak of one receptance, that is of one pair of response direction and force direction, over all frequency lines.
#[derive(Serialize)]
struct ReceptanceSummary {
    name: String,
    peak_hz: f64,
    peak_m_per_n: f64,
    has_coherence: bool,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let import = args.segment.import();
    let mut answer = LookOutput {
        records: Vec::new(),
        tables: Vec::new(),
        written: Vec::new(),
    };
    let mut text = String::new();
    for path in &args.files {
        refuse_other_kinds(path)?;
        if FrfTable::is_table(path, &import)? {
            let table = table(path, &import)?;
            text += &table.text();
            answer.tables.push(table);
            continue;
        }
        let before = Sidecar::beside(path)?;
        let mut sidecar = before.clone();
        for imported in Recording::import_all(path, &import)? {
            sidecar = imported.understood.sidecar(&sidecar);
            // The points that --map states stand in the sidecar of the recording.
            for (name, stated) in &imported.recording.sidecar.channels {
                if let (Some(at), Some(channel)) = (&stated.at, sidecar.channels.get_mut(name)) {
                    channel.at = Some(at.clone());
                }
            }
            let record = RecordOutput::new(&imported, sidecar.text(path)?);
            text += &record.text(&imported.recording);
            answer.records.push(record);
        }
        let target = Sidecar::path_of(path);
        if args.write_sidecar {
            if target.exists() {
                return Err(Error::input(format!(
                    "{}: the file exists and is not overwritten; add these lines to it:\n{}",
                    target.display(),
                    sidecar.text(path)?
                )));
            }
            sidecar.write_beside(path)?;
            // Writing to a String cannot fail.
            let _ = writeln!(text, "written: {}", target.display());
            answer.written.push(target);
        } else if sidecar != before {
            let _ = writeln!(
                text,
                "{} would state this (--write-sidecar writes it):\n{}",
                target.display(),
                sidecar.text(path)?.trim_end()
            );
        }
    }
    args.output.answer(&answer, text.trim_end())
}

/// Refuses lobe tables (`.qct`), cases and sidecars (`.toml`), which are neither recordings nor tables of frequency
/// response functions; the error names commands that show or check them.
fn refuse_other_kinds(path: &Path) -> Result<(), Error> {
    let what = match crate::file::ending(path).as_str() {
        "qct" => format!("a lobe table; quietcut table --show {} shows it", path.display()),
        "toml" => format!(
            "a case or the sidecar of a recording; quietcut lobes {} --at RPM,MM checks a case, and look shows a sidecar with its recording",
            path.display()
        ),
        _ => return Ok(()),
    };
    Err(Error::input(format!("{}: {what}", path.display())))
}

fn table(path: &Path, import: &Import) -> Result<TableOutput, Error> {
    let imported = FrfTable::import(path, import)?;
    let table = &imported.table;
    let frequency_hz = table.frequency_hz();
    let receptances = table.entries().iter().map(|entry| {
        let size = |line: usize| entry.receptance[line].norm();
        let at = (0..entry.receptance.len())
            .max_by(|&a, &b| size(a).total_cmp(&size(b)))
            .unwrap_or(0);
        ReceptanceSummary {
            name: entry.name(),
            peak_hz: frequency_hz[at],
            peak_m_per_n: size(at),
            has_coherence: entry.coherence.is_some(),
        }
    });
    Ok(TableOutput {
        file: path.into(),
        // This index is safe: a table of frequency response functions has at least one frequency line.
        frequency_hz: [frequency_hz[0], frequency_hz[frequency_hz.len() - 1]],
        lines: frequency_hz.len(),
        receptances: receptances.collect(),
        understood: imported.understood,
    })
}

impl TableOutput {
    fn text(&self) -> String {
        let [first, last] = self.frequency_hz;
        let mut text = format!(
            "{}: table of frequency response functions, {} lines from {first} to {last} Hz\n",
            self.file.display(),
            self.lines
        );
        if let Some(understood) = &self.understood {
            let _ = writeln!(text, "  understood: {understood}");
        }
        for receptance in &self.receptances {
            let _ = writeln!(
                text,
                "  H{}: largest receptance {} µm/N at {} Hz{}",
                receptance.name,
                significant(1e6 * receptance.peak_m_per_n, 5),
                significant(receptance.peak_hz, 5),
                if receptance.has_coherence {
                    ""
                } else {
                    ", no coherence"
                }
            );
        }
        text
    }
}

/// Largest width in characters of the picture of a channel: with its indentation by four a line has at most 68.
const WIDTH: usize = 64;

impl RecordOutput {
    fn new(imported: &Imported, sidecar: String) -> Self {
        let recording = &imported.recording;
        let rate = recording.sample_rate_hz;
        Self {
            understood: imported.understood.clone(),
            samples: recording.len(),
            start_s: recording.start_s,
            duration_s: recording.len() as f64 / rate,
            channels: recording
                .channels
                .iter()
                .map(|channel| ChannelSummary::of(channel, rate, recording.start_s))
                .collect(),
            sidecar,
        }
    }

    fn text(&self, recording: &Recording) -> String {
        let Understood {
            file,
            record,
            sample_rate_hz,
            rate_from,
            columns,
            notes,
            warnings,
        } = &self.understood;
        let mut text = format!("{}", file.display());
        if let Some(record) = record {
            // Writing to a String cannot fail.
            let _ = write!(text, ", {record}");
        }
        let _ = writeln!(
            text,
            ": {} samples, {:.6} s, {sample_rate_hz} samples/s ({rate_from})",
            self.samples, self.duration_s
        );
        for column in columns {
            let unit = column.unit.as_deref().unwrap_or("no unit");
            let from = match column.from {
                crate::recording::Basis::Head => "by its name",
                crate::recording::Basis::Words => "by its words and unit",
                crate::recording::Basis::Sidecar => "by the sidecar",
                crate::recording::Basis::Option => "by --map",
                crate::recording::Basis::Auxiliary => "auxiliary",
            };
            let sign = if column.is_negative { "-" } else { "" };
            let _ = writeln!(
                text,
                "  column {} [{unit}]: {sign}{} ({from})",
                column.column, column.channel
            );
        }
        for (summary, channel) in self.channels.iter().zip(&recording.channels) {
            let unit = match summary.unit {
                "unknown" => "(no unit)",
                "1" => "",
                unit => unit,
            };
            let _ = writeln!(
                text,
                "  {}: peak {}, RMS {}, mean {}",
                summary.channel,
                shown(summary.peak, unit),
                shown(summary.rms, unit),
                shown(summary.mean, unit)
            );
            let _ = writeln!(text, "    {}", picture(&channel.samples));
            if summary.constant {
                let _ = writeln!(text, "    constant: all samples are equal");
            }
            if summary.clipped > 0 {
                let _ = writeln!(
                    text,
                    "    clipped: {} samples stay at the largest or smallest value; record again with a larger range of the sensor",
                    summary.clipped
                );
            }
            if let Some([from, to]) = summary.dropouts_s.first() {
                let _ = writeln!(
                    text,
                    "    dropouts: {}, the first from {from:.6} to {to:.6} s",
                    summary.dropouts_s.len()
                );
            }
        }
        for note in notes {
            let _ = writeln!(text, "  note: {note}");
        }
        for warning in warnings {
            let _ = writeln!(text, "  warning: {warning}");
        }
        text
    }
}

/// A number with its unit and four significant digits; some units get a prefix for a nonzero size below 0.1 or of 10⁴
/// and more.
fn shown(value: f64, unit: &str) -> String {
    // Values in these units may get a prefix; values in other units, such as g, get none.
    let takes_prefix = matches!(unit, "m" | "N" | "V" | "m/s" | "m/s^2" | "Pa");
    let (factor, prefix) = match value.abs() {
        _ if !takes_prefix => (1.0, ""),
        size if size == 0.0 || (1e-1..1e4).contains(&size) => (1.0, ""),
        size if size >= 1e4 => (1e-3, "k"),
        size if size >= 1e-4 => (1e3, "m"),
        size if size >= 1e-7 => (1e6, "µ"),
        _ => (1e9, "n"),
    };
    format!("{} {prefix}{unit}", significant(value * factor, 4))
        .trim_end()
        .into()
}

/// Picture of a channel over time, drawn with block characters in one line: the largest deviation from the mean of the
/// channel in each part of the record, relative to the largest in any part.
fn picture(samples: &[f64]) -> String {
    const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    envelope(samples, WIDTH)
        .into_iter()
        .map(|part| BLOCKS[((part * 8.0) as usize).min(7)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits_and_pictures_the_width_of_a_terminal() {
        for (value, unit, text) in [
            (812.34, "N", "812.3 N"),
            (0.001_234_1, "m", "1.234 mm"),
            (12_345.6, "m/s^2", "12.35 km/s^2"),
            (1e-9, "m", "1.000 nm"),
            (0.001_234_1, "", "0.001234"),
            (0.0, "N", "0 N"),
        ] {
            assert_eq!(shown(value, unit), text);
        }
        assert_eq!(picture(&vec![1.0; 1000]).chars().count(), WIDTH);
        assert!(picture(&[0.0, 1.0, 0.0, -1.0]).contains('█'));
    }
}
