//! The serial ports of this computer, and why one cannot be used.

use std::fs::{self, OpenOptions};
use std::io::ErrorKind;
use std::path::Path;

use serialport::SerialPortType;

use super::Finding;
use crate::device::DeviceError;

/// A serial port of this computer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundPort {
    /// Name, such as `/dev/ttyACM0`.
    pub name: String,
    /// Maker and product of the USB device behind the port; `None` for a port that is not on USB. Only ports on USB are
    /// tried unless they are stated: other ports may belong to machines that do not expect a question.
    pub usb: Option<String>,
}

/// All serial ports of this computer, by name.
pub fn found_ports() -> Vec<FoundPort> {
    // A computer whose ports cannot be listed has none as far as this search can tell.
    let mut ports: Vec<_> = serialport::available_ports()
        .unwrap_or_default()
        .into_iter()
        .map(|port| FoundPort {
            usb: match port.port_type {
                SerialPortType::UsbPort(usb) => {
                    let names = [usb.manufacturer, usb.product].into_iter().flatten();
                    Some(names.collect::<Vec<_>>().join(" "))
                }
                _ => None,
            },
            name: port.port_name,
        })
        .collect();
    ports.sort_by(|a, b| a.name.cmp(&b.name));
    ports
}

/// Why the device at a port does not answer, and what to check.
pub fn obstacle(port: &str, error: &DeviceError) -> Finding {
    let found = error.to_string();
    match error {
        DeviceError::NoPort { .. } => Finding::problem(
            "port",
            found,
            "check that the cable carries data (many carry power only), that it sits at both ends and that the device has power; then run the \
             command again",
        ),
        DeviceError::Open { .. } => closed(port, found),
        DeviceError::NoAnswer { .. } | DeviceError::Unexpected { .. } => Finding::problem(
            "port",
            found,
            "state the port of the device if this is another one; else restart the device, and load its firmware again \
             (firmware/README.md)",
        ),
        DeviceError::Version { .. } => Finding::problem(
            "firmware",
            found,
            "install command and firmware of the same release (firmware/README.md)",
        ),
        DeviceError::Frames { .. } | DeviceError::Line { .. } => Finding::problem(
            "line",
            found,
            "use a shorter or shielded cable away from the drive of the spindle, and close other programs that use the port",
        ),
        _ => Finding::problem("device", found, "restart the device and run the command again"),
    }
}

/// Why a port that exists cannot be opened.
fn closed(port: &str, found: String) -> Finding {
    let opened = OpenOptions::new().read(true).write(true).open(port);
    if opened.is_err_and(|error| error.kind() == ErrorKind::PermissionDenied) {
        let group = group_of(Path::new(port)).unwrap_or_else(|| "dialout".into());
        return Finding::problem(
            "permission",
            format!("{found}: this account may not use the port, which belongs to the group {group}"),
            format!("run `sudo usermod -aG {group} $USER`, then log out and in again"),
        );
    }
    let to_do = match holder(Path::new(port)) {
        Some(program) => format!("end {program}, which holds the port"),
        None => "close the other program that holds the port, such as a serial terminal or a second `quietcut monitor`".into(),
    };
    Finding::problem("port", found, to_do)
}

/// Name of the group to which a file belongs; `None` where the system keeps no such list.
#[cfg(unix)]
fn group_of(path: &Path) -> Option<String> {
    use std::os::unix::fs::MetadataExt;
    let number = fs::metadata(path).ok()?.gid().to_string();
    let groups = fs::read_to_string("/etc/group").ok()?;
    let line = groups
        .lines()
        .find(|line| line.split(':').nth(2) == Some(&number))?;
    line.split(':').next().map(str::to_owned)
}

#[cfg(not(unix))]
fn group_of(_: &Path) -> Option<String> {
    None
}

/// Name and number of the process that holds a file open; `None` if it is unknown, for example because the process
/// belongs to another account. Only Linux shows it.
fn holder(path: &Path) -> Option<String> {
    let wanted = fs::canonicalize(path).ok()?;
    let own = std::process::id().to_string();
    fs::read_dir("/proc").ok()?.flatten().find_map(|process| {
        let id = process.file_name().into_string().ok()?;
        if id == own || !id.bytes().all(|letter| letter.is_ascii_digit()) {
            return None;
        }
        let mut files = fs::read_dir(process.path().join("fd")).ok()?.flatten();
        files.find(|file| fs::read_link(file.path()).is_ok_and(|target| target == wanted))?;
        let name = fs::read_to_string(process.path().join("comm")).ok()?;
        Some(format!("{} (process {id})", name.trim()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::State;

    #[test]
    fn each_obstacle_says_what_to_check() {
        let missing = DeviceError::NoPort {
            port: "/dev/ttyACM7".into(),
            present: "there is none on this computer".into(),
        };
        let finding = obstacle("/dev/ttyACM7", &missing);
        assert_eq!(finding.state, State::Problem);
        assert!(finding.to_do.unwrap().contains("cable"));
        let busy = DeviceError::Open {
            port: "/dev/null".into(),
            cause: "Device or resource busy".into(),
        };
        let to_do = obstacle("/dev/null", &busy).to_do.unwrap();
        assert!(to_do.contains("holds the port"), "{to_do}");
        let old = DeviceError::Version {
            port: "simulated".into(),
            ours: 2,
            theirs: 1,
        };
        assert_eq!(obstacle("simulated", &old).subject, "firmware");
    }
}
