//! Files of one machine: `case.toml`, `taps/`, `frf/`, `cuts/`, `tried.csv`, `lobes.html`, `table.qct`, `diagnosis/`,
//! each with the time of its last change.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use quietcut_core::lobes::LobeTable;

use crate::case::{Case, CaseError};
use crate::frf::FrfTable;
use crate::recording::{Import, Recording, cut_table};

/// File name extensions of the recordings in the folders `taps` and `cuts`.
const RECORDINGS: [&str; 12] = [
    "csv", "txt", "dat", "tsv", "asc", "mat", "uff", "unv", "bunv", "wav", "lvm", "tdms",
];

/// File name extensions of the tables of receptances in the folder `frf`.
const RECEPTANCES: [&str; 4] = ["csv", "uff", "unv", "bunv"];

/// Reason why the folder of a machine cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// There is no such folder.
    #[error("{}: no such folder; quietcut setup {} makes one", path.display(), path.display())]
    Missing {
        /// The folder.
        path: PathBuf,
    },
    /// The path is a file.
    #[error("{}: a file; give the folder of the machine, which contains case.toml", path.display())]
    File {
        /// The file.
        path: PathBuf,
    },
    /// The folder `taps`, `frf` or `cuts` cannot be read.
    #[error("{}: the folder cannot be read", path.display())]
    Unreadable {
        /// The folder.
        path: PathBuf,
        /// Reason of the system.
        source: io::Error,
    },
    /// `case.toml` cannot be read or is not a valid case.
    #[error(transparent)]
    Case(#[from] CaseError),
}

/// A file with the time of its last change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DatedFile {
    /// Path of the file; it begins with the folder of the machine as the user gave it.
    pub path: PathBuf,
    /// Time of the last change.
    pub changed: SystemTime,
}

/// Files in the folder of one machine. A field of a single file is `None` if there is no such file.
#[derive(Clone, Debug)]
pub struct MachineFolder {
    /// Path of the machine's folder as the user gave it.
    pub path: PathBuf,
    /// `case.toml`; `None` if there is none.
    pub case: Option<(DatedFile, Case)>,
    /// Recordings of taps, by name.
    pub taps: Vec<DatedFile>,
    /// Tables of receptances, by name.
    pub receptances: Vec<DatedFile>,
    /// Recordings of cuts, by name.
    pub cuts: Vec<DatedFile>,
    /// `tried.csv`, the table of tried cuts.
    pub tried: Option<DatedFile>,
    /// `lobes.html`, the chart.
    pub chart: Option<DatedFile>,
    /// `table.qct`, the lobe table that is uploaded to the device.
    pub table: Option<DatedFile>,
    /// `diagnosis/extended.toml`, the case with the cause that `diagnose` found.
    pub extended: Option<DatedFile>,
    /// `diagnosis/report.html`, the report of `diagnose`.
    pub diagnosis: Option<DatedFile>,
    /// Files that cannot be read, each with the reason.
    pub broken: Vec<BrokenFile>,
}

/// A file of the folder that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrokenFile {
    /// Kind of the file.
    pub kind: FileKind,
    /// Path, with the folder of the machine as the user gave it.
    pub path: PathBuf,
    /// Message of the reader; it names the file.
    pub reason: String,
}

/// Kinds of files whose content is checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// Recording of taps or of a cut.
    Recording,
    /// Table of receptances.
    Receptances,
    /// Table of tried cuts.
    TriedCuts,
    /// Lobe table of the device.
    LobeTable,
}

/// Tries to read every one of the files; returns those that cannot be read, each with the reason.
fn broken<'a>(files: impl Iterator<Item = (FileKind, &'a DatedFile)>) -> Vec<BrokenFile> {
    files
        .filter_map(|(kind, DatedFile { path, .. })| {
            let read = match kind {
                FileKind::Recording => Recording::import_all(path, &Import::default())
                    .map(drop)
                    .map_err(|error| error.to_string()),
                FileKind::Receptances => FrfTable::import(path, &Import::default())
                    .map(drop)
                    .map_err(|error| error.to_string()),
                FileKind::TriedCuts => cut_table::read(path).map(drop).map_err(|error| error.to_string()),
                FileKind::LobeTable => crate::file::read(path)
                    .map_err(|error| error.to_string())
                    .and_then(|bytes| {
                        LobeTable::parse(&bytes)
                            .map(drop)
                            .map_err(|error| format!("{}: this is no lobe table: {error}", path.display()))
                    }),
            };
            Some(BrokenFile {
                kind,
                path: path.clone(),
                reason: read.err()?,
            })
        })
        .collect()
}

impl MachineFolder {
    /// Lists the files in the folder of a machine, reads its case, and tries to read its recordings and tables.
    ///
    /// # Errors
    /// See [`FolderError`]. A recording or table that cannot be read is no error: see [`MachineFolder::broken`].
    pub fn read(path: &Path) -> Result<Self, FolderError> {
        if path.is_file() {
            return Err(FolderError::File { path: path.into() });
        }
        if !path.is_dir() {
            return Err(FolderError::Missing { path: path.into() });
        }
        let list = |name: &str, endings: &[&str]| {
            files_in(&path.join(name), endings).map_err(|source| FolderError::Unreadable {
                path: path.join(name),
                source,
            })
        };
        let case = match dated(path.join("case.toml")) {
            Some(file) => {
                let case = Case::read(&file.path)?;
                Some((file, case))
            }
            None => None,
        };
        let mut folder = Self {
            path: path.to_path_buf(),
            case,
            taps: list("taps", &RECORDINGS)?,
            receptances: list("frf", &RECEPTANCES)?,
            cuts: list("cuts", &RECORDINGS)?,
            tried: dated(path.join("tried.csv")),
            chart: dated(path.join("lobes.html")),
            table: dated(path.join("table.qct")),
            extended: dated(path.join("diagnosis/extended.toml")),
            diagnosis: dated(path.join("diagnosis/report.html")),
            broken: Vec::new(),
        };
        let recordings = folder.taps.iter().chain(&folder.cuts);
        folder.broken = broken(
            recordings
                .map(|file| (FileKind::Recording, file))
                .chain(
                    folder
                        .receptances
                        .iter()
                        .map(|file| (FileKind::Receptances, file)),
                )
                .chain(folder.tried.iter().map(|file| (FileKind::TriedCuts, file)))
                .chain(folder.table.iter().map(|file| (FileKind::LobeTable, file))),
        );
        Ok(folder)
    }
}

/// Files of a folder whose names have one of the extensions, sorted by name; none if there is no such folder.
fn files_in(folder: &Path, endings: &[&str]) -> io::Result<Vec<DatedFile>> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    let mut files = Vec::new();
    for entry in entries {
        let path = entry?.path();
        if endings.contains(&crate::file::ending(&path).as_str()) {
            files.extend(dated(path));
        }
    }
    files.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(files)
}

/// The file at a path, with the time of its last change; `None` if there is no regular file, or if this time cannot be
/// read.
fn dated(path: PathBuf) -> Option<DatedFile> {
    let about = fs::metadata(&path).ok()?;
    let changed = about.is_file().then(|| about.modified().ok()).flatten()?;
    Some(DatedFile { path, changed })
}
