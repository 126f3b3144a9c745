//! HDF5, and with it NetCDF-4 and MATLAB's MAT-file of version 7.3.

use hdf5_pure::{AttrValue, DType, Dataset, File, Group, is_hdf5_bytes};

use super::bytes::{Endian, Kind};
use super::{ArrayError, Listed, MOST_ARRAYS, Numbers, Packing, count, row_major};

/// Groups within groups that are searched.
const DEEPEST: usize = 8;

/// Whether bytes are an HDF5 file, also behind a block of its user.
pub(super) fn is_hdf5(bytes: &[u8]) -> bool {
    is_hdf5_bytes(bytes)
}

/// An HDF5 file in memory.
pub(super) struct Hdf5File(File);

impl Hdf5File {
    /// Lists the arrays of numbers; other objects are left out.
    pub(super) fn of(bytes: Vec<u8>) -> Result<(Self, Vec<Listed>), ArrayError> {
        let file = File::from_bytes(bytes).map_err(|error| invalid(&error))?;
        let mut listed = Vec::new();
        list(&file.root(), "", 0, &mut listed)?;
        name_dimensions_of_netcdf(&file, &mut listed);
        Ok((Self(file), listed))
    }

    pub(super) fn read(&self, listed: &Listed) -> Result<Numbers, ArrayError> {
        let array = self.0.dataset(&listed.name).map_err(|error| invalid(&error))?;
        let values = count(&listed.shape)?;
        if listed.complex {
            return complex(&array, &listed.shape, values);
        }
        let real = array.read_f64().map_err(|error| invalid(&error))?;
        if real.len() != values {
            return Err(ArrayError::Invalid(
                "it has not as many values as its shape says".to_owned(),
            ));
        }
        let real = if of_matlab(&array) { row_major(real, &listed.shape) } else { real };
        Ok(Numbers { real, imaginary: None })
    }
}

fn list(
    group: &Group,
    path: &str,
    depth: usize,
    listed: &mut Vec<Listed>,
) -> Result<(), ArrayError> {
    for name in group.datasets().map_err(|error| invalid(&error))? {
        if listed.len() == MOST_ARRAYS {
            return Ok(());
        }
        let Ok(array) = group.dataset(&name) else { continue };
        if let Some(array) = listed_array(&array, format!("{path}{name}")) {
            listed.push(array);
        }
    }
    if depth == DEEPEST {
        return Ok(());
    }
    for name in group.groups().map_err(|error| invalid(&error))? {
        // MATLAB keeps references in these.
        if let Ok(inner) = group.group(&name)
            && !name.starts_with('#')
        {
            list(&inner, &format!("{path}{name}/"), depth + 1, listed)?;
        }
    }
    Ok(())
}

/// NetCDF-4 numbers the dimensions: an array lists the numbers of its own, and the positions along a dimension state its number.
fn name_dimensions_of_netcdf(file: &File, listed: &mut [Listed]) {
    let numbers = |name: &str, attribute: &str| -> Option<Vec<i64>> {
        file.dataset(name).ok()?.attrs().ok()?.get(attribute)?.to_i64s()
    };
    let scales: Vec<(i64, String)> = listed
        .iter()
        .filter(|array| array.shape.len() == 1)
        .filter_map(|array| {
            Some((*numbers(&array.name, "_Netcdf4Dimid")?.first()?, array.name.clone()))
        })
        .collect();
    for array in listed.iter_mut().filter(|array| array.dimensions.is_none()) {
        let Some(own) = numbers(&array.name, "_Netcdf4Coordinates") else { continue };
        let name = |number: &i64| {
            let scale = scales.iter().find(|(known, _)| known == number);
            scale.map_or_else(|| format!("dimension {number}"), |(_, name)| name.clone())
        };
        if own.len() == array.shape.len() {
            array.dimensions = Some(own.iter().map(name).collect());
        }
    }
}

fn listed_array(array: &Dataset, name: String) -> Option<Listed> {
    let complex = match array.dtype().ok()? {
        DType::F32 | DType::F64 => false,
        DType::I8 | DType::I16 | DType::I32 | DType::I64 => false,
        DType::U8 | DType::U16 | DType::U32 | DType::U64 => false,
        DType::Compound(members) if members.len() == 2 => complex_kind(&members).map(|_| true)?,
        _ => return None,
    };
    let attributes = array.attrs().unwrap_or_default();
    let number = |name: &str| {
        let value = attributes.get(name)?;
        let integers = || Some(value.to_i64s()?.into_iter().map(|number| number as f64).collect());
        value.to_f64s().or_else(integers)?.first().copied()
    };
    let text = |name: &str| attributes.get(name).and_then(AttrValue::as_str).map(str::to_owned);
    let mut shape: Vec<usize> = array
        .shape()
        .ok()?
        .into_iter()
        .map(|length| usize::try_from(length).ok())
        .collect::<Option<_>>()?;
    let labels =
        attributes.get("DIMENSION_LABELS").and_then(AttrValue::as_strings).map(<[String]>::to_vec);
    let mut dimensions = labels.filter(|labels| {
        labels.len() == shape.len() && labels.iter().all(|label| !label.is_empty())
    });
    if dimensions.is_none() && text("CLASS").as_deref() == Some("DIMENSION_SCALE") {
        dimensions = Some(vec![name.clone()]);
    }
    if attributes.contains_key("MATLAB_class") {
        shape.reverse();
        if text("MATLAB_class").as_deref() == Some("char") {
            return None;
        }
    }
    Some(Listed {
        name,
        shape,
        dimensions,
        unit: text("units"),
        complex,
        packing: Packing {
            scale: number("scale_factor").unwrap_or(1.0),
            offset: number("add_offset").unwrap_or(0.0),
            missing: [number("_FillValue"), number("missing_value")]
                .into_iter()
                .flatten()
                .collect(),
        },
    })
}

/// The type of the parts of a complex number, which h5py names r and i, and MATLAB real and imag.
fn complex_kind(members: &[(String, DType)]) -> Option<Kind> {
    let [(real, of_real), (imaginary, of_imaginary)] = members else { return None };
    let named = matches!((real.as_str(), imaginary.as_str()), ("r", "i") | ("real", "imag"));
    match (of_real, of_imaginary) {
        (DType::F64, DType::F64) if named => Some(Kind::F64),
        (DType::F32, DType::F32) if named => Some(Kind::F32),
        _ => None,
    }
}

fn complex(array: &Dataset, shape: &[usize], values: usize) -> Result<Numbers, ArrayError> {
    let unsupported =
        || ArrayError::Unsupported("its complex numbers are not pairs of floats".to_owned());
    let DType::Compound(members) = array.dtype().map_err(|error| invalid(&error))? else {
        return Err(unsupported());
    };
    let kind = complex_kind(&members).ok_or_else(unsupported)?;
    let size = array.element_size().map_err(|error| invalid(&error))?;
    if size != 2 * kind.size() as u64 {
        return Err(unsupported());
    }
    let bytes = array.read_raw().map_err(|error| invalid(&error))?;
    let numbers = kind.numbers(&bytes, Endian::Little);
    if numbers.len() != 2 * values {
        return Err(ArrayError::Invalid("it has not as many values as its shape says".to_owned()));
    }
    let (real, imaginary): (Vec<f64>, Vec<f64>) =
        numbers.chunks_exact(2).map(|pair| (pair[0], pair[1])).unzip();
    let ordered = |part: Vec<f64>| if of_matlab(array) { row_major(part, shape) } else { part };
    Ok(Numbers { real: ordered(real), imaginary: Some(ordered(imaginary)) })
}

fn of_matlab(array: &Dataset) -> bool {
    array.attrs().is_ok_and(|attributes| attributes.contains_key("MATLAB_class"))
}

fn invalid(error: &dyn std::fmt::Display) -> ArrayError {
    ArrayError::Invalid(format!("the HDF5 file is damaged or of an unknown kind: {error}"))
}
