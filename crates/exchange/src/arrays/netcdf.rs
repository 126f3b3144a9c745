//! NetCDF's classic formats CDF-1, CDF-2 and CDF-5 (*NetCDF Classic Format Specification*, Unidata).
//!
//! The library at hand reserves memory for as many entries as a header states, before they are there.

use super::bytes::{Endian, Kind, Reader};
use super::{ArrayError, Listed, MOST_ARRAYS, Numbers, Packing, count};
use crate::netcdf_tags::{
    ATTRIBUTES, BYTE, CHAR, DIMENSIONS, DOUBLE, FLOAT, INT, INT64, SHORT, UBYTE, UINT, UINT64,
    USHORT, VARIABLES,
};

const WHAT: &str = "the header of a NetCDF file";

/// Most dimensions of an array.
const MOST_DIMENSIONS: u64 = 64;

/// A NetCDF file in memory.
pub(super) struct NetcdfFile {
    bytes: Vec<u8>,
    arrays: Vec<Array>,
    /// Bytes from one record to the next.
    record_bytes: u64,
}

/// Where the values of an array are.
struct Array {
    kind: Kind,
    begin: u64,
    shape: Vec<usize>,
    /// Whether its first dimension is that of the records.
    in_records: bool,
}

/// The value of an attribute.
enum Attribute {
    Text(String),
    Numbers(Vec<f64>),
}

/// A header is read with numbers of these sizes.
struct Header<'b> {
    reader: Reader<'b>,
    /// Bytes of a count.
    count: usize,
    /// Bytes of an offset.
    offset: usize,
}

impl NetcdfFile {
    pub(super) fn of(bytes: Vec<u8>) -> Result<(Self, Vec<Listed>), ArrayError> {
        let (count, offset) = match bytes.get(3) {
            Some(1) => (4, 4),
            Some(2) => (4, 8),
            Some(5) => (8, 8),
            _ => {
                return Err(ArrayError::Unsupported(
                    "it is of an unknown version of NetCDF".to_owned(),
                ));
            }
        };
        let mut header = Header { reader: Reader::new(&bytes), count, offset };
        header.reader.skip(4);
        let stated = header.count()?;
        let dimensions = header.list(DIMENSIONS, |header| Ok((header.name()?, header.count()?)))?;
        header.list(ATTRIBUTES, Header::attribute)?;
        let variables = header.list(VARIABLES, Header::variable)?;
        let in_records = |ids: &[usize]| {
            ids.first().and_then(|id| dimensions.get(*id)).is_some_and(|(_, length)| *length == 0)
        };
        let of_records: Vec<u64> =
            variables.iter().filter(|v| in_records(&v.dimensions)).map(|v| v.bytes).collect();
        let record_bytes = of_records.iter().fold(0u64, |sum, bytes| sum.saturating_add(*bytes));
        // A writer that streams leaves the number of records open.
        let unknown = u64::MAX >> (64 - 8 * count);
        let records = if stated == unknown { 0 } else { stated };
        let (mut arrays, mut listed) = (Vec::new(), Vec::new());
        for variable in variables {
            let Some(kind) = kind_of(variable.kind) else { continue };
            let mut names = Vec::new();
            let mut shape = Vec::new();
            for id in &variable.dimensions {
                let invalid =
                    || ArrayError::Invalid(format!("`{}` has an unknown dimension", variable.name));
                let (name, length) = dimensions.get(*id).ok_or_else(invalid)?;
                let length = if *length == 0 { records } else { *length };
                names.push(name.clone());
                shape.push(usize::try_from(length).map_err(|_| ArrayError::TooLarge(length))?);
            }
            let in_records = in_records(&variable.dimensions);
            listed.push(Listed {
                name: variable.name,
                shape: shape.clone(),
                dimensions: Some(names),
                unit: text(&variable.attributes, "units"),
                complex: false,
                packing: packing(&variable.attributes),
            });
            arrays.push(Array { kind, begin: variable.begin, shape, in_records });
        }
        // The values of a single array in records are not padded.
        let record_bytes = match (&of_records[..], arrays.iter().find(|array| array.in_records)) {
            ([_], Some(only)) => count_of_record(only)? * only.kind.size() as u64,
            _ => record_bytes,
        };
        Ok((Self { bytes, arrays, record_bytes }, listed))
    }

    pub(super) fn read(&self, index: usize) -> Result<Numbers, ArrayError> {
        let array = &self.arrays[index];
        let values = count(&array.shape)?;
        let piece = |begin: u64, values: usize| -> Result<Vec<f64>, ArrayError> {
            let mut reader = Reader::new(&self.bytes);
            reader.skip(usize::try_from(begin).unwrap_or(usize::MAX));
            let bytes = reader.take(values * array.kind.size(), "the values of an array")?;
            Ok(array.kind.numbers(bytes, Endian::Big))
        };
        if !array.in_records {
            return Ok(Numbers { real: piece(array.begin, values)?, imaginary: None });
        }
        let of_record = count_of_record(array)? as usize;
        let mut real = Vec::new();
        for record in 0..array.shape[0] as u64 {
            let begin = array.begin.saturating_add(record.saturating_mul(self.record_bytes));
            real.extend(piece(begin, of_record)?);
        }
        Ok(Numbers { real, imaginary: None })
    }
}

/// Values of one record of an array.
fn count_of_record(array: &Array) -> Result<u64, ArrayError> {
    Ok(count(array.shape.get(1..).unwrap_or_default())? as u64)
}

struct Variable {
    name: String,
    dimensions: Vec<usize>,
    attributes: Vec<(String, Attribute)>,
    kind: u32,
    bytes: u64,
    begin: u64,
}

impl Header<'_> {
    fn count(&mut self) -> Result<u64, ArrayError> {
        self.reader.big(self.count, WHAT)
    }

    fn list<T>(
        &mut self,
        tag: u32,
        mut entry: impl FnMut(&mut Self) -> Result<T, ArrayError>,
    ) -> Result<Vec<T>, ArrayError> {
        let found = self.reader.big(4, WHAT)? as u32;
        let length = self.count()?;
        if length == 0 {
            return Ok(Vec::new());
        }
        if found != tag || length > MOST_ARRAYS as u64 {
            return Err(ArrayError::Invalid("its header is damaged".to_owned()));
        }
        (0..length).map(|_| entry(self)).collect()
    }

    fn padded(&mut self, length: u64) -> Result<&[u8], ArrayError> {
        let length = usize::try_from(length).map_err(|_| ArrayError::Truncated(WHAT))?;
        let taken = self.reader.take(length, WHAT)?;
        self.reader.skip(length.next_multiple_of(4) - length);
        Ok(taken)
    }

    fn name(&mut self) -> Result<String, ArrayError> {
        let length = self.count()?;
        Ok(String::from_utf8_lossy(self.padded(length)?).into_owned())
    }

    fn attribute(&mut self) -> Result<(String, Attribute), ArrayError> {
        let name = self.name()?;
        let kind = self.reader.big(4, WHAT)? as u32;
        let length = self.count()?;
        if kind == CHAR {
            let text =
                String::from_utf8_lossy(self.padded(length)?).trim_end_matches('\0').to_owned();
            return Ok((name, Attribute::Text(text)));
        }
        let kind = kind_of(kind)
            .ok_or_else(|| ArrayError::Invalid("an attribute has an unknown type".to_owned()))?;
        let bytes = self.padded(length.saturating_mul(kind.size() as u64))?;
        Ok((name, Attribute::Numbers(kind.numbers(bytes, Endian::Big))))
    }

    fn variable(&mut self) -> Result<Variable, ArrayError> {
        let name = self.name()?;
        let length = self.count()?;
        if length > MOST_DIMENSIONS {
            return Err(ArrayError::Invalid(format!("`{name}` has too many dimensions")));
        }
        let dimensions = (0..length)
            .map(|_| Ok(usize::try_from(self.count()?).unwrap_or(usize::MAX)))
            .collect::<Result<Vec<usize>, ArrayError>>()?;
        let attributes = self.list(ATTRIBUTES, Self::attribute)?;
        let kind = self.reader.big(4, WHAT)? as u32;
        let bytes = self.count()?;
        let begin = self.reader.big(self.offset, WHAT)?;
        Ok(Variable { name, dimensions, attributes, kind, bytes, begin })
    }
}

fn kind_of(kind: u32) -> Option<Kind> {
    Some(match kind {
        BYTE => Kind::I8,
        SHORT => Kind::I16,
        INT => Kind::I32,
        FLOAT => Kind::F32,
        DOUBLE => Kind::F64,
        UBYTE => Kind::U8,
        USHORT => Kind::U16,
        UINT => Kind::U32,
        INT64 => Kind::I64,
        UINT64 => Kind::U64,
        _ => return None,
    })
}

fn text(attributes: &[(String, Attribute)], wanted: &str) -> Option<String> {
    attributes.iter().find_map(|(name, value)| match value {
        Attribute::Text(text) if name == wanted => Some(text.clone()),
        _ => None,
    })
}

fn packing(attributes: &[(String, Attribute)]) -> Packing {
    let number = |wanted: &str| {
        attributes.iter().find_map(|(name, value)| match value {
            Attribute::Numbers(numbers) if name == wanted => numbers.first().copied(),
            _ => None,
        })
    };
    Packing {
        scale: number("scale_factor").unwrap_or(1.0),
        offset: number("add_offset").unwrap_or(0.0),
        missing: [number("_FillValue"), number("missing_value")].into_iter().flatten().collect(),
    }
}
