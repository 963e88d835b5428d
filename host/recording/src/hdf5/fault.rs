//! Faults of an HDF5 file.

/// Reason why an HDF5 file is not read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Fault {
    /// The operating system cannot read the file.
    #[error("at byte {at}: {cause}")]
    Read {
        /// Offset in the file.
        at: u64,
        /// Cause of the operating system.
        cause: std::io::Error,
    },
    /// A block lies beyond the end of the file.
    #[error("a block of {length} bytes at byte {at} lies beyond its end: it is cut off or damaged")]
    CutOff {
        /// Offset of the block in the file; the largest integer if the address is beyond every file.
        at: u64,
        /// Length of the block, bytes.
        length: u64,
    },
    /// A structure is shorter than its own counts state.
    #[error("{part} is shorter than its counts state: it is damaged")]
    Short {
        /// The structure.
        part: &'static str,
    },
    /// A structure has a value that no valid file has.
    #[error("{part} is {value}, which cannot be: it is damaged")]
    Value {
        /// Place of the value.
        part: &'static str,
        /// The value.
        value: u64,
    },
    /// A block does not begin with the letters that mark its kind.
    #[error("there is no {expected} at byte {at}: it is damaged")]
    Mark {
        /// Letters that mark the kind of block.
        expected: &'static str,
        /// Offset in the file.
        at: u64,
    },
    /// The file uses a part of the format that this program does not read.
    #[error("it uses {what}, which is not read; save it with -v7")]
    Unsupported {
        /// The part of the format, with its number.
        what: String,
    },
    /// The headers of the file refer to the same blocks again and again.
    #[error(
        "its headers refer to more than {limit} bytes of headers, in a file of {length} bytes: it is damaged"
    )]
    Circles {
        /// Bytes of headers that are read at most.
        limit: u64,
        /// Length of the file, bytes.
        length: u64,
    },
    /// Values of a dataset were never written.
    #[error("only {found} of its {expected} {what} were written: the others would be made up")]
    Unwritten {
        /// Number that was written.
        found: u64,
        /// Number that the dimensions require.
        expected: u64,
        /// Values or chunks.
        what: &'static str,
    },
    /// Compressed data cannot be decompressed, or have another length or checksum than stated.
    #[error("the block of samples at byte {at} cannot be decompressed ({what}): it is damaged")]
    Filter {
        /// Offset of the block in the file.
        at: u64,
        /// Fault of the data.
        what: String,
    },
}
