//! Firmware, settings, memory and counters of a device.

use quietcut_core::lobes::Header;
use quietcut_core::monitor::Settings;
use quietcut_core::protocol::{Info, Slot, Status};

use super::Finding;
use crate::device::{Client, DeviceError};

/// A device that answers, and the findings about it.
#[derive(Debug)]
pub struct Examined {
    /// Identity and memory of the device.
    pub info: Info,
    /// Settings of its signal chain.
    pub settings: Settings,
    /// Findings about firmware, settings, table, working point and counters.
    pub findings: Vec<Finding>,
}

impl Examined {
    /// Head of the lobe table in use.
    pub fn table(&self) -> Option<Header> {
        self.info.slots.iter().find_map(|slot| match slot {
            Slot::InUse(header) => Some(*header),
            _ => None,
        })
    }
}

/// Asks the device for its state.
///
/// # Errors
/// The device does not answer.
pub fn examine(client: &mut Client, info: Info) -> Result<Examined, DeviceError> {
    let (settings, status) = (client.settings()?, client.status()?);
    let mut findings = vec![firmware(&info)];
    findings.extend(tool_and_speed(&settings));
    findings.extend(memory(client.port(), &info, &settings));
    findings.push(working_point(client.port(), &status));
    findings.extend(counters(&status));
    Ok(Examined {
        info,
        settings,
        findings,
    })
}

fn firmware(info: &Info) -> Finding {
    const OURS: &str = env!("CARGO_PKG_VERSION");
    let found = format!(
        "{} {}, protocol {}; this command is {OURS}",
        info.board, info.firmware, info.protocol
    );
    if info.firmware.as_str() == OURS {
        Finding::good("firmware", found)
    } else {
        Finding::note(
            "firmware",
            found,
            "bring command and firmware to the same release (firmware/README.md)",
        )
    }
}

fn tool_and_speed(settings: &Settings) -> [Finding; 2] {
    let teeth = settings.tool.teeth;
    let tool = Finding::good("tool", format!("{teeth} teeth"));
    let speed = match (settings.wheel, settings.assumed_speed) {
        (Some(wheel), _) => Finding::good(
            "tachometer",
            format!(
                "{} positions per revolution, {} missing",
                wheel.positions, wheel.missing
            ),
        ),
        (None, Some(speed)) => Finding::note(
            "tachometer",
            format!("none; a speed of {:.0} rev/min is set", speed.0),
            "fit a tachometer: chatter is separated from forced vibration by the true speed",
        ),
        (None, None) => Finding::problem(
            "tachometer",
            "none, and no speed is set",
            "fit a tachometer: without a speed chatter cannot be separated from forced vibration",
        ),
    };
    [tool, speed]
}

fn memory(port: &str, info: &Info, settings: &Settings) -> Vec<Finding> {
    let again = format!("send the table again: quietcut upload {port} FILE.qct");
    let mut findings: Vec<_> = (1..)
        .zip(&info.slots)
        .filter_map(|(number, slot)| match slot {
            Slot::Unfinished(upload) => Some(Finding::note(
                "memory",
                format!(
                    "slot {number} has {} of {} bytes of a table",
                    upload.received, upload.header.length
                ),
                again.clone(),
            )),
            Slot::Damaged(error) => Some(Finding::problem(
                "memory",
                format!("slot {number} is damaged: {error}"),
                again.clone(),
            )),
            Slot::Empty | Slot::Valid(_) | Slot::InUse(_) => None,
        })
        .collect();
    findings.push(match &info.table {
        None => Finding::note(
            "table",
            "the device has no lobe table: it advises by the tooth-passing rule",
            format!("quietcut table CASE.toml --out table.qct, then quietcut upload {port} table.qct"),
        ),
        Some(table) if table.teeth != settings.tool.teeth => Finding::problem(
            "table",
            format!(
                "the lobe table {} is for {} teeth, the device is set to {}",
                table.name, table.teeth, settings.tool.teeth
            ),
            format!("send a table for the tool in use: quietcut upload {port} FILE.qct"),
        ),
        Some(table) if table.limits.is_none() => Finding::note(
            "table",
            format!("the lobe table {} has no speed limits of the machine: advice may be a speed that it cannot run", table.name),
            "set [limits] with rpm_min and rpm_max in the case, and build and send the table again",
        ),
        Some(table) => Finding::good(
            "table",
            format!(
                "{}: {:.0} to {:.0} rev/min, {:.2} to {:.2} mm",
                table.name, table.speed_from.0, table.speed_to.0, table.depth_from.0, table.depth_to.0
            ),
        ),
    });
    findings
}

fn working_point(port: &str, status: &Status) -> Finding {
    match &status.working_point {
        Some(point) => Finding::good(
            "working point",
            format!(
                "{:.2} mm deep, immersion {} to {}, {} per tooth",
                point.axial_depth.0, point.start, point.exit, point.feed_per_tooth
            ),
        ),
        None => Finding::note(
            "working point",
            "not set: advice states the cut that it assumes",
            format!("quietcut working-point {port} --depth-mm A --start D --exit D --feed F"),
        ),
    }
}

fn counters(status: &Status) -> Vec<Finding> {
    let errors = status.frame_errors.total();
    let samples = format!(
        "{} blocks, {} samples clipped, {} lost",
        status.blocks, status.clipped, status.lost
    );
    let line = format!(
        "{} frames, {errors} of them unusable, {} messages not sent",
        status.frames, status.dropped
    );
    vec![
        if status.clipped > 0 {
            Finding::problem(
                "samples",
                samples,
                "mount the sensor farther from the cut, or set a larger range",
            )
        } else if status.lost > 0 {
            Finding::note("samples", samples, "check the cable between sensor and board")
        } else {
            Finding::good("samples", samples)
        },
        if errors > 0 || status.dropped > 0 {
            Finding::note(
                "line",
                line,
                "use a shorter or shielded cable, and connect without a hub",
            )
        } else {
            Finding::good("line", line)
        },
    ]
}
