//! Bounds on the values of a MAT-file, whatever sizes its headers state.

/// Memory that the values of any MAT-file may take, bytes, however short the file is: one million samples of eight
/// channels of 8 bytes. Constant channels of this size compress to almost nothing. The size is a choice.
const VALUES_MIN: u64 = 64 << 20;

/// Memory that the values of a MAT-file may take per byte of the file, bytes. One-byte integers that become 8-byte
/// numbers need a factor of 8, and measured channels compress by a factor below 20: together 160.
const VALUES_PER_BYTE: u64 = 200;

/// Largest number of values of a variable for which memory is reserved before they are read; in a MAT-file with more
/// bytes than this number, its length in bytes takes its place. A choice; it bounds the cost of a header with a false
/// size.
const TRUSTED: u64 = 1 << 16;

/// Largest number of levels of nested structures and cells of a MAT-file that are read. A choice; recordings have one
/// or two levels.
pub(super) const DEPTH_MAX: usize = 6;

/// Largest total number of field values of all structures and elements of all cells of a MAT-file. A choice; a record
/// in a structure array has a few fields.
const ELEMENTS_MAX: usize = 100_000;

/// Memory that the values of one MAT-file may still take: a bound against false sizes in its headers.
pub(super) struct ValueMemory {
    /// Length of the file, bytes.
    file: u64,
    /// Memory that values of the MAT-file may still take, bytes.
    bytes: u64,
    /// Number of field values of structures and elements of cells of the MAT-file that may still be read.
    elements: usize,
}

impl ValueMemory {
    /// Memory for the values of a MAT-file of `length` bytes.
    pub(super) fn new(length: u64) -> Self {
        Self {
            file: length,
            bytes: length.saturating_mul(VALUES_PER_BYTE).max(VALUES_MIN),
            elements: ELEMENTS_MAX,
        }
    }

    /// Deducts the memory of `count` values of variable `name` from what the values of the MAT-file may still take; an
    /// error if that does not suffice.
    pub(super) fn take(&mut self, name: &str, count: u64) -> Result<(), String> {
        let needed = count.saturating_mul(size_of::<f64>() as u64);
        self.bytes = self.bytes.checked_sub(needed).ok_or_else(|| {
            format!(
                "variable \"{name}\" has {count} values, more than a file of {} bytes can hold: {} bytes per byte of the file are \
                 allowed. The file is damaged, or save it without compression (-v6)",
                self.file, VALUES_PER_BYTE
            )
        })?;
        Ok(())
    }

    /// Counts `count` more field values of structure `name`, or elements of cell `name`; an error if the MAT-file has
    /// more than [`ELEMENTS_MAX`].
    pub(super) fn take_elements(&mut self, name: &str, count: usize) -> Result<(), String> {
        self.elements = self.elements.checked_sub(count).ok_or_else(|| {
            format!("structure \"{name}\" has more than {ELEMENTS_MAX} elements; save the records as vectors")
        })?;
        Ok(())
    }

    /// Largest number of samples per channel for which memory is reserved before the samples of a variable with
    /// `channels` channels are read.
    pub(super) fn trusted(&self, channels: usize) -> usize {
        usize::try_from(self.file.max(TRUSTED) / channels.max(1) as u64 + 1).unwrap_or(usize::MAX)
    }
}
