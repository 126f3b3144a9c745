//! The base plan and the rig files of a campaign, with the values of a cell written into them.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use toml_edit::{DocumentMut, Value};

use fieldgap_acquisition::{AcquisitionError, PlannedScan, RigSetup};
use fieldgap_input::{Fault, NotAKey, TomlSource, set_key};

/// The sections of a rig file; every other key is one of the plan.
const RIG_SECTIONS: [&str; 8] =
    ["array", "medium", "motion", "receiver", "focus_array", "environment", "sensing", "virtual"];

/// Whether a key is one of the rig file: it begins with one of its sections or with `rig.`.
pub(super) fn is_of_rig(key: &str) -> bool {
    let section = key.split('.').next().unwrap_or(key);
    section == "rig" || RIG_SECTIONS.contains(&section)
}

/// A TOML file that values are written into.
#[derive(Debug, Clone)]
pub(super) struct Document {
    path: PathBuf,
    text: DocumentMut,
}

/// A bench: a rig on which the campaign runs.
#[derive(Debug, Clone)]
pub struct Bench {
    /// Name of the rig.
    pub name: String,
    pub(super) rig: Document,
}

/// Plan and rig file with the values of one cell.
#[derive(Debug, Clone)]
pub(super) struct Filled {
    plan: Document,
    rig: Document,
    rig_changed: bool,
}

impl Document {
    pub(super) fn read(source: &TomlSource) -> Result<Self, Fault> {
        let text = source.text().parse().map_err(|error: toml_edit::TomlError| {
            source.fault(error.span().unwrap_or(0..0), error.message(), "correct this line")
        })?;
        Ok(Self { path: source.path().to_owned(), text })
    }

    /// The tables of an array of tables; none without it.
    pub(super) fn tables(&self, name: &str) -> Vec<&toml_edit::Table> {
        let tables = self.text.get(name).and_then(toml_edit::Item::as_array_of_tables);
        tables.into_iter().flatten().collect()
    }

    /// The file with its values; where values were written, their `label` follows the name, so that messages name them. Relative paths stay
    /// valid.
    fn source(&self, label: &str) -> TomlSource {
        if label.is_empty() {
            return TomlSource::new(&self.path, self.text.to_string());
        }
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let named = format!("{name} ({})", label.replace('/', "|"));
        TomlSource::new(&folder.join(named), self.text.to_string())
    }
}

impl Bench {
    pub(super) fn read(path: &Path) -> Result<Self, Fault> {
        let source = TomlSource::read(path)?;
        let name = RigSetup::parse(source.clone())?.name;
        Ok(Self { name, rig: Document::read(&source)? })
    }

    /// The path of its rig file.
    pub fn path(&self) -> &Path {
        &self.rig.path
    }

    /// The rig as its file describes it.
    ///
    /// # Errors
    /// A [`Fault`] at the line that is wrong.
    pub fn setup(&self) -> Result<RigSetup, Fault> {
        RigSetup::parse(self.rig.source(""))
    }
}

impl Filled {
    pub(super) fn of(plan: &Document, bench: &Bench) -> Self {
        Self { plan: plan.clone(), rig: bench.rig.clone(), rig_changed: false }
    }

    /// Sets a key: of the rig file if it begins with one of its sections or with `rig.`, else of the plan.
    pub(super) fn set(&mut self, key: &str, value: Value) -> Result<(), NotAKey> {
        match is_of_rig(key) {
            true => {
                self.rig_changed = true;
                set_key(&mut self.rig.text, key.strip_prefix("rig.").unwrap_or(key), value)
            }
            false => set_key(&mut self.plan.text, key.strip_prefix("plan.").unwrap_or(key), value),
        }
    }

    /// A virtual rig repeats the noise of its seed: each cell gets a seed of its own, the same each time.
    fn draw_other_noise(&mut self, name: &str) {
        let devices = self.rig.text.get_mut("virtual").and_then(toml_edit::Item::as_table_like_mut);
        let Some(devices) = devices else { return };
        let seed = devices.get("seed").and_then(toml_edit::Item::as_integer).unwrap_or(0);
        let seed = i64::from(crc32fast::hash(format!("{seed} {name}").as_bytes()));
        devices.insert("seed", toml_edit::value(seed));
        self.rig_changed = true;
    }

    /// SHA-256 of both files, hexadecimal: another one means another cell.
    pub(super) fn digest(&self) -> String {
        let mut hasher = Sha256::new();
        for text in [&self.plan.text, &self.rig.text] {
            let text = text.to_string();
            hasher.update((text.len() as u64).to_le_bytes());
            hasher.update(text);
        }
        hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The scan, under a name.
    pub(super) fn scan(mut self, name: &str, label: &str) -> Result<PlannedScan, AcquisitionError> {
        self.plan.text.insert("name", toml_edit::value(name));
        self.draw_other_noise(name);
        // The current rig file is asked for its ports where nothing was written into it.
        let rig = self.rig.source(if self.rig_changed { label } else { "" });
        PlannedScan::parse(self.plan.source(label), rig)
    }
}
