//! NumPy's .npy format (NumPy Enhancement Proposal 1), for arrays of numbers.
//!
//! The header is a Python dictionary of three entries in a fixed form. It is searched for these and not parsed as Python, because a
//! parser of nested literals can exhaust the stack.

use super::bytes::{Endian, Kind, Reader};
use super::{ArrayError, Listed, Numbers, count, row_major};

/// Longest header, bytes. That of an array of numbers has about a hundred.
const LONGEST_HEADER: usize = 16 << 10;

/// Bytes from which a header can be read.
pub(super) const HEADER_WITHIN: usize = LONGEST_HEADER + 12;

/// What a header states.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    kind: Kind,
    endian: Endian,
    complex: bool,
    column_major: bool,
    pub shape: Vec<usize>,
    /// The byte at which the values begin.
    pub length: usize,
}

impl Header {
    pub(super) fn of(bytes: &[u8]) -> Result<Self, ArrayError> {
        let mut reader = Reader::new(bytes);
        let what = "the header of a NumPy array";
        if reader.take(6, what)? != b"\x93NUMPY" {
            return Err(ArrayError::Invalid("it does not begin as a NumPy array does".to_owned()));
        }
        let version = reader.take(2, what)?[0];
        let length = reader.little(if version == 1 { 2 } else { 4 }, what)?;
        let length = usize::try_from(length).ok().filter(|&length| length <= LONGEST_HEADER);
        let length =
            length.ok_or_else(|| ArrayError::Invalid("its header is too long".to_owned()))?;
        let text = String::from_utf8_lossy(reader.take(length, what)?).into_owned();
        let (kind, endian, complex) = number_type(value_of(&text, "descr")?)?;
        let column_major = value_of(&text, "fortran_order")?.starts_with("True");
        let shape = shape(value_of(&text, "shape")?)?;
        Ok(Self { kind, endian, complex, column_major, shape, length: reader.at() })
    }

    /// Bytes of the values.
    pub(super) fn bytes(&self) -> Result<usize, ArrayError> {
        Ok(count(&self.shape)? * self.kind.size() * if self.complex { 2 } else { 1 })
    }

    pub(super) fn listed(&self, name: &str) -> Listed {
        Listed {
            name: name.to_owned(),
            shape: self.shape.clone(),
            complex: self.complex,
            ..Listed::default()
        }
    }
}

/// The array, listed under the name `array`.
pub(super) fn list(bytes: &[u8]) -> Result<Listed, ArrayError> {
    Ok(Header::of(bytes)?.listed("array"))
}

/// The values of an array.
pub(super) fn read(bytes: &[u8]) -> Result<Numbers, ArrayError> {
    let header = Header::of(bytes)?;
    let mut reader = Reader::new(bytes);
    reader.skip(header.length);
    let values = reader.take(header.bytes()?, "the values of a NumPy array")?;
    let values = header.kind.numbers(values, header.endian);
    let ordered = |values: Vec<f64>| match header.column_major {
        true => row_major(values, &header.shape),
        false => values,
    };
    if !header.complex {
        return Ok(Numbers { real: ordered(values), imaginary: None });
    }
    let (real, imaginary) = values.chunks_exact(2).map(|pair| (pair[0], pair[1])).unzip();
    Ok(Numbers { real: ordered(real), imaginary: Some(ordered(imaginary)) })
}

/// The shape and the values of an array of three dimensions in single precision, which may be larger than a record.
pub(crate) fn single_precision(bytes: &[u8]) -> Result<([usize; 3], Vec<f32>), ArrayError> {
    let header = Header::of(bytes)?;
    let of_volume = header.kind == Kind::F32 && !header.column_major && !header.complex;
    let (true, Endian::Little, &[a, b, c]) = (of_volume, header.endian, &header.shape[..]) else {
        return Err(ArrayError::Unsupported("it is not a volume of 32-bit floats".to_owned()));
    };
    let length = a.checked_mul(b).and_then(|n| n.checked_mul(c)).and_then(|n| n.checked_mul(4));
    let mut reader = Reader::new(bytes);
    reader.skip(header.length);
    let what = "the values of a volume";
    let values = reader.take(length.ok_or(ArrayError::Truncated(what))?, what)?;
    let (values, _) = values.as_chunks();
    Ok(([a, b, c], values.iter().map(|value| f32::from_le_bytes(*value)).collect()))
}

/// What follows a key of the dictionary.
fn value_of<'t>(text: &'t str, key: &str) -> Result<&'t str, ArrayError> {
    let missing = || ArrayError::Invalid(format!("its header does not state `{key}`"));
    let after = [format!("'{key}':"), format!("\"{key}\":")]
        .iter()
        .find_map(|key| text.split_once(key.as_str()).map(|(_, after)| after));
    Ok(after.ok_or_else(missing)?.trim_start())
}

fn number_type(text: &str) -> Result<(Kind, Endian, bool), ArrayError> {
    if text.starts_with('[') {
        return Err(ArrayError::Unsupported(
            "it is a structured array; save each field as an array of its own".to_owned(),
        ));
    }
    let description = text.trim_start_matches(['\'', '"']);
    let description = description.split(['\'', '"']).next().unwrap_or("");
    let (endian, kind) = match description.split_at_checked(1) {
        Some(("<" | "|" | "=", kind)) => (Endian::Little, kind),
        Some((">", kind)) => (Endian::Big, kind),
        _ => (Endian::Little, description),
    };
    let (kind, complex) = match kind {
        "f4" => (Kind::F32, false),
        "f8" => (Kind::F64, false),
        "c8" => (Kind::F32, true),
        "c16" => (Kind::F64, true),
        "i1" => (Kind::I8, false),
        "i2" => (Kind::I16, false),
        "i4" => (Kind::I32, false),
        "i8" => (Kind::I64, false),
        "u1" | "b1" => (Kind::U8, false),
        "u2" => (Kind::U16, false),
        "u4" => (Kind::U32, false),
        "u8" => (Kind::U64, false),
        _ => {
            let shown: String = description.chars().take(20).collect();
            return Err(ArrayError::Unsupported(format!(
                "its type `{shown}` is not one of numbers"
            )));
        }
    };
    Ok((kind, endian, complex))
}

fn shape(text: &str) -> Result<Vec<usize>, ArrayError> {
    let invalid = || ArrayError::Invalid("its shape cannot be read".to_owned());
    let inside =
        text.strip_prefix('(').and_then(|text| text.split_once(')')).ok_or_else(invalid)?.0;
    let lengths = inside.split(',').map(str::trim).filter(|length| !length.is_empty());
    lengths.map(|length| length.parse().map_err(|_| invalid())).collect()
}
