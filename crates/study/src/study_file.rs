//! The file of a study.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::IgnoredAny;
use toml::Spanned;
use toml_edit::Value;

use super::documents::{Documents, StudyFiles};
use super::sweep::{Sweep, SweepTable};
use fieldgap_acoustics::Simulator;
use fieldgap_input::{Fault, TomlSource, file_name};

/// Most combinations of values.
const MOST_POINTS: usize = 100_000;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StudyTable {
    name: Spanned<String>,
    rig: Option<Spanned<PathBuf>>,
    draws: Option<NonZeroU32>,
    // Read for each combination of values.
    #[serde(rename = "array")]
    _array: Option<Spanned<IgnoredAny>>,
    #[serde(rename = "medium")]
    _medium: Option<Spanned<IgnoredAny>>,
    #[serde(rename = "focus")]
    _focus: Option<IgnoredAny>,
    #[serde(rename = "simulator")]
    _simulator: Option<IgnoredAny>,
    #[serde(rename = "map")]
    _map: Option<IgnoredAny>,
    #[serde(default)]
    sweep: Vec<Spanned<SweepTable>>,
}

/// A study: a set-up, and one or two sweeps over it.
#[derive(Debug, Clone)]
pub struct Study {
    /// Its name; a valid file name.
    pub name: String,
    /// One or two sweeps.
    pub sweeps: Vec<Sweep>,
    /// Number of arrays for a random layout; their seeds count up from that of the array.
    pub draws: u32,
    pub(super) documents: Documents,
    source: TomlSource,
}

/// An unknown study of the thesis.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the thesis has no study `{0}`; its studies are shape, height, count, spacing and comparison"
)]
pub struct UnknownStudy(String);

impl Study {
    /// The studies of the thesis: names and files.
    pub const OF_THESIS: [(&'static str, &'static str); 5] = [
        ("shape", include_str!("thesis/shape.toml")),
        ("height", include_str!("thesis/height.toml")),
        ("count", include_str!("thesis/count.toml")),
        ("spacing", include_str!("thesis/spacing.toml")),
        ("comparison", include_str!("thesis/comparison.toml")),
    ];

    /// The file of a study of the thesis.
    ///
    /// # Errors
    /// [`UnknownStudy`] if there is none of that name.
    pub fn of_thesis(name: &str) -> Result<TomlSource, UnknownStudy> {
        let found = Self::OF_THESIS.iter().find(|(known, _)| *known == name);
        let (name, text) = found.ok_or_else(|| UnknownStudy(name.to_owned()))?;
        Ok(TomlSource::new(Path::new(&format!("study {name}")), *text))
    }

    /// Reads a study file. The path of its rig file is relative to its folder.
    ///
    /// # Errors
    /// A [`Fault`] at the first invalid key or value. The swept values are checked when the study runs.
    pub fn read(source: TomlSource) -> Result<Self, Fault> {
        let file: StudyTable = source.parse()?;
        let rig = match &file.rig {
            None => None,
            Some(rig) => {
                for (key, section) in [("array", &file._array), ("medium", &file._medium)] {
                    if let Some(section) = section {
                        return Err(source.fault(
                            section.span(),
                            format!("[{key}] is given by `rig` already"),
                            "remove this section, or `rig`",
                        ));
                    }
                }
                let folder = source.path().parent().unwrap_or(Path::new(""));
                let path = folder.join(rig.get_ref());
                Some(TomlSource::read(&path).map_err(|fault| {
                    source.fault(
                        rig.span(),
                        fault.to_string(),
                        "give the path of a rig file, relative to this file's folder",
                    )
                })?)
            }
        };
        Self::of_sources(source, rig)
    }

    fn of_sources(source: TomlSource, rig: Option<TomlSource>) -> Result<Self, Fault> {
        let file: StudyTable = source.parse()?;
        let name = file_name(&file.name, "the folder of the study", &source)?;
        let documents = Documents::parse(&source, rig.as_ref())?;
        let sweeps = sweeps(&file.sweep, &documents, &source)?;
        let draws = draws(file.draws, &sweeps, &source)?;
        Ok(Self { name, sweeps, draws, documents, source })
    }

    /// The files in their present state, from which another process makes the same study.
    pub fn files(&self) -> StudyFiles {
        self.documents.files()
    }

    /// The study of such files.
    ///
    /// # Errors
    /// A [`Fault`] at the first invalid key or value.
    pub fn of_files(files: &StudyFiles) -> Result<Self, Fault> {
        let source = TomlSource::new(&files.study.0, files.study.1.as_str());
        let rig = files.rig.as_ref().map(|(path, text)| TomlSource::new(path, text.as_str()));
        Self::of_sources(source, rig)
    }

    /// The same study with a value set in its file: `key` as in a sweep, `value` as in TOML, or plain text.
    ///
    /// # Errors
    /// A [`Fault`] if the file is then invalid.
    pub fn with(mut self, key: &str, value: &str) -> Result<Self, Fault> {
        let label = format!("{key} = {value}");
        let parsed: Value = value.parse().unwrap_or_else(|_| Value::from(value));
        self.documents.set(key, parsed.decorated(" ", "")).map_err(|error| {
            Fault::of_file(self.source.path(), error.to_string(), "name the section and the key")
        })?;
        let path = self.source.path().to_owned();
        let source = TomlSource::new(&path, self.documents.study_source("").text());
        let file: StudyTable = self.documents.study_source(&label).parse()?;
        self.sweeps = sweeps(&file.sweep, &self.documents, &source)?;
        self.draws = draws(file.draws, &self.sweeps, &source)?;
        self.name = file_name(&file.name, "the folder of the study", &source)?;
        Ok(Self { source, ..self })
    }

    /// The same study with another simulator.
    ///
    /// # Errors
    /// A [`Fault`] if the study sweeps over the simulator.
    pub fn with_simulator(self, simulator: Simulator) -> Result<Self, Fault> {
        let swept = self.sweeps.iter().find(|sweep| {
            sweep.parameters.iter().any(|key| key.split('.').next() == Some("simulator"))
        });
        if let Some(sweep) = swept {
            return Err(self.source.fault(
                sweep.place.clone(),
                format!("the study sweeps over the simulator, so that {simulator} cannot be chosen for all values"),
                "remove one of the two",
            ));
        }
        self.with("simulator.model", &simulator.to_string())
    }

    /// The file in its present state.
    pub fn source(&self) -> &TomlSource {
        &self.source
    }

    /// Number of combinations of values.
    pub fn points(&self) -> usize {
        self.sweeps.iter().map(|sweep| sweep.values.len()).product()
    }
}

/// The number of draws, if their fields can be computed for all values.
fn draws(draws: Option<NonZeroU32>, sweeps: &[Sweep], source: &TomlSource) -> Result<u32, Fault> {
    let draws = draws.map_or(1, NonZeroU32::get);
    let points: usize = sweeps.iter().map(|sweep| sweep.values.len()).product();
    if points.saturating_mul(draws as usize) > MOST_POINTS {
        return Err(Fault::of_file(
            source.path(),
            format!(
                "{draws} draws at {points} combinations of values are more than {MOST_POINTS} fields"
            ),
            "give fewer `draws`, or choose larger steps of the sweeps",
        ));
    }
    Ok(draws)
}

fn sweeps(
    tables: &[Spanned<SweepTable>],
    documents: &Documents,
    source: &TomlSource,
) -> Result<Vec<Sweep>, Fault> {
    if tables.is_empty() || tables.len() > 2 {
        let place = tables.get(2).map_or(0..0, Spanned::span);
        return Err(source.fault(
            place,
            format!("{} sweeps; a study has one or two [[sweep]]", tables.len()),
            "keys with common values are one sweep: parameter = [\"array.columns\", \"array.rows\"]",
        ));
    }
    let items = documents.study().get("sweep").and_then(|item| item.as_array_of_tables());
    let Some(items) = items else {
        return Err(source.fault(
            tables[0].span(),
            "must be an array of tables",
            "write [[sweep]]",
        ));
    };
    let sweeps = tables
        .iter()
        .zip(items)
        .map(|(table, item)| Sweep::read(table, item, source))
        .collect::<Result<Vec<Sweep>, Fault>>()?;
    let points: usize = sweeps.iter().map(|sweep| sweep.values.len()).product();
    if points > MOST_POINTS {
        return Err(source.fault(
            tables[0].span(),
            format!("{points} combinations of values; at most {MOST_POINTS} are allowed"),
            "choose larger steps",
        ));
    }
    Ok(sweeps)
}
