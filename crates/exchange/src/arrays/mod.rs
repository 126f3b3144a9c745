//! Named arrays in files of other programs: NumPy, MATLAB, HDF5 and NetCDF.
//!
//! A file is listed first, and only the requested arrays are read. Sizes are checked before memory is taken.

mod bytes;
mod hdf5;
mod mat5;
mod netcdf;
mod npy;
mod npz;

use std::path::{Path, PathBuf};

use fieldgap_input::Fault;

pub(crate) use npy::single_precision;

/// Largest number of points, as of a record.
pub(crate) const MOST_POINTS: usize = 10_000_000;

/// Most arrays of a file that are listed.
const MOST_ARRAYS: usize = 1000;

/// Why a file or an array cannot be read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ArrayError {
    /// The file ends within.
    #[error("it ends within {0}; it may have been cut off")]
    Truncated(&'static str),
    /// A part contradicts the format.
    #[error("{0}")]
    Invalid(String),
    /// Valid, but not read by this program.
    #[error("{0}")]
    Unsupported(String),
    /// An array larger than a record.
    #[error("it has {0} values; at most {MOST_POINTS} are read")]
    TooLarge(u64),
}

/// An array as a file lists it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Listed {
    pub name: String,
    /// Lengths of the dimensions as the program that wrote the file shows them.
    pub shape: Vec<usize>,
    /// Names of the dimensions, where the file has them.
    pub dimensions: Option<Vec<String>>,
    pub unit: Option<String>,
    pub complex: bool,
    pub packing: Packing,
}

/// How values are packed, by the conventions of NetCDF.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Packing {
    pub scale: f64,
    pub offset: f64,
    /// The packed values that mean a missing one.
    pub missing: Vec<f64>,
}

impl Default for Packing {
    fn default() -> Self {
        Self { scale: 1.0, offset: 0.0, missing: Vec::new() }
    }
}

/// The values of an array, the last dimension of [`Listed::shape`] fastest.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Numbers {
    pub real: Vec<f64>,
    pub imaginary: Option<Vec<f64>>,
}

/// A file with named arrays.
pub(crate) struct ArrayFile {
    pub path: PathBuf,
    /// The format in words.
    pub format: &'static str,
    pub listed: Vec<Listed>,
    contents: Contents,
}

/// What a file turned out to be.
pub(crate) enum Opened {
    /// A file with named arrays.
    Arrays(ArrayFile),
    /// Bytes in none of the formats of arrays, as those of a text are.
    Text(Vec<u8>),
}

enum Contents {
    Npy(Vec<u8>),
    Npz(npz::Archive),
    Mat5(mat5::MatFile),
    Hdf5(hdf5::Hdf5File),
    Netcdf(netcdf::NetcdfFile),
}

impl ArrayFile {
    /// Opens `bytes`, the contents of `path`.
    pub(crate) fn of_bytes(path: &Path, bytes: Vec<u8>) -> Result<Opened, Fault> {
        let listed = match &bytes {
            _ if bytes.starts_with(b"\x93NUMPY") => {
                npy::list(&bytes).map(|listed| ("NumPy array", vec![listed], Contents::Npy(bytes)))
            }
            _ if bytes.starts_with(b"PK\x03\x04") => npz::Archive::of(bytes)
                .map(|(file, listed)| ("NumPy archive", listed, Contents::Npz(file))),
            _ if bytes.starts_with(b"CDF") => netcdf::NetcdfFile::of(bytes)
                .map(|(file, listed)| ("NetCDF, classic format", listed, Contents::Netcdf(file))),
            _ if hdf5::is_hdf5(&bytes) => {
                let format = match bytes.starts_with(b"MATLAB") {
                    true => "MATLAB, version 7.3 (HDF5)",
                    false => "HDF5",
                };
                hdf5::Hdf5File::of(bytes)
                    .map(|(file, listed)| (format, listed, Contents::Hdf5(file)))
            }
            _ if mat5::is_mat5(&bytes) => mat5::MatFile::of(bytes)
                .map(|(file, listed)| ("MATLAB, version 5", listed, Contents::Mat5(file))),
            _ => return named_otherwise(path).map(|()| Opened::Text(bytes)),
        };
        let (format, listed, contents) =
            listed.map_err(|error| unreadable(path, "the file", &error))?;
        Ok(Opened::Arrays(Self { path: path.to_owned(), format, listed, contents }))
    }

    /// The values of an array of the list.
    pub(crate) fn read(&self, index: usize) -> Result<Numbers, Fault> {
        let listed = &self.listed[index];
        let numbers = match &self.contents {
            Contents::Npy(bytes) => npy::read(bytes),
            Contents::Npz(archive) => archive.read(&listed.name),
            Contents::Mat5(file) => file.read(index),
            Contents::Hdf5(file) => file.read(listed),
            Contents::Netcdf(file) => file.read(index),
        };
        let mut numbers = numbers
            .map_err(|error| unreadable(&self.path, &format!("`{}`", listed.name), &error))?;
        let Packing { scale, offset, missing } = &listed.packing;
        for value in &mut numbers.real {
            *value = if missing.contains(value) { f64::NAN } else { *value * scale + offset };
        }
        Ok(numbers)
    }
}

/// A file whose name promises arrays and whose contents are none is not read as a text.
fn named_otherwise(path: &Path) -> Result<(), Fault> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    let expected = match ending.as_deref() {
        Some("mat") => "a MAT-file of version 5, 7 or 7.3",
        Some("npy") => "a NumPy array",
        Some("npz") => "a NumPy archive",
        Some("h5" | "hdf5") => "an HDF5 file",
        Some("nc" | "nc4" | "cdf") => "a NetCDF file",
        _ => return Ok(()),
    };
    let remedy =
        "check that it was copied completely; in MATLAB, `save -v7` writes a version that is read";
    Err(Fault::of_file(path, format!("is not {expected}, as its name says"), remedy))
}

fn unreadable(path: &Path, what: &str, error: &ArrayError) -> Fault {
    let remedy = match error {
        ArrayError::Truncated(_) | ArrayError::Invalid(_) => {
            "write the file again, or restore it from a copy"
        }
        ArrayError::Unsupported(_) => {
            "write the arrays in another way; text and NumPy archives are always read"
        }
        ArrayError::TooLarge(_) => "write a part of the field, or every second point",
    };
    Fault::of_file(path, format!("{what} cannot be read: {error}"), remedy)
}

/// The number of values of an array.
fn count(shape: &[usize]) -> Result<usize, ArrayError> {
    let count = shape.iter().fold(1u64, |count, &length| count.saturating_mul(length as u64));
    match usize::try_from(count) {
        Ok(count) if count <= MOST_POINTS => Ok(count),
        _ => Err(ArrayError::TooLarge(count)),
    }
}

/// Values with the first dimension fastest, as values with the last dimension fastest.
fn row_major(values: Vec<f64>, shape: &[usize]) -> Vec<f64> {
    if shape.iter().filter(|&&length| length > 1).count() < 2 || values.is_empty() {
        return values;
    }
    let mut steps = vec![1; shape.len()];
    for index in 1..shape.len() {
        steps[index] = steps[index - 1] * shape[index - 1];
    }
    let mut ordered = Vec::with_capacity(values.len());
    let mut counters = vec![0; shape.len()];
    for _ in 0..values.len() {
        let at: usize = steps.iter().zip(&counters).map(|(step, count)| step * count).sum();
        ordered.push(values[at]);
        for index in (0..shape.len()).rev() {
            counters[index] += 1;
            if counters[index] < shape[index] {
                break;
            }
            counters[index] = 0;
        }
    }
    ordered
}

#[cfg(test)]
mod tests;
