//! Recordings: channels with name, unit and sample rate, and the sidecar file that describes the test.
//!
//! Sign conventions: a force is the force on the structure. With one mark per revolution, a rising edge of `tacho` is
//! immersion angle 0 of tooth 1. Samples are in SI units if their unit is known.
//!
//! Main types: [`Recording`] with its [`Channel`]s, [`Sidecar`] (kind of test, cut, posture, names and units of
//! channels), [`Unit`] and [`Quantity`], [`SpindleAngle`] (spindle angle from the tachometer). Formats: CSV and other
//! text tables, WAV, MAT of levels 5 and 7.3, LabVIEW measurement files, TDMS and UFF 58 ([`uff`]).
//! [`Recording::import`] also reads files in the words of other programs, and says how it understood them
//! ([`Understood`]).
//!
//! ```
//! use quietcut_recording::{Channel, Quantity, Recording, Sidecar};
//!
//! let path = std::env::temp_dir().join(format!("quietcut-recording-{}.csv", std::process::id()));
//! let written = Recording {
//!     path: path.clone(),
//!     sample_rate_hz: 1000.0,
//!     start_s: 0.0,
//!     since_s: 0.0,
//!     channels: vec![Channel {
//!         name: "fx".into(),
//!         quantity: Quantity::Force,
//!         samples: vec![0.0, 12.5, 25.0],
//!     }],
//!     sidecar: Sidecar::default(),
//! };
//! written.write(&path)?;
//!
//! let read = Recording::read(&path)?;
//! assert_eq!(read.sample_rate_hz, 1000.0);
//! assert_eq!(read.channel("fx").map(|channel| channel.samples[1]), Some(12.5));
//! # std::fs::remove_file(&path).ok();
//! # std::fs::remove_file(path.with_extension("toml")).ok();
//! # Ok::<(), quietcut_recording::RecordingError>(())
//! ```
//!
//! This crate knows no structure, tool or cut beyond what the sidecar or the user states, and computes no spectra.

mod assemble;
mod binary_number;
mod blocks;
mod channel_section;
mod criteria;
mod csv;
mod csv_number;
mod csv_writer;
pub mod cut_table;
mod doubt;
mod error;
pub mod file;
mod format;
mod formats;
mod hdf5;
mod import;
mod lvm;
mod mat;
mod meaning;
mod open_doubts;
mod plausibility;
mod raw;
mod recording;
mod segment;
mod sidecar;
mod spindle_angle;
mod summary;
mod tachometer;
mod tdms;
mod text_dialect;
mod text_file;
mod text_head;
mod text_number;
mod text_rate;
mod text_rows;
mod text_table;
mod time_stamp;
pub mod uff;
mod understand;
mod understood;
mod unit;
mod wav;
mod words;

pub use assemble::Imported;
pub use blocks::{Sensed, SpindleSettings};
pub use channel_section::channel_section;
pub use doubt::Doubt;
pub use error::RecordingError;
pub use format::Format;
pub use formats::WRITTEN;
pub use import::{ColumnMap, ColumnMaps, Import, Scale};
pub use recording::{Channel, Recording};
pub use segment::Segment;
pub use sidecar::{RecordedChannel, RecordedCut, RecordedPosture, Sidecar, TestKind};
pub use spindle_angle::SpindleAngle;
pub use summary::{ChannelSummary, clipping_levels, envelope};
pub use tachometer::TachometerEdges;
pub use text_table::{TextColumn, TextTable};
pub use uff::UffForm;
pub use understood::{Basis, Understood, UnderstoodColumn};
pub use unit::{Quantity, Sensitivity, Unit, UnknownUnit};

#[cfg(test)]
mod tests;
