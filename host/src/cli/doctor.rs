//! `quietcut doctor`: examines ports, device and lobe table, and says what to do.

use std::path::PathBuf;
use std::time::SystemTime;

use serde::Serialize;

use super::{Error, Output};
use crate::device::port::SIMULATED;
use crate::device::{self, Client, DeviceError};
use crate::doctor::{self, Examined, Finding, State};
use crate::machine::MachineFolder;

/// Examines ports, firmware, settings and lobe table, and says what to do.
///
/// Each serial port on USB is asked whether a quietcut device is there. A stated PORT is asked in their place. A device
/// that is missing or does not answer is a finding, not an error.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  quietcut doctor simulated")]
pub struct Args {
    /// Serial ports to examine, or `simulated`. Default: all serial ports on USB.
    #[arg(value_name = "PORT")]
    ports: Vec<String>,
    /// File that holds the memory of the simulated device.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Folder of the machine, as of `next`: its table.qct is compared with the table of the device and with case.toml.
    #[arg(long, value_name = "DIR")]
    machine: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

#[derive(Serialize)]
struct DoctorOutput {
    command: &'static str,
    /// Number of findings that must be mended.
    problems: usize,
    findings: Vec<Finding>,
    ports: Vec<PortOutput>,
}

#[derive(Serialize)]
struct PortOutput {
    port: String,
    /// Maker and product on USB; `null` for another port.
    usb: Option<String>,
    /// Board and firmware; `null` if no device answers.
    device: Option<String>,
    findings: Vec<Finding>,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    if let (Some(state), false) = (&args.state, args.ports.iter().any(|port| port == SIMULATED)) {
        return Err(Error::input(format!(
            "--state {}: only the simulated device keeps its memory in a file; add the port simulated, or leave --state out",
            state.display()
        )));
    }
    let folder = args.machine.as_deref().map(MachineFolder::read).transpose()?;
    let mut findings = Vec::new();
    let ports = chosen(&args, &mut findings);
    let mut examined = None;
    let ports: Vec<_> = ports
        .into_iter()
        .map(|(port, usb)| {
            let (output, device) = examine(&args, port, usb);
            examined = examined.take().or(device);
            output
        })
        .collect();
    if let Some(folder) = &folder {
        findings.extend(doctor::compare(folder, examined.as_ref(), SystemTime::now()));
    } else if examined.as_ref().is_some_and(|device| device.table().is_some()) {
        findings.push(Finding::note(
            "machine",
            "whether the table is that of the machine was not examined",
            "state the folder of the machine with --machine DIR",
        ));
    }
    let all = ports.iter().flat_map(|port| &port.findings).chain(&findings);
    let answer = DoctorOutput {
        command: env!("CARGO_PKG_VERSION"),
        problems: all.filter(|finding| finding.state == State::Problem).count(),
        findings,
        ports,
    };
    args.output.answer(&answer, answer.text())
}

/// The stated ports, or all on USB; findings about ports that are not tried.
fn chosen(args: &Args, findings: &mut Vec<Finding>) -> Vec<(String, Option<String>)> {
    let found = doctor::found_ports();
    if !args.ports.is_empty() {
        let usb = |name: &String| found.iter().find(|port| port.name == *name)?.usb.clone();
        return args.ports.iter().map(|name| (name.clone(), usb(name))).collect();
    }
    let (usb, others): (Vec<_>, Vec<_>) = found.into_iter().partition(|port| port.usb.is_some());
    if usb.is_empty() {
        findings.push(Finding::problem(
            "ports",
            "there is no serial port on USB",
            "plug the device in with a cable that carries data (many carry power only), look at the light of the board, and run the command \
             again; `quietcut monitor simulated` works without a device",
        ));
    }
    if !others.is_empty() {
        let names: Vec<_> = others.into_iter().map(|port| port.name).collect();
        findings.push(Finding::note(
            "ports",
            format!("not on USB and not tried: {}", names.join(", ")),
            "state one of them if the device is there: quietcut doctor PORT",
        ));
    }
    usb.into_iter().map(|port| (port.name, port.usb)).collect()
}

/// Asks the device at a port.
fn examine(args: &Args, port: String, usb: Option<String>) -> (PortOutput, Option<Examined>) {
    let state = args.state.as_deref().filter(|_| port == SIMULATED);
    let asked = || -> Result<Examined, DeviceError> {
        let (mut client, info) = Client::connect(device::open(&port, state)?)?;
        doctor::examine(&mut client, info)
    };
    let (device, findings, examined) = match asked() {
        Ok(device) => {
            let name = format!("{} {}", device.info.board, device.info.firmware);
            (Some(name), device.findings.clone(), Some(device))
        }
        Err(error) => (None, vec![doctor::obstacle(&port, &error)], None),
    };
    let output = PortOutput {
        port,
        usb,
        device,
        findings,
    };
    (output, examined)
}

impl DoctorOutput {
    fn text(&self) -> String {
        let mut lines = Vec::new();
        for port in &self.ports {
            let usb = port.usb.as_deref().filter(|usb| !usb.is_empty());
            let usb = usb.map_or_else(String::new, |usb| format!(" ({usb})"));
            lines.push(format!("{}{usb}", port.port));
            lines.extend(port.findings.iter().map(ToString::to_string));
        }
        lines.extend(self.findings.iter().map(ToString::to_string));
        lines.push(match self.problems {
            0 => "no problem found".into(),
            1 => "1 problem found".into(),
            count => format!("{count} problems found"),
        });
        lines.join("\n")
    }
}
