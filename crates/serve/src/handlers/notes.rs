//! Notes about records.

use axum::Extension;
use axum::body::Bytes;
use axum::extract::{Path, State};
use jiff::Timestamp;
use serde::Deserialize;

use fieldgap_records::{Note, NoteError};

use crate::access::sessions::Who;
use crate::answer::Answer;
use crate::app::App;
use crate::records;
use crate::refusal::{Refusal, parsed};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NewNote {
    text: String,
}

pub(crate) async fn all(
    State(app): State<App>,
    Path(name): Path<String>,
) -> Result<Answer<Vec<Note>>, Refusal> {
    let folder = records::folder(app.records(), &name)?;
    let notes = Note::all_of(&folder);
    notes.map(Answer).map_err(|fault| Refusal::conflict(fault.to_string(), "mend the file"))
}

pub(crate) async fn add(
    State(app): State<App>,
    Extension(who): Extension<Option<Who>>,
    Path(name): Path<String>,
    body: Bytes,
) -> Result<Answer<Note>, Refusal> {
    let folder = records::folder(app.records(), &name)?;
    let NewNote { text } = parsed(&body)?;
    let who = who.ok_or_else(Refusal::unauthorized)?;
    let note = Note::new(Timestamp::now(), &who.name, &text)
        .map_err(|error| Refusal::bad(error.to_string(), "write a line of text"))?;
    let kept = note.add_to(&folder);
    kept.map_err(|error: NoteError| Refusal::failed(error.to_string(), "check the disk"))?;
    Ok(Answer(note))
}
