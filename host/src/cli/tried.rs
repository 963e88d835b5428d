//! The table of tried cuts, to which `replay --tried` adds the outcome of a recorded cut.

use std::path::Path;

use super::Error;
use crate::file;
use crate::recording::{Sidecar, cut_table};
use crate::report::answer::VerdictLog;

/// Head of a new table of tried cuts.
const HEAD: &str = "rpm [rev/min],depth [mm],outcome,chatter [Hz]";

/// Adds the outcome of a recorded cut to the table of tried cuts at `table`, which is made if there is none: `chatter`
/// if the log has a verdict of chatter, otherwise `stable`. Speed and depth are those of the sidecar. The chatter
/// frequency is that of the first verdict of chatter; it is left empty if unknown, and left out under a head without
/// its column.
///
/// # Errors
/// The sidecar does not state speed or depth, the log has no verdict on a cut, the table cannot be read or written, is
/// no valid table of tried cuts, or has another head than [`HEAD`] with or without its last column.
pub(super) fn add(table: &Path, recording: &Path, sidecar: &Sidecar, log: &VerdictLog) -> Result<(), Error> {
    let of_cut = sidecar.cut.unwrap_or_default();
    let (Some(rpm), Some(depth_mm)) = (of_cut.spindle_rpm, of_cut.axial_depth_mm) else {
        return Err(Error::input(format!(
            "--tried: {} does not state the cut; add spindle_rpm and axial_depth_mm under [cut]",
            Sidecar::path_of(recording).display()
        )));
    };
    let chatter = log
        .verdicts
        .iter()
        .find(|verdict| matches!(verdict.verdict, "hopf" | "period-doubling"));
    let outcome = match chatter {
        Some(verdict) => match verdict.chatter_hz {
            Some(hertz) => format!("chatter,{hertz}"),
            None => "chatter,".into(),
        },
        None => {
            let cuts = |verdict: &&'static str| !matches!(*verdict, "air-cut" | "indeterminate");
            if !log.verdicts.iter().any(|entry| cuts(&entry.verdict)) {
                return Err(Error::input(format!(
                    "--tried: {} has no verdict on a cut; record a longer cut, or write its outcome into {} by hand",
                    recording.display(),
                    table.display()
                )));
            }
            "stable,".into()
        }
    };
    let before = if table.exists() {
        let text = file::read_text(table)?;
        // The whole table is checked, so that no row is added to one that cannot be read.
        cut_table::parse(table, &text)?;
        text
    } else {
        format!("{HEAD}\n")
    };
    let head = before
        .lines()
        .find(|line| !line.starts_with('#'))
        .unwrap_or_default();
    let row = match head.trim_start_matches('\u{feff}').trim() {
        HEAD => format!("{rpm},{depth_mm},{outcome}"),
        "rpm [rev/min],depth [mm],outcome" => {
            let outcome = outcome.split(',').next().unwrap_or_default();
            format!("{rpm},{depth_mm},{outcome}")
        }
        other => {
            return Err(Error::input(format!(
                "--tried {}: a row is only added under the head {HEAD}, and this table has {other}",
                table.display()
            )));
        }
    };
    let text = format!("{}\n{row}\n", before.trim_end());
    Ok(file::write(table, text.as_bytes())?)
}
