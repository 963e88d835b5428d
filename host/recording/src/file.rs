//! Reads whole files, and writes files atomically: into a temporary file beside the target, then renamed.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

/// Error of reading or writing a file; the message names the file.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The file does not exist or cannot be read.
    #[error("{}: cannot read it: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: io::Error,
    },
    /// The file is not UTF-8 text.
    #[error("{}: byte {offset} is not UTF-8; a text file is needed", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Offset of the first byte that is not UTF-8, counted from the start of the file, from 0.
        offset: usize,
    },
    /// The file cannot be written, for example: missing folder, no permission, disk full.
    #[error("{}: cannot write it: {cause}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: io::Error,
    },
}

/// Reads all bytes of a file.
pub fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    std::fs::read(path).map_err(|cause| FileError::Read {
        path: path.into(),
        cause,
    })
}

/// Reads a file as UTF-8 text.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    String::from_utf8(read(path)?).map_err(|error| FileError::NotText {
        path: path.into(),
        offset: error.utf8_error().valid_up_to(),
    })
}

/// Writes `bytes` to `path` atomically: on an error the previous file stays unchanged.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    write_with(path, |writer| writer.write_all(bytes))
}

/// Paths of the temporary files of writes in progress. The lock is held while a temporary file is created or renamed.
static ASIDE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Locks the list of temporary files of writes in progress.
fn being_written() -> MutexGuard<'static, Vec<PathBuf>> {
    ASIDE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary files of all writes in progress and blocks every later write, so that an interrupt leaves no
/// half-written file. Only for a process that is about to exit.
pub fn abandon_writing() {
    let mut aside = being_written();
    for path in aside.drain(..) {
        // A temporary file that cannot be removed stays on the disk; the process is about to exit.
        let _ = std::fs::remove_file(path);
    }
    // The lock on the list of temporary files is never released: a write in progress waits for it until the process
    // exits.
    std::mem::forget(aside);
}

/// Writes `path` atomically with the content that `fill` writes: on an error the previous file stays unchanged.
pub fn write_with(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), FileError> {
    publish([prepare(path, fill)?])
}

/// A file that is complete on the disk under a temporary name. [`publish`] gives it its final name; without that it is
/// removed when dropped.
#[derive(Debug)]
pub struct Prepared {
    path: PathBuf,
    /// The temporary file; `None` once [`publish`] has taken it.
    aside: Option<NamedTempFile>,
}

impl Drop for Prepared {
    fn drop(&mut self) {
        if let Some(aside) = self.aside.take() {
            let mut known = being_written();
            known.retain(|other| other != aside.path());
            drop(aside);
        }
    }
}

/// Writes the content of the later file `path` under a temporary name in the same folder; `fill` writes the content.
///
/// # Errors
/// The file cannot be written.
pub fn prepare(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<Prepared, FileError> {
    let failed = |cause| FileError::Write {
        path: path.into(),
        cause,
    };
    let aside = {
        let mut known = being_written();
        let aside = aside(path).map_err(failed)?;
        known.push(aside.path().into());
        aside
    };
    let name = aside.path().to_owned();
    match filled(aside, fill) {
        Ok(aside) => Ok(Prepared {
            path: path.into(),
            aside: Some(aside),
        }),
        Err(cause) => {
            being_written().retain(|other| *other != name);
            Err(failed(cause))
        }
    }
}

/// Renames prepared files to their final names, one after the other; [`abandon_writing`] waits until this is done.
///
/// # Errors
/// A file cannot be renamed: it and those after it are removed, and the previous files of those names stay.
pub fn publish<const N: usize>(files: [Prepared; N]) -> Result<(), FileError> {
    let mut known = being_written();
    let mut outcome = Ok(());
    for mut file in files {
        let Some(aside) = file.aside.take() else { continue };
        known.retain(|other| other != aside.path());
        if outcome.is_ok() {
            outcome = aside
                .persist(&file.path)
                .map(|_| ())
                .map_err(|error| FileError::Write {
                    path: file.path.clone(),
                    cause: error.error,
                });
        }
    }
    outcome
}

/// Writes the content that `fill` writes to the temporary file and syncs it to the disk; on an error the temporary file
/// is removed.
fn filled(
    aside: NamedTempFile,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<NamedTempFile> {
    let mut writer = BufWriter::new(aside);
    fill(&mut writer)?;
    let aside = writer.into_inner()?;
    aside.as_file().sync_all()?;
    Ok(aside)
}

/// File extension in lower case, without the dot; empty if there is none.
pub fn ending(path: &Path) -> String {
    path.extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase()
}

/// Creates a temporary file in the folder of `path`: a rename within one file system is atomic.
fn aside(path: &Path) -> io::Result<NamedTempFile> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".quietcut-");
    // A temporary file is readable by its owner only unless another mode is set; with this mode the finished file has
    // the permissions of any new file.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, b"old").unwrap();
        let failed = write_with(&path, |writer| {
            writer.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert!(matches!(failed, Err(FileError::Write { .. })));
        assert_eq!(read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn endings_are_in_lower_case_and_empty_where_there_is_none() {
        for (name, expected) in [
            ("a/b.CSV", "csv"),
            ("a.b/c", ""),
            ("t.tar.Gz", "gz"),
            (".svg", ""),
        ] {
            assert_eq!(ending(Path::new(name)), expected, "{name}");
        }
    }

    #[test]
    fn a_missing_folder_and_a_missing_file_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no/such.txt");
        for error in [write(&path, b"").unwrap_err(), read(&path).unwrap_err()] {
            assert!(error.to_string().contains("no/such.txt"), "{error}");
        }
    }

    #[test]
    fn bytes_that_are_no_text_are_located() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, b"abc\xff").unwrap();
        assert!(matches!(
            read_text(&path),
            Err(FileError::NotText { offset: 3, .. })
        ));
    }
}
