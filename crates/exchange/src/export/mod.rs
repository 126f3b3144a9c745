//! Export of a record or a simulated field for other programs.

mod csv;
mod grid_rows;
mod grids;
mod hdf5;
mod levels;
mod mat;
mod netcdf;
mod npz;
mod record;
mod simulation;

use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};

use fieldgap_records::write_whole;

use crate::dataset::Dataset;
pub use grid_rows::{NoGrids, grid_rows};
pub use record::{Provenance, dataset_of_record};
pub use simulation::{dataset_of_simulation, is_simulation};

/// A format of export.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// NetCDF, classic format with 64-bit offsets.
    Netcdf,
    /// HDF5.
    Hdf5,
    /// MATLAB, level 5.
    Mat,
    /// NumPy's archive.
    Npz,
    /// Text, the readings alone.
    Csv,
}

/// Why a file was not written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The name has no known ending.
    #[error("{} does not end in .nc, .h5, .hdf5, .mat, .npz or .csv, so its format is not known", .0.display())]
    UnknownFormat(PathBuf),
    /// There is such a file.
    #[error("{} exists; give --force to replace it", .0.display())]
    Exists(PathBuf),
    /// The file system or the format refused.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
}

impl Format {
    /// The format that the ending of a file's name stands for.
    ///
    /// # Errors
    /// [`ExportError::UnknownFormat`].
    pub fn of_name(path: &Path) -> Result<Self, ExportError> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("nc") => Ok(Self::Netcdf),
            Some("h5" | "hdf5") => Ok(Self::Hdf5),
            Some("mat") => Ok(Self::Mat),
            Some("npz") => Ok(Self::Npz),
            Some("csv") => Ok(Self::Csv),
            _ => Err(ExportError::UnknownFormat(path.to_owned())),
        }
    }
}

/// Checks that a file may be written: its format is known, and it does not exist or may be replaced.
///
/// # Errors
/// [`ExportError`].
pub fn may_write(path: &Path, force: bool) -> Result<Format, ExportError> {
    let format = Format::of_name(path)?;
    if !force && path.symlink_metadata().is_ok() {
        return Err(ExportError::Exists(path.to_owned()));
    }
    Ok(format)
}

/// Writes a dataset into a file, whole or not at all.
///
/// # Errors
/// [`ExportError`]; an existing file is then unchanged.
pub fn write_dataset(dataset: &Dataset, path: &Path, force: bool) -> Result<(), ExportError> {
    let format = may_write(path, force)?;
    let written = write_whole(path, |file| {
        let mut out = BufWriter::new(file);
        write(dataset, format, &mut out)?;
        out.flush()
    });
    written.map_err(|source| ExportError::Write { path: path.to_owned(), source })
}

fn write(dataset: &Dataset, format: Format, out: &mut (impl Write + Seek)) -> io::Result<()> {
    match format {
        Format::Netcdf => netcdf::write(dataset, out),
        Format::Hdf5 => out.write_all(&hdf5::bytes(dataset)?),
        Format::Mat => mat::write(dataset, out),
        Format::Npz => npz::write(dataset, out),
        Format::Csv => csv::write(dataset, out),
    }
}

/// A dataset as the contents of a file of that name.
#[cfg(test)]
pub(crate) fn bytes_of(dataset: &Dataset, path: &Path) -> io::Result<Vec<u8>> {
    let format = Format::of_name(path).map_err(io::Error::other)?;
    let mut out = io::Cursor::new(Vec::new());
    write(dataset, format, &mut out)?;
    Ok(out.into_inner())
}
