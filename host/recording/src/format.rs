//! Format of a file: by its extension or, where that says nothing, by its first bytes.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::RecordingError;
use crate::file::FileError;

/// Number of bytes by which a format is recognized; a choice, above the headers of all formats.
const FIRST: u64 = 4096;

/// Format of a recording or a table of frequency response functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Text table.
    Text,
    /// WAV.
    Wav,
    /// MAT-file.
    Mat,
    /// LabVIEW measurement file.
    Lvm,
    /// TDMS.
    Tdms,
    /// Universal file format, text or binary.
    Uff,
}

impl Format {
    /// Format of a file.
    ///
    /// The endings csv, txt, dat, tsv and asc are text tables, wav, mat, lvm, tdms, uff, unv and bunv the formats of
    /// these names. A file with another ending is read by its first bytes: `RIFF`, `MATLAB`, HDF5, `TDSm`, the first
    /// line of a LabVIEW measurement file or `-1` of UFF; else text, if there is no byte 0 in it or a byte order mark
    /// before it.
    ///
    /// # Errors
    /// The file cannot be read, or the ending is unknown and the first bytes are of no format.
    pub fn of(path: &Path) -> Result<Self, RecordingError> {
        let ending = crate::file::ending(path);
        Ok(match ending.as_str() {
            "csv" | "txt" | "dat" | "tsv" | "asc" => Self::Text,
            "wav" => Self::Wav,
            "mat" => Self::Mat,
            "tdms" => Self::Tdms,
            "uff" | "unv" | "bunv" => Self::Uff,
            _ => {
                let found = Self::of_bytes(&first_bytes(path)?);
                match (ending.as_str(), found) {
                    // Some programs export tables without the header of LabVIEW under its ending.
                    ("lvm", found) => found.filter(|found| *found == Self::Text).unwrap_or(Self::Lvm),
                    (_, Some(found)) => found,
                    _ => {
                        return Err(RecordingError::Format {
                            path: path.into(),
                            found: ending,
                        });
                    }
                }
            }
        })
    }

    fn of_bytes(bytes: &[u8]) -> Option<Self> {
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let first_line = text
            .split(|&byte| byte == b'\n')
            .map(<[u8]>::trim_ascii)
            .find(|line| !line.is_empty())
            .unwrap_or_default();
        let has_wide_mark = bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff");
        if bytes.starts_with(b"RIFF") {
            Some(Self::Wav)
        } else if bytes.starts_with(b"MATLAB") || bytes.starts_with(b"\x89HDF") {
            Some(Self::Mat)
        } else if bytes.starts_with(b"TDSm") {
            Some(Self::Tdms)
        } else if first_line == b"-1" {
            Some(Self::Uff)
        } else if first_line.starts_with(b"LabVIEW Measurement") {
            Some(Self::Lvm)
        } else if has_wide_mark || !bytes.is_empty() && !bytes.contains(&0) && !bytes.starts_with(b"PK") {
            Some(Self::Text)
        } else {
            None
        }
    }
}

fn first_bytes(path: &Path) -> Result<Vec<u8>, RecordingError> {
    let unreadable = |cause| FileError::Read {
        path: path.into(),
        cause,
    };
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(unreadable)?;
    file.take(FIRST).read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_with_other_endings_are_known_by_their_first_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let of = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            Format::of(&path).ok()
        };
        for (name, bytes, expected) in [
            ("a.csv", &b""[..], Some(Format::Text)),
            ("a.frf", b"Frequency (Hz)\tReal\tImag\n", Some(Format::Text)),
            ("a", b"t,fx\n0,1\n", Some(Format::Text)),
            ("a.prn", b"\xff\xfet\0", Some(Format::Text)),
            ("a.uf", b"    -1\n    58\n", Some(Format::Uff)),
            ("a.lvm", b"LabVIEW Measurement\t\n", Some(Format::Lvm)),
            ("a.lvm", b"t\tfx\n0\t1\n", Some(Format::Text)),
            ("a.h5", b"\x89HDF\r\n\x1a\n", Some(Format::Mat)),
            ("a.xlsx", b"PK\x03\x04", None),
            ("a.npy", b"\x93NUMPY\x01\0", None),
            ("a.bin", b"", None),
        ] {
            assert_eq!(of(name, bytes), expected, "{name}");
        }
    }
}
