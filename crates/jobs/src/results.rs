//! Files of results: a first line that says of what, and a line for each item.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::batch::{Batch, FORMAT};
use super::error::JobError;
use super::work::{Failure, Product};

/// Most bytes of a line: a plane of four million values, as base64, takes a tenth of it.
const MOST_LINE: u64 = 256 << 20;

/// The result of one item.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ItemResult {
    /// Number of the item.
    pub item: usize,
    /// What it gave, or why it failed.
    pub product: Result<Product, Failure>,
}

/// The first line. The whole of a batch has no shard in it, so that it does not depend on their number.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    format: u32,
    kind: String,
    software: String,
    digest: String,
    #[serde(skip_serializing_if = "Option::is_none", default)]
    shard: Option<usize>,
    first: usize,
    items: usize,
}

impl Head {
    fn of(batch: &Batch, shard: Option<usize>) -> Self {
        let slice = shard.map_or(0..batch.items().len(), |shard| batch.slice(shard));
        Self {
            format: FORMAT,
            kind: batch.kind().to_owned(),
            software: batch.software().to_owned(),
            digest: batch.digest().to_owned(),
            shard,
            first: slice.start,
            items: slice.len(),
        }
    }
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line<'l> {
    item: usize,
    #[serde(borrow, skip_serializing_if = "Option::is_none", default)]
    result: Option<&'l RawValue>,
    #[serde(borrow, skip_serializing_if = "Option::is_none", default)]
    bytes: Option<Cow<'l, str>>,
    #[serde(borrow, skip_serializing_if = "Option::is_none", default)]
    failed: Option<Cow<'l, str>>,
}

/// Writes the first line of the results of a shard, or of the whole batch.
pub(crate) fn write_head(
    to: &mut impl Write,
    batch: &Batch,
    shard: Option<usize>,
) -> io::Result<()> {
    let line = serde_json::to_string(&Head::of(batch, shard))?;
    writeln!(to, "{line}")
}

/// Writes the line of an item.
pub(crate) fn write_item(to: &mut impl Write, result: &ItemResult) -> io::Result<()> {
    let mut line = Line { item: result.item, result: None, bytes: None, failed: None };
    match &result.product {
        Ok(Product::Json(text)) if text.contains('\n') => {
            return Err(io::Error::new(io::ErrorKind::InvalidData, "JSON of several lines"));
        }
        Ok(Product::Json(text)) => line.result = Some(serde_json::from_str(text)?),
        Ok(Product::Bytes(bytes)) => line.bytes = Some(STANDARD.encode(bytes).into()),
        Err(failure) => line.failed = Some(failure.to_string().into()),
    }
    let line = serde_json::to_string(&line)?;
    writeln!(to, "{line}")
}

/// The results in a file, in the order of the items.
#[derive(Debug)]
pub struct Results<R = BufReader<File>> {
    reader: R,
    path: PathBuf,
    head: Head,
    /// Lines that were read.
    line: usize,
    /// The text of the last one.
    text: Vec<u8>,
    over: bool,
}

impl Results {
    pub(crate) fn open(path: &Path, batch: &Batch, shard: Option<usize>) -> Result<Self, JobError> {
        let file = File::open(path).map_err(JobError::reading(path))?;
        Self::read(BufReader::with_capacity(1 << 18, file), path, batch, shard)
    }
}

impl<R: BufRead> Results<R> {
    /// Reads results of a shard of a batch, or of the whole one, from any source; `path` is its name in errors.
    ///
    /// # Errors
    /// [`JobError::Damaged`] if the first line is not of this batch and shard.
    pub fn read(
        reader: R,
        path: &Path,
        batch: &Batch,
        shard: Option<usize>,
    ) -> Result<Self, JobError> {
        let head = Head::of(batch, shard);
        let mut results =
            Self { reader, path: path.to_owned(), head, line: 0, text: Vec::new(), over: false };
        results.read_line()?;
        let found: Head =
            serde_json::from_slice(&results.text).map_err(|e| results.damaged(e.to_string()))?;
        if found != results.head {
            return Err(results.damaged("these are results of another batch or shard"));
        }
        Ok(results)
    }

    fn damaged(&self, problem: impl Into<String>) -> JobError {
        JobError::Damaged {
            path: self.path.clone(),
            line: self.line.max(1),
            problem: problem.into(),
        }
    }

    fn read_line(&mut self) -> Result<(), JobError> {
        self.text.clear();
        let read = self.reader.by_ref().take(MOST_LINE).read_until(b'\n', &mut self.text);
        read.map_err(JobError::reading(&self.path))?;
        self.line += 1;
        match self.text.last() {
            Some(b'\n') => Ok(()),
            Some(_) if self.text.len() as u64 == MOST_LINE => {
                Err(self.damaged("the line is too long"))
            }
            _ => Err(self.damaged("the file ends here, before its last item")),
        }
    }

    /// The next line, as it stands in the file and as a result.
    pub(crate) fn next_line(&mut self) -> Option<Result<(&[u8], ItemResult), JobError>> {
        if self.over {
            return None;
        }
        match self.one() {
            Ok(Some(result)) => Some(Ok((&self.text, result))),
            Ok(None) => {
                self.over = true;
                None
            }
            Err(error) => {
                self.over = true;
                Some(Err(error))
            }
        }
    }

    fn one(&mut self) -> Result<Option<ItemResult>, JobError> {
        // The first line has been read.
        let number = self.line - 1;
        if number == self.head.items {
            let rest = self.reader.fill_buf().map_err(JobError::reading(&self.path))?;
            if !rest.is_empty() {
                self.line += 1;
                return Err(self.damaged("there is more than the items of the batch"));
            }
            return Ok(None);
        }
        self.read_line()?;
        let item = self.head.first + number;
        let line: Line<'_> =
            serde_json::from_slice(&self.text).map_err(|error| self.damaged(error.to_string()))?;
        if line.item != item {
            return Err(
                self.damaged(format!("item {} stands where item {item} belongs", line.item))
            );
        }
        let product = match (line.result, line.bytes, line.failed) {
            (Some(json), None, None) => Ok(Product::Json(json.get().to_owned())),
            (None, Some(text), None) => match STANDARD.decode(text.as_bytes()) {
                Ok(bytes) => Ok(Product::Bytes(bytes)),
                Err(error) => return Err(self.damaged(error.to_string())),
            },
            (None, None, Some(why)) => Err(Failure::new(why)),
            _ => return Err(self.damaged("an item has one of `result`, `bytes` and `failed`")),
        };
        Ok(Some(ItemResult { item, product }))
    }
}

impl<R: BufRead> Iterator for Results<R> {
    type Item = Result<ItemResult, JobError>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.next_line()?.map(|(_, result)| result))
    }
}
