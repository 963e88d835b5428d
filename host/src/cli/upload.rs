//! `quietcut upload`: sends a lobe table to the device.

use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};
use quietcut_core::lobes::LobeTable;
use serde::Serialize;

use super::port::{PortArgs, TableAnswer};
use super::{Error, Output};
use crate::file;

/// Sends a lobe table to the device; continues an interrupted upload.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut table tests/cases/kuka-kr90-acetal.toml --out kuka.qct\n  quietcut upload simulated kuka.qct --state device.bin"
)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    /// The lobe table.
    #[arg(value_name = "FILE.qct")]
    table: PathBuf,
    #[command(flatten)]
    output: Output,
}

#[derive(Serialize)]
struct UploadOutput<'a> {
    port: &'a str,
    bytes: usize,
    resumed_at: u32,
    table: Option<TableAnswer>,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let bytes = file::read(&args.table)?;
    let table = LobeTable::parse(&bytes).map_err(|error| {
        Error::input(format!(
            "{}: this is no lobe table: {error}",
            args.table.display()
        ))
    })?;
    let (mut client, _) = args.port.connect()?;
    let bar = progress_bar(bytes.len());
    let uploaded = client.upload(&table, |received, _| bar.set_position(received.into()));
    bar.finish_and_clear();
    let uploaded = uploaded?;
    let answer = UploadOutput {
        port: args.port.name(),
        bytes: bytes.len(),
        resumed_at: uploaded.resumed_at,
        table: uploaded.info.table.as_ref().map(TableAnswer::new),
    };
    let resumed = match answer.resumed_at {
        0 => String::new(),
        at => format!(" (resumed at byte {at} of an interrupted upload)"),
    };
    let in_use = answer.table.as_ref().map_or("none".into(), ToString::to_string);
    let text = format!(
        "{}: {} bytes sent{resumed}; table in use: {in_use}",
        answer.port, answer.bytes
    );
    args.output.answer(&answer, text)
}

/// Progress bar of an upload of `bytes` bytes on stderr, invisible if stderr is no terminal.
fn progress_bar(bytes: usize) -> ProgressBar {
    let bar = ProgressBar::new(bytes as u64);
    if let Ok(style) = ProgressStyle::with_template("upload {bar:40} {bytes}/{total_bytes} {eta}") {
        bar.set_style(style);
    }
    bar
}
