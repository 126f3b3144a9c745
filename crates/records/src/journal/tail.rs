//! The journal of a scan that another process is running, read as it grows.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::SETUP;
use super::record::{self, Record};
use crate::samples_csv::{Columns, SampleLimits, samples_of};
use crate::setup::ScanSetup;
use crate::table::Table;
use fieldgap_input::Fault;

/// Most bytes read at once: about 100,000 records. The rest is read by the next call.
const MOST_AT_ONCE: u64 = 16 << 20;

/// Reads each record of a growing journal once. It locks nothing and changes nothing.
#[derive(Debug)]
pub struct JournalTail {
    path: PathBuf,
    setup: ScanSetup,
    columns: Option<Columns>,
    read: u64,
    rows: usize,
}

impl JournalTail {
    /// For the scan in `folder`, from its first record on.
    ///
    /// # Errors
    /// A [`Fault`] of the set-up of the scan.
    pub fn open(folder: &Path) -> Result<Self, Fault> {
        let setup = ScanSetup::read(&folder.join(SETUP))?;
        Ok(Self { path: folder.join(record::FILE), setup, columns: None, read: 0, rows: 0 })
    }

    /// The set-up of the scan.
    pub fn setup(&self) -> &ScanSetup {
        &self.setup
    }

    /// Number of records read so far, which is the row of the next one.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The records that were completed since the last call, in their order. A record that is being written is left for a later call.
    ///
    /// # Errors
    /// A [`Fault`] if the file cannot be read, or if a complete record has values that no scan writes.
    pub fn read_new(&mut self) -> Result<Vec<Record>, Fault> {
        let bytes = self.new_bytes().map_err(|error| {
            let remedy = "check that the folder of the record is still there";
            Fault::of_file(&self.path, format!("cannot be read: {error}"), remedy)
        })?;
        let mut rest = bytes.as_slice();
        let columns = match self.columns {
            Some(columns) => columns,
            None => {
                let Some((columns, length)) = record::columns_of(rest) else {
                    return Ok(Vec::new());
                };
                rest = &rest[length..];
                self.read += length as u64;
                *self.columns.insert(columns)
            }
        };
        let (mut commanded, mut samples) = (Vec::new(), columns.header());
        for line in rest.split_inclusive(|&byte| byte == b'\n') {
            let Some((to_mm, sample)) = record::checked(line, self.rows + commanded.len()) else {
                break;
            };
            self.read += line.len() as u64;
            commanded.push(to_mm);
            samples += sample;
            samples.push('\n');
        }
        if commanded.is_empty() {
            return Ok(Vec::new());
        }
        self.rows += commanded.len();
        let limits = SampleLimits::of(&self.setup);
        let (_, samples) = samples_of(&Table::new(&self.path, samples), &limits)?;
        let records = commanded.into_iter().zip(samples);
        Ok(records.map(|(commanded_mm, sample)| Record { commanded_mm, sample }).collect())
    }

    fn new_bytes(&self) -> io::Result<Vec<u8>> {
        let mut file = match File::open(&self.path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(error),
        };
        file.seek(SeekFrom::Start(self.read))?;
        let mut bytes = Vec::new();
        file.take(MOST_AT_ONCE).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}
