//! Decoder of the numbers of binary files.

/// Type of the numbers in a block of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl NumberType {
    /// The integer type of `size` bytes; `None` if there is none.
    pub(super) fn integer(size: usize, is_signed: bool) -> Option<Self> {
        Some(match (size, is_signed) {
            (1, true) => Self::I8,
            (1, false) => Self::U8,
            (2, true) => Self::I16,
            (2, false) => Self::U16,
            (4, true) => Self::I32,
            (4, false) => Self::U32,
            (8, true) => Self::I64,
            (8, false) => Self::U64,
            _ => return None,
        })
    }

    /// Size of one number, bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Decodes the numbers in `data` and passes each to `take`; bytes after the last whole number are left out.
    pub(super) fn decode(self, data: &[u8], is_big_endian: bool, mut take: impl FnMut(f64)) {
        macro_rules! decode {
            ($type:ty) => {
                for bytes in data.chunks_exact(size_of::<$type>()) {
                    let mut array = [0; size_of::<$type>()];
                    array.copy_from_slice(bytes);
                    take(if is_big_endian {
                        <$type>::from_be_bytes(array) as f64
                    } else {
                        <$type>::from_le_bytes(array) as f64
                    });
                }
            };
        }
        match self {
            Self::I8 => decode!(i8),
            Self::U8 => decode!(u8),
            Self::I16 => decode!(i16),
            Self::U16 => decode!(u16),
            Self::I32 => decode!(i32),
            Self::U32 => decode!(u32),
            Self::I64 => decode!(i64),
            Self::U64 => decode!(u64),
            Self::F32 => decode!(f32),
            Self::F64 => decode!(f64),
        }
    }
}
