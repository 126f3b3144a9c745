//! MATLAB's MAT-file of version 5 and 7 (*MAT-File Format*, The MathWorks): full matrices of numbers.
//!
//! The libraries at hand read no complex numbers or no more than two dimensions, refuse a file for one text in it, and unpack
//! without a bound.

use std::io::Read;
use std::ops::Range;

use flate2::read::ZlibDecoder;

use super::bytes::{Endian, Kind, Reader};
use super::{ArrayError, Listed, MOST_ARRAYS, Numbers, count, row_major};
use crate::mat5_tags::{
    COMPRESSED, DOUBLE, DOUBLE_CLASS, INT8, INT16, INT32, INT64, MATRIX, SINGLE, UINT8, UINT16,
    UINT32, UINT64, UINT64_CLASS,
};

const HEADER: usize = 128;

/// Flag of a complex matrix.
const COMPLEX: u64 = 1 << 11;

/// Bytes that flags, size and name of a matrix take at most.
const HEAD: usize = 4096;

/// Most dimensions of a matrix.
const MOST_DIMENSIONS: usize = 16;

/// Whether bytes begin as a MAT-file does.
pub(super) fn is_mat5(bytes: &[u8]) -> bool {
    bytes.get(124..128).is_some_and(|end| end == b"\x00\x01IM" || end == b"\x01\x00MI")
}

/// A MAT-file in memory.
pub(super) struct MatFile {
    bytes: Vec<u8>,
    /// Where the listed matrices are, and whether they are compressed.
    matrices: Vec<(Range<usize>, bool)>,
}

/// What a matrix states before its values.
struct Head {
    name: String,
    /// Whether it holds numbers, and not text, cells or structures.
    numbers: bool,
    complex: bool,
    shape: Vec<usize>,
    /// The byte of the matrix at which the values begin.
    length: usize,
}

impl MatFile {
    /// Lists the matrices of numbers; other variables are left out.
    pub(super) fn of(bytes: Vec<u8>) -> Result<(Self, Vec<Listed>), ArrayError> {
        if bytes[126] != b'I' {
            return Err(ArrayError::Unsupported(
                "it was written with the most significant byte first".to_owned(),
            ));
        }
        let (mut matrices, mut listed) = (Vec::new(), Vec::new());
        let mut reader = Reader::new(&bytes);
        reader.skip(HEADER);
        while reader.left() >= 8 && listed.len() < MOST_ARRAYS {
            let kind = reader.little(4, "a variable")? as u32;
            let length = reader.little(4, "a variable")? as usize;
            let start = reader.at();
            reader.take(length, "a variable")?;
            let compressed = match kind {
                COMPRESSED => true,
                MATRIX => false,
                // Padding or a type that holds no variable.
                _ => continue,
            };
            let range = start..start + length;
            let head = Head::of(&unpacked(&bytes[range.clone()], compressed, HEAD)?)?;
            if head.numbers {
                listed.push(Listed {
                    name: head.name,
                    shape: head.shape,
                    complex: head.complex,
                    ..Listed::default()
                });
                matrices.push((range, compressed));
            }
        }
        Ok((Self { bytes, matrices }, listed))
    }

    pub(super) fn read(&self, index: usize) -> Result<Numbers, ArrayError> {
        let (range, compressed) = &self.matrices[index];
        let packed = &self.bytes[range.clone()];
        let head = Head::of(&unpacked(packed, *compressed, HEAD)?)?;
        let values = count(&head.shape)?;
        // Real and imaginary parts of eight bytes each, with their tags.
        let most = HEAD + 2 * (8 * values + 16);
        let matrix = unpacked(packed, *compressed, most)?;
        let mut reader = Reader::new(&matrix);
        reader.skip(head.length);
        let mut part = || -> Result<Vec<f64>, ArrayError> {
            let (kind, bytes) = element(&mut reader, "the values of a matrix")?;
            let numbers = kind_of(kind)?.numbers(bytes, Endian::Little);
            match numbers.len() == values {
                true => Ok(row_major(numbers, &head.shape)),
                false => Err(ArrayError::Invalid(
                    "a matrix has not as many values as its size says".to_owned(),
                )),
            }
        };
        Ok(Numbers { real: part()?, imaginary: if head.complex { Some(part()?) } else { None } })
    }
}

impl Head {
    /// The head of a matrix, without its own tag.
    fn of(matrix: &[u8]) -> Result<Self, ArrayError> {
        let what = "the description of a matrix";
        let mut reader = Reader::new(matrix);
        let (_, flags) = element(&mut reader, what)?;
        let flags = Reader::new(flags).little(4, what)?;
        let class = (flags & 0xff) as u32;
        let (_, size) = element(&mut reader, what)?;
        if size.len() > 4 * MOST_DIMENSIONS {
            return Err(ArrayError::Invalid("a matrix has too many dimensions".to_owned()));
        }
        let shape = Kind::I32.numbers(size, Endian::Little);
        // Negative lengths become 0, and no values fit them.
        let shape = shape.into_iter().map(|length| length as usize).collect();
        let (_, name) = element(&mut reader, what)?;
        let name = String::from_utf8_lossy(name).trim_end_matches('\0').to_owned();
        Ok(Self {
            name,
            numbers: (DOUBLE_CLASS..=UINT64_CLASS).contains(&class),
            complex: flags & COMPLEX != 0,
            shape,
            length: reader.at(),
        })
    }
}

/// The contents of a matrix without its tag, at most so many bytes.
fn unpacked(packed: &[u8], compressed: bool, most: usize) -> Result<Vec<u8>, ArrayError> {
    if !compressed {
        return Ok(packed[..packed.len().min(most)].to_vec());
    }
    let mut bytes = Vec::new();
    // The tag of the matrix is packed too.
    let mut decoder = ZlibDecoder::new(packed).take(most as u64 + 8);
    decoder.read_to_end(&mut bytes).map_err(|error| {
        ArrayError::Invalid(format!("a compressed variable is damaged: {error}"))
    })?;
    if bytes.len() < 8 {
        return Err(ArrayError::Truncated("a variable"));
    }
    bytes.drain(..8);
    Ok(bytes)
}

/// The next element: its type and its bytes. Those of up to four bytes stand in the tag.
fn element<'b>(reader: &mut Reader<'b>, what: &'static str) -> Result<(u32, &'b [u8]), ArrayError> {
    let first = reader.little(4, what)? as u32;
    let (kind, small) = (first & 0xffff, (first >> 16) as usize);
    if small > 4 {
        return Err(ArrayError::Invalid("an element has an impossible size".to_owned()));
    }
    if small > 0 {
        let bytes = reader.take(4, what)?;
        return Ok((kind, &bytes[..small]));
    }
    let length = reader.little(4, what)? as usize;
    let bytes = reader.take(length, what)?;
    reader.skip(length.next_multiple_of(8) - length);
    Ok((kind, bytes))
}

fn kind_of(kind: u32) -> Result<Kind, ArrayError> {
    Ok(match kind {
        INT8 => Kind::I8,
        UINT8 => Kind::U8,
        INT16 => Kind::I16,
        UINT16 => Kind::U16,
        INT32 => Kind::I32,
        UINT32 => Kind::U32,
        SINGLE => Kind::F32,
        DOUBLE => Kind::F64,
        INT64 => Kind::I64,
        UINT64 => Kind::U64,
        other => return Err(ArrayError::Invalid(format!("values of the unknown type {other}"))),
    })
}
