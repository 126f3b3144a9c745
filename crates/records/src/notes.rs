//! `notes.jsonl`: what people noted about a record, a line of JSON each. Nothing else in a record changes by a note.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use fieldgap_input::{Fault, MOST_TABLE, is_hidden, read_text, visible_line};

/// The file in the folder of a record.
const FILE: &str = "notes.jsonl";

/// Longest note, characters.
const LONGEST: usize = 1000;

/// Longest name of who notes, characters.
const LONGEST_NAME: usize = 60;

/// A note.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Note {
    /// When it was written.
    pub at: Timestamp,
    who: String,
    text: String,
    /// What it is about. Left out of the line of a plain note, which earlier versions read.
    #[serde(default, skip_serializing_if = "NoteKind::is_plain")]
    pub kind: NoteKind,
}

/// What a note is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoteKind {
    /// Anything.
    #[default]
    Note,
    /// Something was repaired or exchanged.
    Repair,
    /// Something was calibrated.
    Calibration,
    /// A figure left its limits, or a device failed.
    Alarm,
}

impl NoteKind {
    /// Every kind.
    pub const ALL: [Self; 4] = [Self::Note, Self::Repair, Self::Calibration, Self::Alarm];

    /// Its name in the file and on the command line.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Repair => "repair",
            Self::Calibration => "calibration",
            Self::Alarm => "alarm",
        }
    }

    fn is_plain(&self) -> bool {
        *self == Self::Note
    }
}

/// Why a note was not kept.
#[derive(Debug, thiserror::Error)]
pub enum NoteError {
    /// It is empty, too long, or has control characters.
    #[error(
        "a note has 1 to {LONGEST} visible characters on one line, by somebody with a name of 1 to {LONGEST_NAME}"
    )]
    Text,
    /// The file cannot be written.
    #[error("the note cannot be kept in {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl Note {
    /// A note of somebody; white space around name and text is left out.
    ///
    /// # Errors
    /// [`NoteError::Text`].
    pub fn new(at: Timestamp, who: &str, text: &str) -> Result<Self, NoteError> {
        let good = |text: &str, longest| {
            (1..=longest).contains(&text.chars().count()) && !text.chars().any(is_hidden)
        };
        let (who, text) = (who.trim(), text.trim());
        if !good(who, LONGEST_NAME) || !good(text, LONGEST) {
            return Err(NoteError::Text);
        }
        Ok(Self { at, who: who.to_owned(), text: text.to_owned(), kind: NoteKind::Note })
    }

    /// The same note, about something.
    pub fn of_kind(self, kind: NoteKind) -> Self {
        Self { kind, ..self }
    }

    /// Who wrote it.
    pub fn who(&self) -> &str {
        &self.who
    }

    /// What it says.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Adds it to those of the record in `folder`.
    ///
    /// # Errors
    /// [`NoteError::Write`].
    pub fn add_to(&self, folder: &Path) -> Result<(), NoteError> {
        let path = folder.join(FILE);
        let mut line = serde_json::to_vec(self)
            .map_err(|error| NoteError::Write { path: path.clone(), source: error.into() })?;
        line.push(b'\n');
        // One write of a whole line: two people at once do not mix theirs.
        OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .and_then(|mut file| file.write_all(&line).and_then(|()| file.sync_all()))
            .map_err(|source| NoteError::Write { path, source })
    }

    /// The notes of the record in `folder`, the oldest first.
    ///
    /// # Errors
    /// The file cannot be read, or a line is no note.
    pub fn all_of(folder: &Path) -> Result<Vec<Self>, Fault> {
        let path = folder.join(FILE);
        let text = match read_text(&path, MOST_TABLE) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => {
                return Err(Fault::of_file(
                    &path,
                    format!("cannot be read: {error}"),
                    "check the file",
                ));
            }
        };
        let note = |(n, line): (usize, &str)| {
            let read = serde_json::from_str::<Self>(line);
            let note = read.map_err(|error| (n, error.to_string()))?;
            let checked = Self::new(note.at, &note.who, &note.text);
            checked.map(|plain| plain.of_kind(note.kind)).map_err(|error| (n, error.to_string()))
        };
        let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        lines.map(note).collect::<Result<_, _>>().map_err(|(n, problem)| {
            Fault::of_file(
                &path,
                format!("line {} is no note: {}", n + 1, visible_line(&problem)),
                "remove the line, or write it as `fieldgap note` does",
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn notes_are_kept_in_their_order() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(Note::all_of(folder.path()).expect("none"), []);
        let at = Timestamp::UNIX_EPOCH;
        let notes = [("Ada", "swapped the \"pre-amplifier\""), ("Bob", " measured again ")]
            .map(|(who, text)| Note::new(at, who, text).expect("a note"));
        notes.iter().for_each(|note| note.add_to(folder.path()).expect("kept"));
        assert_eq!(Note::all_of(folder.path()).expect("read"), notes);
        assert_eq!((notes[1].who(), notes[1].text()), ("Bob", "measured again"));
    }

    #[test]
    fn a_kind_is_kept_and_a_line_without_one_is_a_plain_note() {
        let folder = tempfile::tempdir().expect("a folder");
        let line = "{\"at\":\"1970-01-01T00:00:00Z\",\"who\":\"Ada\",\"text\":\"as before\"}\n";
        std::fs::write(folder.path().join(FILE), line).expect("written");
        let plain = Note::new(Timestamp::UNIX_EPOCH, "Ada", "as before").expect("a note");
        let notes = NoteKind::ALL.map(|kind| plain.clone().of_kind(kind));
        notes.iter().for_each(|note| note.add_to(folder.path()).expect("kept"));
        let read = Note::all_of(folder.path()).expect("read");
        assert_eq!((&read[0], &read[1..]), (&plain, &notes[..]));
        let text = std::fs::read_to_string(folder.path().join(FILE)).expect("there");
        assert!(text.starts_with(&line.repeat(2)), "{text}");
        for kind in NoteKind::ALL {
            let name = serde_json::to_string(&kind).expect("a name");
            assert_eq!(name, format!("\"{}\"", kind.as_str()));
        }
    }

    #[test]
    fn what_is_no_note_is_refused() {
        let at = Timestamp::UNIX_EPOCH;
        let long = "a".repeat(LONGEST + 1);
        for (who, text) in
            [("Ada", ""), ("", "text"), ("Ada", "two\nlines"), ("Ada", "\u{1b}[2J"), ("Ada", &long)]
        {
            assert!(Note::new(at, who, text).is_err(), "{who:?} {text:?}");
        }
        let folder = tempfile::tempdir().expect("a folder");
        let line = "{\"at\":\"2026-01-01T00:00:00Z\",\"who\":\"Ada\",\"text\":\"good\"}\n";
        std::fs::write(folder.path().join(FILE), format!("{line}{{\"at\":1}}\n")).expect("written");
        let fault = Note::all_of(folder.path()).expect_err("a wrong line").to_string();
        assert!(fault.contains("line 2 is no note"), "{fault}");
    }

    proptest! {
        #[test]
        fn whatever_the_file_holds_nothing_panics(text in "\\PC{0,200}|(\\{\"at\":\"2026-01-01T00:00:00Z\",\"who\":\"\\PC{0,9}\",\"text\":\"\\PC{0,9}\"\\}\n){0,3}") {
            let folder = tempfile::tempdir().expect("a folder");
            std::fs::write(folder.path().join(FILE), text).expect("written");
            let _ = Note::all_of(folder.path());
        }
    }
}
