//! Plans, and the scans that run them.

use axum::Extension;
use axum::body::Bytes;
use axum::extract::{Path, State};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::access::sessions::Who;
use crate::answer::Answer;
use crate::app::App;
use crate::exposure::Accepted;
use crate::plans::{self, Checked, Listed};
use crate::queue::MOST_WAITING;
use crate::refusal::{Refusal, blocking, parsed};
use crate::scan_process::{self, Ask};

pub(crate) async fn list(State(app): State<App>) -> Result<Answer<Vec<Listed>>, Refusal> {
    blocking(move || plans::list(app.plans(), app.rig())).await.map(Answer)
}

pub(crate) async fn check(
    State(app): State<App>,
    Path(name): Path<String>,
) -> Result<Answer<Checked>, Refusal> {
    let check = move || plans::check(app.plans(), &name, app.rig(), &**app.exposing());
    blocking(check).await?.map(Answer)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    name: String,
    text: String,
    replaces: Option<String>,
}

pub(crate) async fn check_text(
    State(app): State<App>,
    body: Bytes,
) -> Result<Answer<Checked>, Refusal> {
    let Written { name, text, .. } = parsed(&body)?;
    let check = move || plans::check_text(&name, &text, app.rig(), &**app.exposing());
    blocking(check).await?.map(Answer)
}

pub(crate) async fn write(State(app): State<App>, body: Bytes) -> Result<Answer<Checked>, Refusal> {
    let Written { name, text, replaces } = parsed(&body)?;
    let written = move || {
        let replaces = replaces.as_deref();
        plans::write(app.plans(), &name, &text, replaces, app.rig(), &**app.exposing())
    };
    blocking(written).await?.map(Answer)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Start {
    plan: String,
    digest: String,
    #[serde(default)]
    accepts: Accepted,
}

pub(crate) async fn start(
    State(app): State<App>,
    Extension(who): Extension<Option<Who>>,
    body: Bytes,
) -> Result<Answer<Value>, Refusal> {
    let Start { plan, digest, accepts } = parsed(&body)?;
    let (bench, name) = (app.clone(), plan.clone());
    let check = move || plans::check(bench.plans(), &name, bench.rig(), &**bench.exposing());
    let checked = blocking(check).await??;
    if checked.digest() != digest {
        return Err(Refusal::conflict(
            "the plan or the rig file was changed since it was shown",
            "look at the dry run again",
        ));
    }
    accepts.covers(checked.exposure())?;
    if app.hand().is_open() {
        return Err(Refusal::conflict("the rig is open by hand", "close it first"));
    }
    let id =
        app.queue().add(&plan, &digest, accepts, &App::name(who.as_ref())).ok_or_else(|| {
            Refusal::conflict(
                format!("{MOST_WAITING} scans wait already"),
                "remove some from the queue",
            )
        })?;
    app.live().show_queue(app.queue().shown());
    Ok(Answer(json!({"id": id})))
}

fn asked(app: &App, ask: Ask) -> Result<Answer<Value>, Refusal> {
    let asked =
        app.shown_folder().is_some_and(|folder| scan_process::ask(&folder, app.program(), ask));
    if asked {
        Ok(Answer(json!({})))
    } else {
        Err(Refusal::conflict("no scan is running", "start one"))
    }
}

pub(crate) async fn pause(State(app): State<App>) -> Result<Answer<Value>, Refusal> {
    asked(&app, Ask::Pause)
}

pub(crate) async fn go_on(State(app): State<App>) -> Result<Answer<Value>, Refusal> {
    asked(&app, Ask::Continue)
}

fn changed(app: &App, there: bool) -> Result<Answer<Value>, Refusal> {
    app.live().show_queue(app.queue().shown());
    if there {
        Ok(Answer(json!({})))
    } else {
        Err(Refusal::missing("this scan does not wait any more"))
    }
}

pub(crate) async fn first(
    State(app): State<App>,
    Path(id): Path<u64>,
) -> Result<Answer<Value>, Refusal> {
    let there = app.queue().first(id);
    changed(&app, there)
}

pub(crate) async fn remove(
    State(app): State<App>,
    Path(id): Path<u64>,
) -> Result<Answer<Value>, Refusal> {
    let there = app.queue().remove(id);
    changed(&app, there)
}

pub(crate) async fn release_queue(State(app): State<App>) -> Result<Answer<Value>, Refusal> {
    app.queue().hold(false);
    changed(&app, true)
}
