//! The one next useful command for a machine, from what its folder holds.

use std::path::Path;
use std::time::SystemTime;

use serde::Serialize;

use super::contradiction::contradiction;
use super::folder::{BrokenFile, DatedFile, FileKind, MachineFolder};
use super::spindle_speed::has_turned;
use crate::recording::{Import, Recording, Sidecar, cut_table};

/// Next useful command for a machine, with its reason.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextStep {
    /// State of the machine's folder: statements about its files, then one for each file that cannot be read.
    pub state: Vec<String>,
    /// The command to run next.
    pub command: String,
    /// Effect of the proposed command, and the reason why it is the next.
    pub why: String,
}

/// Number of spindle speeds of the proposed stability chart. The chart adds speeds between them where limits bend.
const CHART_SPEEDS: usize = 60;

/// Largest axial depth of the proposed stability chart, mm, where the case gives no tool diameter. With a diameter the
/// chart is one diameter deep, the usual limit of a slot.
const DEEPEST_MM: f64 = 10.0;

/// Finds the next useful command for the machine of `folder`.
pub fn next_step(folder: &MachineFolder) -> NextStep {
    let at = |name: &str| quoted(&folder.path.join(name));
    let case = at("case.toml");
    let state = state(folder);
    let step = |command: String, why: &str| NextStep {
        state: state.clone(),
        command,
        why: why.into(),
    };
    let Some((case_file, content)) = &folder.case else {
        return step(
            format!("quietcut setup {}", quoted(&folder.path)),
            "a case file says which machine, tool, material and cut this is; everything else needs it",
        );
    };
    if let Some(BrokenFile { kind, path, reason }) = folder.broken.first() {
        let file = quoted(path);
        let (command, what) = match kind {
            FileKind::Recording | FileKind::Receptances => (
                format!("quietcut look {file}"),
                "the command shows how the file is understood; mend the file as its message says, or remove it",
            ),
            FileKind::TriedCuts => (
                format!("quietcut lobes {case} {} --cuts {file}", ranges(folder)),
                "mend the table as the message says; the command then counts the cuts that are predicted wrong",
            ),
            FileKind::LobeTable => (
                format!("quietcut table {case} --out {file}"),
                "the command builds the table anew",
            ),
        };
        return step(command, &format!("a file cannot be read: {reason}; {what}"));
    }
    let newest = |files: &[DatedFile]| files.iter().map(|file| file.changed).max();
    let (taps, receptances) = (newest(&folder.taps), newest(&folder.receptances));
    if taps > receptances {
        let command = format!(
            "quietcut frf {} --out {} --out {}",
            list(&folder.taps),
            at("frf/tool-tip.csv"),
            at("frf/tool-tip.svg")
        );
        return step(
            command,
            "the taps are newer than the frequency response functions in frf/; the command estimates these from the taps",
        );
    }
    if content.structure.is_none() {
        return match folder.receptances.last() {
            Some(_) => step(
                identify(folder, &case),
                "the case has no structure; the command fits modes to the frequency response functions of the taps, or to those in frf/, and writes them into the case, with the speed of the tachometer or, without its pulses, --rpm 0 as measured at standstill",
            ),
            None => step(
                format!(
                    "quietcut frf {} --out {}",
                    at("taps/*.csv"),
                    at("frf/tool-tip.csv")
                ),
                "there are no taps yet: tap the tool tip in x, then in y, five times each, and save the recordings in taps/; then run this command",
            ),
        };
    }
    if receptances > Some(case_file.changed) {
        return step(
            identify(folder, &case),
            "the frequency response functions are newer than the case; the command fits its modes again",
        );
    }
    let missing = [
        ("tool", content.tool.is_none()),
        ("material", content.material.is_none()),
        ("cut", content.cut.is_none()),
    ];
    if let Some((section, _)) = missing.iter().find(|(_, missing)| *missing) {
        return step(
            format!("quietcut setup {}", quoted(&folder.path)),
            &format!("the case has no section [{section}], which limits need; the command asks for it"),
        );
    }
    if content.limits.is_none() {
        return step(
            format!("quietcut setup {} --rpm FIRST:LAST", quoted(&folder.path)),
            "the case has no section [limits]: without the lowest and highest speed of the spindle in rev/min, FIRST and LAST, charts and \
             advice assume that every speed is possible; the command keeps them in the case",
        );
    }
    let newer_than_case = |file: &Option<DatedFile>| is_newer(file, case_file.changed);
    let ranges = ranges(folder);
    if !newer_than_case(&folder.chart) {
        let tried = folder
            .tried
            .as_ref()
            .map_or_else(String::new, |file| format!(" --cuts {}", quoted(&file.path)));
        return step(
            format!("quietcut lobes {case} {ranges}{tried} --out {}", at("lobes.html")),
            "the case is newer than the chart; the command draws the stable depths over the spindle speed",
        );
    }
    if !newer_than_case(&folder.table) {
        return step(
            format!("quietcut table {case} --out {}", at("table.qct")),
            "the case is newer than the lobe table of the device; the command builds the table",
        );
    }
    after_the_chart(folder, &step)
}

/// The next step of a machine whose chart and lobe table are not older than its case: about its cuts, the case that
/// the diagnosis extended, or the upload of the lobe table.
fn after_the_chart(folder: &MachineFolder, step: &dyn Fn(String, &str) -> NextStep) -> NextStep {
    let at = |name: &str| quoted(&folder.path.join(name));
    let (case, ranges) = (at("case.toml"), ranges(folder));
    let cuts = folder.cuts.iter().map(|file| file.changed).max();
    if cuts.is_none() && folder.tried.is_none() {
        return step(
            format!("quietcut plan {case} {ranges} --width-percent 20"),
            "no cut was made yet; the command proposes the cuts that tell most about the limits. Save their recordings in cuts/, or their outcome in tried.csv",
        );
    }
    if let Some(cut) = untried(folder) {
        return step(
            format!(
                "quietcut replay {} --table {} --tried {}",
                quoted(&cut.path),
                at("table.qct"),
                at("tried.csv")
            ),
            "the outcome of this cut does not stand in tried.csv; the command looks for chatter in the recording and adds the outcome",
        );
    }
    if let (Some(tried), Some(chart)) = (&folder.tried, &folder.chart)
        && tried.changed > chart.changed
    {
        return step(
            format!(
                "quietcut lobes {case} {ranges} --cuts {} --out {}",
                quoted(&tried.path),
                at("lobes.html")
            ),
            "tried cuts are newer than the chart; the command counts those that are predicted wrong",
        );
    }
    if let Some(why) = contradicted(folder) {
        return step(
            format!(
                "quietcut frf {} --out {} --out {}",
                list(&folder.taps),
                at("frf/tool-tip.csv"),
                at("frf/tool-tip.svg")
            ),
            &why,
        );
    }
    if cuts > folder.diagnosis.as_ref().map(|file| file.changed) {
        return step(
            format!(
                "quietcut diagnose {case} {} --out {}",
                list(&folder.cuts),
                at("diagnosis")
            ),
            "recorded cuts are newer than the diagnosis; the command compares them with the simulation and names what it lacks",
        );
    }
    if let (Some(extended), Some(table)) = (&folder.extended, &folder.table)
        && extended.changed > table.changed
    {
        return step(
            format!(
                "quietcut table {} --out {}",
                quoted(&extended.path),
                at("table.qct")
            ),
            "the diagnosis found a cause and wrote the extended case; the command builds the table of that case",
        );
    }
    step(
        format!("quietcut upload PORT {}", at("table.qct")),
        "everything is up to date; the command sends the table to the device, PORT is its serial port",
    )
}

/// The command that identifies modes. Taps are made at standstill, unless a tachometer in them has pulses: the command then
/// takes its speed.
fn identify(folder: &MachineFolder, case: &str) -> String {
    let has_turned = folder.taps.iter().any(|file| {
        let read = Recording::import_all(&file.path, &Import::default()).unwrap_or_default();
        let recordings: Vec<Recording> = read.into_iter().map(|imported| imported.recording).collect();
        has_turned(&recordings)
    });
    format!(
        "quietcut identify {} --method modes {}--case {case} --out {case}",
        list(measured(folder)),
        if has_turned { "" } else { "--rpm 0 " }
    )
}

/// Files from which modes are identified: the recordings of taps, or, without any, the tables of receptances.
fn measured(folder: &MachineFolder) -> &[DatedFile] {
    if folder.taps.is_empty() {
        &folder.receptances
    } else {
        &folder.taps
    }
}

/// The first recorded cut whose speed and depth, as its sidecar states them, stand together in no row of the table of
/// tried cuts. A cut whose sidecar does not state both is passed over.
fn untried(folder: &MachineFolder) -> Option<&DatedFile> {
    let tried = tried_cuts(folder);
    folder.cuts.iter().find(|file| {
        let cut = Sidecar::beside(&file.path).ok().and_then(|sidecar| sidecar.cut);
        let point = cut.and_then(|cut| Some((cut.spindle_rpm?, cut.axial_depth_mm?)));
        point.is_some_and(|point| !tried.iter().any(|cut| (cut.rpm, cut.depth_mm) == point))
    })
}

/// Rows of the table of tried cuts; none if there is no table or if it cannot be read.
fn tried_cuts(folder: &MachineFolder) -> Vec<cut_table::TrialCut> {
    let file = folder.tried.as_ref();
    file.and_then(|file| cut_table::read(&file.path).ok())
        .unwrap_or_default()
}

/// Reason to tap again: the tried cuts contradict the limits of the case. `None` without a case or taps, and where
/// [`contradiction`] finds none.
fn contradicted(folder: &MachineFolder) -> Option<String> {
    let (_, case) = folder.case.as_ref()?;
    if folder.taps.is_empty() {
        return None;
    }
    let found = contradiction(case, &tried_cuts(folder))?;
    Some(format!(
        "{} of {} tried cuts contradict the limits beyond their intervals ({}): the taps may be those of another tool, holder or overhang, \
         or of a tool that sat differently. Tap this tool again and replace the recordings in taps/; then run this command. If the taps are \
         right, the cutting coefficients are wrong: quietcut identify --method force-coefficients",
        found.contradicted.len(),
        found.cuts,
        found.contradicted.join("; ")
    ))
}

/// True if the file exists and was last changed at the time `than` or later.
fn is_newer(file: &Option<DatedFile>, than: SystemTime) -> bool {
    file.as_ref().is_some_and(|file| file.changed >= than)
}

/// Options `--rpm` and `--depth-mm` of the proposed chart: the speed range of the spindle, else that of the lobes, else
/// 1000 to 10 000 rev/min; depths up to one tool diameter, else up to [`DEEPEST_MM`].
fn ranges(folder: &MachineFolder) -> String {
    let case = folder.case.as_ref().map(|(_, case)| case);
    let speeds = case.and_then(|case| {
        if let Some(limits) = &case.limits {
            // No cut exists at rest: the chart begins at the lowest speed of the spindle, but not below a twentieth of
            // the highest.
            return Some((limits.rpm_min.max(0.05 * limits.rpm_max), limits.rpm_max));
        }
        let structure = case.structure.as_ref()?.first_order().ok()?;
        Some(crate::stability::default_speeds(
            case,
            &structure,
            case.tool.as_ref()?.teeth,
        ))
    });
    let (first, last) = speeds.unwrap_or((1000.0, 10_000.0));
    let deepest_mm = case
        .and_then(|case| case.tool.as_ref()?.diameter_mm)
        .unwrap_or(DEEPEST_MM);
    format!("--rpm {first:.0}:{last:.0}:{CHART_SPEEDS} --depth-mm 0:{deepest_mm}:50")
}

fn state(folder: &MachineFolder) -> Vec<String> {
    let count = |files: &[DatedFile], what: &str| format!("{} {what}", files.len());
    let has =
        |file: &Option<DatedFile>, what: &str| format!("{} {what}", if file.is_some() { "a" } else { "no" });
    let case = match &folder.case {
        None => "no case.toml".into(),
        Some((_, case)) => {
            let sections = [
                ("structure", case.structure.is_some()),
                ("tool", case.tool.is_some()),
                ("material", case.material.is_some()),
                ("cut", case.cut.is_some()),
                ("limits", case.limits.is_some()),
            ];
            let with: Vec<&str> = sections
                .iter()
                .filter(|(_, there)| *there)
                .map(|(name, _)| *name)
                .collect();
            format!(
                "case.toml with {}",
                if with.is_empty() {
                    "no section".into()
                } else {
                    with.join(", ")
                }
            )
        }
    };
    let broken = folder.broken.iter().map(|file| {
        format!(
            "{} cannot be read",
            file.path
                .strip_prefix(&folder.path)
                .unwrap_or(&file.path)
                .display()
        )
    });
    let mut state = vec![
        case,
        count(&folder.taps, "recordings in taps/"),
        count(&folder.receptances, "tables in frf/"),
        has(&folder.chart, "chart (lobes.html)"),
        has(&folder.table, "lobe table (table.qct)"),
        count(&folder.cuts, "recordings in cuts/"),
        has(&folder.tried, "table of tried cuts (tried.csv)"),
        has(&folder.diagnosis, "diagnosis (diagnosis/report.html)"),
    ];
    state.extend(broken);
    state
}

fn list(files: &[DatedFile]) -> String {
    files
        .iter()
        .map(|file| quoted(&file.path))
        .collect::<Vec<_>>()
        .join(" ")
}

/// A path as argument of a shell command: in single quotes if it has other characters than letters, digits and `/._-*`.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    if text.chars().all(|c| c.is_alphanumeric() || "/._-*".contains(c)) {
        text
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}
