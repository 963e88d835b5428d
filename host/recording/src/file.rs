//! Files that are whole or not there: written aside, then renamed.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

/// A file that could not be read or written; the message names it.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The file is not there, or may not be read.
    #[error("{}: cannot read it: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: io::Error,
    },
    /// The file is not text.
    #[error("{}: byte {offset} is not UTF-8; a text file is needed", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// The first byte that does not belong.
        offset: usize,
    },
    /// The file cannot be written: no such folder, no right, no space.
    #[error("{}: cannot write it: {cause}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: io::Error,
    },
}

/// The bytes of a file.
pub fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    std::fs::read(path).map_err(|cause| FileError::Read {
        path: path.into(),
        cause,
    })
}

/// The text of a file.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    String::from_utf8(read(path)?).map_err(|error| FileError::NotText {
        path: path.into(),
        offset: error.utf8_error().valid_up_to(),
    })
}

/// Writes `bytes` to `path`: afterwards the file is there whole, or what was there before still is.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    write_with(path, |writer| writer.write_all(bytes))
}

/// Files that are being written aside. Who holds it may create, rename and remove such files.
static ASIDE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn being_written() -> MutexGuard<'static, Vec<PathBuf>> {
    ASIDE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes every file that is being written aside, and keeps all later writes from beginning or ending: for a process that is
/// about to exit, so that an interrupt leaves no half-written file.
pub fn abandon_writing() {
    let mut aside = being_written();
    for path in aside.drain(..) {
        // Nothing can be done about a file that cannot be removed.
        let _ = std::fs::remove_file(path);
    }
    // The lock stays taken: a write that is going on waits there until the process has exited.
    std::mem::forget(aside);
}

/// Writes what `fill` writes to `path`: afterwards the file is there whole, or what was there before still is.
pub fn write_with(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), FileError> {
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
    let filled = filled(aside, fill);
    let mut known = being_written();
    known.retain(|other| *other != name);
    filled
        .and_then(|aside| Ok(aside.persist(path)?))
        .map(|_| ())
        .map_err(failed)
}

/// The file with what `fill` writes, on the disk; removed where that fails.
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

/// What stands behind the last dot of a file's name, in lower case; empty where there is none.
pub fn ending(path: &Path) -> String {
    path.extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase()
}

/// A new file beside `path`, on the same file system, so that renaming it is atomic.
fn aside(path: &Path) -> io::Result<NamedTempFile> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".quietcut-");
    // A temporary file is private to its owner; a result has the rights of any other file.
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
