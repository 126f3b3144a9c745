//! The rig: its check, its wires, its file corrected by what a record shows.

use std::process::Stdio;

use axum::body::Bytes;
use axum::extract::{Path, State};
use jiff::Timestamp;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::process::Command;

use crate::answer::Answer;
use crate::app::App;
use crate::correction::{self, Correction};
use crate::records;
use crate::refusal::{Refusal, parsed};
use crate::wire;

/// Runs `fieldgap rig check`, which opens each device and moves none.
pub(crate) async fn check(State(app): State<App>) -> Result<Answer<Value>, Refusal> {
    if app.hand().is_open() || app.is_busy() || app.scan_runs() {
        return Err(Refusal::conflict(
            "the rig is in use",
            "close the rig by hand, or wait for the end of the scan",
        ));
    }
    let mut command = Command::new(app.program());
    command.args(["rig", "check", "--json"]).arg(app.rig()).stdin(Stdio::null());
    let failed =
        |problem: String| Refusal::failed(problem, "run `fieldgap rig check` in a terminal");
    let done = command.output().await.map_err(|error| failed(error.to_string()))?;
    // A rig that cannot scan ends the program with an error, after its report.
    serde_json::from_slice(&done.stdout).map(Answer).map_err(|_| {
        let words = String::from_utf8_lossy(&done.stderr);
        failed(fieldgap_input::visible_line(words.trim()).into_owned())
    })
}

pub(crate) async fn wires(State(app): State<App>) -> Result<Answer<Value>, Refusal> {
    let folder = app.shown_folder();
    let read = move || {
        folder.map(|folder| wire::last_minute(&folder, Timestamp::now())).unwrap_or_default()
    };
    let wires = tokio::task::spawn_blocking(read).await;
    let wires = wires.map_err(|error| Refusal::failed(error.to_string(), "report this error"))?;
    Ok(Answer(json!(wires)))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Correct {
    /// Whether the new file is kept; else its lines are only shown.
    keep: bool,
}

pub(crate) async fn correct(
    State(app): State<App>,
    Path(record): Path<String>,
    body: Bytes,
) -> Result<Answer<Correction>, Refusal> {
    let Correct { keep } = parsed(&body)?;
    let folder = records::folder(app.records(), &record)?;
    let _one_at_a_time = app.correcting().await;
    correction::correct(app.program(), &folder, app.rig(), keep).await.map(Answer)
}
