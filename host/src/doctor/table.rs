//! The lobe table of a device beside that of a machine's folder.

use std::time::{Duration, SystemTime};

use quietcut_core::lobes::format::HEADER_LENGTH;
use quietcut_core::lobes::{Header, LobeTable};

use super::{Examined, Finding};
use crate::machine::MachineFolder;

/// Compares the table of the device, if there is one, with `table.qct` and `case.toml` of the machine.
pub fn compare(folder: &MachineFolder, device: Option<&Examined>, now: SystemTime) -> Vec<Finding> {
    let directory = folder.path.display();
    let build = format!("quietcut table {directory}/case.toml --out {directory}/table.qct");
    let mut findings = Vec::new();
    let Some(file) = &folder.table else {
        findings.push(Finding::note(
            "table file",
            format!("{directory} has no table.qct"),
            build,
        ));
        return findings;
    };
    let name = file.path.display();
    let age = now.duration_since(file.changed).unwrap_or_default();
    let age = format!("{name} is {} old", words(age));
    let case = folder.case.as_ref();
    findings.push(if case.is_some_and(|(case, _)| case.changed > file.changed) {
        Finding::problem(
            "table age",
            format!("{age}, and case.toml is newer"),
            format!("{build}, then send it to the device"),
        )
    } else {
        Finding::good("table age", age)
    });
    let bytes = match crate::file::read(&file.path) {
        Ok(bytes) => bytes,
        Err(error) => {
            findings.push(Finding::problem("table file", error.to_string(), build));
            return findings;
        }
    };
    let header = LobeTable::parse(&bytes).and_then(|table| table.header());
    match (header, device) {
        (Err(error), _) => findings.push(Finding::problem(
            "table file",
            format!("{name} is no lobe table: {error}"),
            build,
        )),
        (Ok(header), Some(device)) => findings.push(same(header, &bytes, device, &name.to_string())),
        (Ok(_), None) => {}
    }
    findings.extend(device.and_then(|device| teeth(folder, device)));
    findings
}

/// Whether the device uses the table of the file. A device gives each uploaded table a generation of its own, which the
/// check sum covers.
fn same(header: Header, bytes: &[u8], device: &Examined, name: &str) -> Finding {
    let send = format!("quietcut upload PORT {name}");
    let payload = bytes.get(HEADER_LENGTH..).unwrap_or_default();
    match (device.table(), &device.info.table) {
        (Some(used), Some(table)) if used == header.with_generation(used.generation, payload) => {
            Finding::good("machine", format!("the device uses {name} ({})", table.name))
        }
        (Some(_), Some(table)) => Finding::problem(
            "machine",
            format!("the device uses another table than {name}: {}", table.name),
            send,
        ),
        _ => Finding::problem("machine", format!("the device does not use {name}"), send),
    }
}

/// A tool in the case with another number of teeth than that of the device.
fn teeth(folder: &MachineFolder, device: &Examined) -> Option<Finding> {
    let (file, case) = folder.case.as_ref()?;
    let (case, device) = (case.tool.as_ref()?.teeth, usize::from(device.settings.tool.teeth));
    (case != device).then(|| {
        Finding::problem(
            "tool",
            format!(
                "{} has {case} teeth, the device is set to {device}",
                file.path.display()
            ),
            "set the teeth of the tool in use in both",
        )
    })
}

/// A time in its largest whole unit, such as `3 days`.
fn words(time: Duration) -> String {
    let seconds = time.as_secs();
    let (count, unit) = [(86_400, "day"), (3_600, "hour"), (60, "minute")]
        .into_iter()
        .map(|(length, unit)| (seconds / length, unit))
        .find(|(count, _)| *count > 0)
        .unwrap_or((seconds, "second"));
    format!("{count} {unit}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_age_has_its_largest_whole_unit() {
        for (seconds, text) in [
            (0, "0 seconds"),
            (61, "1 minute"),
            (7_300, "2 hours"),
            (86_400 * 3 + 5, "3 days"),
        ] {
            assert_eq!(words(Duration::from_secs(seconds)), text);
        }
    }
}
