//! Reader of numbers and texts from the bytes of a TDMS file.

/// Reading position in the bytes of a TDMS file, with their byte order.
#[derive(Clone, Copy)]
pub(super) struct Bytes<'a> {
    pub(super) data: &'a [u8],
    pub(super) at: usize,
    pub(super) is_big_endian: bool,
}

macro_rules! number {
    ($self:expr, $type:ty) => {{
        let mut array = [0; size_of::<$type>()];
        array.copy_from_slice($self.take(size_of::<$type>())?);
        if $self.is_big_endian {
            <$type>::from_be_bytes(array)
        } else {
            <$type>::from_le_bytes(array)
        }
    }};
}

impl<'a> Bytes<'a> {
    /// The next `length` bytes.
    pub(super) fn take(&mut self, length: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(length).filter(|end| *end <= self.data.len());
        let taken = end.and_then(|end| self.data.get(self.at..end));
        let taken = taken.ok_or_else(|| {
            format!(
                "it ends within an element of {length} bytes at byte {}: it is cut off or damaged",
                self.at
            )
        })?;
        self.at += length;
        Ok(taken)
    }

    pub(super) fn u32(&mut self) -> Result<u32, String> {
        Ok(number!(self, u32))
    }

    pub(super) fn u64(&mut self) -> Result<u64, String> {
        Ok(number!(self, u64))
    }

    /// Reads a text of a TDMS file, whose length in bytes stands before it.
    pub(super) fn text(&mut self) -> Result<String, String> {
        let length = self.u32()? as usize;
        Ok(String::from_utf8_lossy(self.take(length)?).into_owned())
    }

    /// Reads a number of TDMS data type `kind`; `None` if the data type is not a number.
    pub(super) fn number(&mut self, kind: u32) -> Result<Option<f64>, String> {
        Ok(Some(match kind {
            1 => f64::from(number!(self, i8)),
            2 => f64::from(number!(self, i16)),
            3 => f64::from(number!(self, i32)),
            4 => number!(self, i64) as f64,
            5 => f64::from(number!(self, u8)),
            6 => f64::from(number!(self, u16)),
            7 => f64::from(number!(self, u32)),
            8 => number!(self, u64) as f64,
            9 | 0x19 => f64::from(number!(self, f32)),
            10 | 0x1a => number!(self, f64),
            _ => return Ok(None),
        }))
    }
}

/// Size of one value of TDMS data type `kind`, bytes; `None` for text and unknown types.
pub(super) fn size_of_kind(kind: u32) -> Option<usize> {
    Some(match kind {
        1 | 5 | 0x21 => 1,
        2 | 6 => 2,
        3 | 7 | 9 | 0x19 => 4,
        4 | 8 | 10 | 0x1a => 8,
        0x44 => 16,
        _ => return None,
    })
}
