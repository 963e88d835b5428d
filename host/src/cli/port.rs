//! The PORT argument, and the description of a device in outputs: lobe table, memory slots, working point.

use std::path::{Path, PathBuf};

use quietcut_core::protocol::{Info, Slot, TableSummary};
use quietcut_core::working_point::WorkingPoint;
use serde::Serialize;

use super::Error;
use crate::device::{self, Client, DeviceError};
use crate::report::answer::number;

/// Port of the device, and state file of the simulated device: options of `upload`, `info`, `working-point` and
/// `monitor`.
#[derive(Debug, clap::Args)]
pub struct PortArgs {
    /// Serial port of the device, or `simulated`.
    #[arg(value_name = "PORT")]
    port: String,
    /// File that holds the memory of the simulated device, so that a lobe table persists between commands.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
}

impl PortArgs {
    /// Name of the device's port, as given on the command line.
    pub fn name(&self) -> &str {
        &self.port
    }

    /// File that holds the memory of the simulated device, if it is given.
    pub(super) fn state(&self) -> Option<&Path> {
        self.state.as_deref()
    }

    /// Opens the port and starts the protocol with the device.
    pub fn connect(&self) -> Result<(Client, Info), Error> {
        Ok(self.connector()?()?)
    }

    /// Function that opens the port and starts the protocol with the device, each time that it is called.
    pub(super) fn connector(
        &self,
    ) -> Result<impl FnMut() -> Result<(Client, Info), DeviceError> + Send + use<>, Error> {
        if let Some(state) = &self.state
            && self.port != device::port::SIMULATED
        {
            return Err(Error::input(format!(
                "--state {}: only the simulated device keeps its memory in a file, {} is hardware; leave --state out",
                state.display(),
                self.port
            )));
        }
        let (port, state) = (self.port.clone(), self.state.clone());
        Ok(move || Client::connect(device::open(&port, state.as_deref())?))
    }
}

/// Summary of the lobe table of a device, as JSON and as text.
#[derive(Debug, Serialize)]
pub struct TableAnswer {
    name: String,
    teeth: u8,
    speeds: u16,
    rpm: [f64; 2],
    depth_mm: [f64; 2],
    layers: u16,
    limits_rpm: Option<[f64; 2]>,
}

impl TableAnswer {
    /// Converts the summary of the lobe table that the device sends into the form of the output.
    pub fn new(table: &TableSummary) -> Self {
        Self {
            name: table.name.as_str().into(),
            teeth: table.teeth,
            speeds: table.speeds,
            rpm: [number(table.speed_from.0), number(table.speed_to.0)],
            depth_mm: [number(table.depth_from.0), number(table.depth_to.0)],
            layers: table.layers,
            limits_rpm: table
                .limits
                .map(|limits| [number(limits.rpm_min.0), number(limits.rpm_max.0)]),
        }
    }
}

impl std::fmt::Display for TableAnswer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ([rpm_from, rpm_to], [from_mm, to_mm]) = (self.rpm, self.depth_mm);
        write!(
            f,
            "{}: {} teeth, {} speeds from {rpm_from} to {rpm_to} rev/min, {from_mm} to {to_mm} mm deep, {} layer{}",
            self.name,
            self.teeth,
            self.speeds,
            self.layers,
            if self.layers == 1 { "" } else { "s" }
        )?;
        if let Some([slowest, fastest]) = self.limits_rpm {
            write!(f, "; spindle from {slowest} to {fastest} rev/min")?;
        }
        Ok(())
    }
}

/// State of one memory slot for a lobe table, as JSON and as text.
#[derive(Debug, Serialize)]
#[serde(tag = "state", rename_all = "kebab-case")]
pub enum SlotAnswer {
    /// The slot holds no table.
    Empty,
    /// The slot holds the received part of a lobe table whose upload is incomplete.
    Unfinished {
        /// Bytes received so far.
        received: u32,
        /// Size of the complete lobe table, bytes.
        length: u32,
    },
    /// The slot holds bytes that are no valid lobe table.
    Damaged {
        /// Reason why the bytes in the slot are no valid lobe table.
        error: String,
    },
    /// The slot holds a valid lobe table that the device does not use at present.
    Valid {
        /// Size of the table, bytes.
        length: u32,
        /// Generation number of the lobe table: an uploaded table gets that of the table in use plus one.
        generation: u32,
    },
    /// The slot holds the lobe table that the device uses.
    InUse {
        /// Size of the table, bytes.
        length: u32,
        /// Generation number of the lobe table in use; the next uploaded table gets this number plus one.
        generation: u32,
    },
}

impl SlotAnswer {
    /// Converts the state of a memory slot that the device sends into the form of the output.
    pub fn new(slot: &Slot) -> Self {
        match slot {
            Slot::Empty => Self::Empty,
            Slot::Unfinished(upload) => Self::Unfinished {
                received: upload.received,
                length: upload.header.length,
            },
            Slot::Damaged(error) => Self::Damaged {
                error: error.to_string(),
            },
            Slot::Valid(header) => Self::Valid {
                length: header.length,
                generation: header.generation,
            },
            Slot::InUse(header) => Self::InUse {
                length: header.length,
                generation: header.generation,
            },
        }
    }
}

impl std::fmt::Display for SlotAnswer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Empty => f.write_str("empty"),
            Self::Unfinished { received, length } => {
                write!(
                    f,
                    "{received} of {length} bytes of an upload; `quietcut upload` resumes there"
                )
            }
            Self::Damaged { error } => write!(f, "damaged: {error}"),
            Self::Valid { length, generation } => write!(f, "table {generation}, {length} bytes"),
            Self::InUse { length, generation } => write!(f, "table {generation}, {length} bytes, in use"),
        }
    }
}

/// Feed direction in degrees as text; `None` means that none is set on the device.
pub fn feed_direction_text(direction_deg: Option<f64>) -> String {
    match direction_deg {
        Some(degrees) => format!("{degrees}°"),
        None => "not set: the feed direction of the lobe table is assumed if the table has only one".into(),
    }
}

/// Working point of the cut (axial depth, immersion, feed, posture), as JSON and as text.
#[derive(Debug, Serialize)]
pub struct WorkingPointAnswer {
    depth_mm: f64,
    start_deg: f64,
    exit_deg: f64,
    feed_per_tooth_mm: f64,
    posture: u8,
}

impl WorkingPointAnswer {
    /// Converts the working point that the device sends into the form of the output.
    pub fn new(point: &WorkingPoint) -> Self {
        Self {
            depth_mm: number(point.axial_depth.0),
            start_deg: number(point.start.0),
            exit_deg: number(point.exit.0),
            feed_per_tooth_mm: number(point.feed_per_tooth.0),
            posture: point.posture,
        }
    }
}

impl std::fmt::Display for WorkingPointAnswer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            depth_mm,
            start_deg,
            exit_deg,
            feed_per_tooth_mm,
            posture,
        } = self;
        write!(
            f,
            "{depth_mm} mm deep, immersion from {start_deg}° to {exit_deg}°, {feed_per_tooth_mm} mm per tooth, posture {posture}"
        )
    }
}
