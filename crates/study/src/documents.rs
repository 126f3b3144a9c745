//! The files of a study's set-up, with swept values written into them.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use toml_edit::{DocumentMut, Value};

use fieldgap_input::{Fault, NotAKey, TomlSource, set_key};

/// The sections that are in the rig file, if the study names one.
const RIG_SECTIONS: [&str; 2] = ["array", "medium"];

/// The file of a study and the rig file that it names, if any.
#[derive(Debug, Clone)]
pub(super) struct Documents {
    study: (PathBuf, DocumentMut),
    rig: Option<(PathBuf, DocumentMut)>,
}

/// The files of a study, with all values set: from them another process makes the same study. Paths are absolute where those of the study are.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StudyFiles {
    /// Path and text of the study file.
    pub study: (PathBuf, String),
    /// Path and text of the rig file that it names, if any.
    pub rig: Option<(PathBuf, String)>,
}

impl Documents {
    /// Takes the text of a study and of its rig file.
    ///
    /// # Errors
    /// A [`Fault`] at invalid TOML.
    pub fn parse(study: &TomlSource, rig: Option<&TomlSource>) -> Result<Self, Fault> {
        let document = |source: &TomlSource| -> Result<(PathBuf, DocumentMut), Fault> {
            let parsed = source.text().parse().map_err(|error: toml_edit::TomlError| {
                let range = error.span().unwrap_or(0..0);
                source.fault(range, error.message(), "correct this line")
            })?;
            Ok((source.path().to_owned(), parsed))
        };
        Ok(Self { study: document(study)?, rig: rig.map(document).transpose()? })
    }

    /// Paths and texts, in their present state.
    pub fn files(&self) -> StudyFiles {
        let file = |(path, document): &(PathBuf, DocumentMut)| (path.clone(), document.to_string());
        StudyFiles { study: file(&self.study), rig: self.rig.as_ref().map(file) }
    }

    /// The study's own document.
    pub fn study(&self) -> &DocumentMut {
        &self.study.1
    }

    /// Sets a dotted key. Missing sections are added.
    ///
    /// # Errors
    /// [`NotAKey`] if a part of the path is a value.
    pub fn set(&mut self, key: &str, value: Value) -> Result<(), NotAKey> {
        let section = key.split('.').next().unwrap_or(key);
        let document = match &mut self.rig {
            Some((_, rig)) if RIG_SECTIONS.contains(&section) => rig,
            _ => &mut self.study.1,
        };
        set_key(document, key, value)
    }

    /// The study's file in its present state, with `label` added to its name.
    pub fn study_source(&self, label: &str) -> TomlSource {
        source(&self.study, label)
    }

    /// The file with the array and the medium, in its present state.
    pub fn rig_source(&self, label: &str) -> TomlSource {
        source(self.rig.as_ref().unwrap_or(&self.study), label)
    }
}

/// The name has the written values, for faults; relative paths in the file stay valid.
fn source((path, document): &(PathBuf, DocumentMut), label: &str) -> TomlSource {
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into());
    let label =
        if label.is_empty() { name } else { format!("{name} ({})", label.replace('/', "|")) };
    let folder = path.parent().unwrap_or(Path::new(""));
    TomlSource::new(&folder.join(label), document.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "name = \"n\"\n[array]\ncolumns = 6 # across\n[focus]\nx_mm = 1.0\n";

    fn documents() -> Documents {
        let study = TomlSource::new(Path::new("a/s.toml"), TEXT);
        Documents::parse(&study, None).expect("TOML")
    }

    #[test]
    fn a_value_is_replaced_and_the_rest_is_unchanged() {
        let mut documents = documents();
        documents.set("array.columns", Value::from(3)).expect("a key");
        documents.set("map.step_mm", Value::from(0.5)).expect("a key");
        let source = documents.study_source("array.columns = 3");
        assert_eq!(source.path(), Path::new("a/s.toml (array.columns = 3)"));
        let text = TEXT.replace("6 #", "3 #") + "\n[map]\nstep_mm = 0.5\n";
        assert_eq!(source.text(), text);
    }

    #[test]
    fn array_and_medium_are_changed_in_the_rig_file_if_there_is_one() {
        let study = TomlSource::new(Path::new("s.toml"), "[focus]\nx_mm = 1.0\n");
        let rig = TomlSource::new(Path::new("r.toml"), "[array]\ncolumns = 6\n");
        let mut documents = Documents::parse(&study, Some(&rig)).expect("TOML");
        documents.set("array.columns", Value::from(3)).expect("a key");
        documents.set("focus.x_mm", Value::from(2.0)).expect("a key");
        assert_eq!(documents.rig_source("").text(), "[array]\ncolumns = 3\n");
        assert_eq!(documents.study_source("").text(), "[focus]\nx_mm = 2.0\n");
    }
}
