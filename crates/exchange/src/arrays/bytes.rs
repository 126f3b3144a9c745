//! Numbers in bytes.

use super::ArrayError;

/// The type of numbers in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
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

/// The order of the bytes of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Endian {
    Little,
    Big,
}

impl Kind {
    /// Bytes of a number.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// All numbers in `bytes`; a rest that is too short for a number is ignored.
    pub(super) fn numbers(self, bytes: &[u8], endian: Endian) -> Vec<f64> {
        macro_rules! decode {
            ($kind:ty) => {
                bytes
                    .chunks_exact(size_of::<$kind>())
                    .map(|chunk| {
                        let mut number = [0; size_of::<$kind>()];
                        number.copy_from_slice(chunk);
                        match endian {
                            Endian::Little => <$kind>::from_le_bytes(number) as f64,
                            Endian::Big => <$kind>::from_be_bytes(number) as f64,
                        }
                    })
                    .collect()
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

/// Takes bytes from the front of a slice.
pub(super) struct Reader<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl<'b> Reader<'b> {
    pub(super) fn new(bytes: &'b [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Bytes taken so far.
    pub(super) fn at(&self) -> usize {
        self.at
    }

    /// Bytes left.
    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next bytes; `what` they are part of is for the error.
    pub(super) fn take(
        &mut self,
        length: usize,
        what: &'static str,
    ) -> Result<&'b [u8], ArrayError> {
        let end = self.at.checked_add(length).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or(ArrayError::Truncated(what))?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    /// Skips bytes, as far as there are some.
    pub(super) fn skip(&mut self, length: usize) {
        self.at = self.at.saturating_add(length).min(self.bytes.len());
    }

    /// An unsigned number of as many bytes, little-endian.
    pub(super) fn little(&mut self, size: usize, what: &'static str) -> Result<u64, ArrayError> {
        Ok(self
            .take(size, what)?
            .iter()
            .rev()
            .fold(0, |number, &byte| number << 8 | u64::from(byte)))
    }

    /// The same, big-endian.
    pub(super) fn big(&mut self, size: usize, what: &'static str) -> Result<u64, ArrayError> {
        Ok(self.take(size, what)?.iter().fold(0, |number, &byte| number << 8 | u64::from(byte)))
    }
}
