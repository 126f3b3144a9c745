//! Operation by hand, the controls, and STOP.

use std::sync::Arc;
use std::time::Instant;

use axum::Extension;
use axum::body::Bytes;
use axum::extract::State;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::access::sessions::Who;
use crate::answer::Answer;
use crate::app::App;
use crate::exposure::Foresight;
use crate::hand::Order;
use crate::refusal::{Refusal, blocking, parsed};

type Caller = Extension<Option<Who>>;

fn caller(who: Option<Who>) -> Result<Who, Refusal> {
    who.ok_or_else(Refusal::unauthorized)
}

pub(crate) async fn stop(State(app): State<App>, Extension(who): Caller) -> Answer<Value> {
    let left = app.stop(&App::name(who.as_ref())).await;
    Answer(json!({"left": left}))
}

pub(crate) async fn take(
    State(app): State<App>,
    Extension(who): Caller,
) -> Result<Answer<Value>, Refusal> {
    let who = caller(who)?;
    let taken = app.live().lease(|lease| lease.take(&who));
    taken.map_err(|held| {
        Refusal::conflict(held.to_string(), "your request is shown to the holder")
    })?;
    Ok(Answer(json!({})))
}

pub(crate) async fn release(
    State(app): State<App>,
    Extension(who): Caller,
) -> Result<Answer<Value>, Refusal> {
    let who = caller(who)?;
    if app.live().lease(|lease| lease.release(who.id)) {
        app.controls_were_released().await;
    }
    Ok(Answer(json!({})))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Give {
    to: u64,
}

pub(crate) async fn give(
    State(app): State<App>,
    Extension(who): Caller,
    body: Bytes,
) -> Result<Answer<Value>, Refusal> {
    let (who, Give { to }) = (caller(who)?, parsed(&body)?);
    let all = app.sessions().all(Instant::now());
    let to = all
        .iter()
        .find(|other| other.id == to)
        .ok_or_else(|| Refusal::missing("there is no such session"))?;
    let given = app.live().lease(|lease| lease.give(&who, to));
    given.map_err(|refusal| Refusal::conflict(refusal.to_string(), "take the controls first"))?;
    app.controls_were_released().await;
    Ok(Answer(json!({})))
}

pub(crate) async fn seize(
    State(app): State<App>,
    Extension(who): Caller,
) -> Result<Answer<Value>, Refusal> {
    let who = caller(who)?;
    app.live().lease(|lease| lease.seize(&who, Instant::now()));
    app.live().note(format!("{} takes the controls in 10 s", App::name(Some(&who))));
    Ok(Answer(json!({})))
}

pub(crate) async fn open(State(app): State<App>) -> Result<Answer<Value>, Refusal> {
    if app.is_busy() || app.scan_runs() {
        return Err(Refusal::conflict("a scan is running", "wait for its end, or stop it"));
    }
    let exposing = Arc::clone(app.exposing());
    app.hand().open(app.live(), app.rig_setup(), app.opening(), exposing).await?;
    Ok(Answer(json!({})))
}

pub(crate) async fn close(State(app): State<App>) -> Answer<Value> {
    app.hand().close().await;
    Answer(json!({}))
}

pub(crate) async fn order(State(app): State<App>, body: Bytes) -> Result<Answer<Value>, Refusal> {
    let order: Order = parsed(&body)?;
    let exposure = foreseen(&app, &order).await?;
    app.hand().order(order).await?;
    Ok(Answer(json!({"exposure": exposure})))
}

/// The exposure by an order.
///
/// # Errors
/// It cannot be foreseen, or something speaks against it that was not accepted.
async fn foreseen(app: &App, order: &Order) -> Result<Option<Foresight>, Refusal> {
    let Some((drives, seconds, accepts)) = order.drives().filter(|_| app.hand().is_open()) else {
        return Ok(None);
    };
    let bench = app.clone();
    let foresee = move || bench.exposing().by_drives(&bench.rig_setup(), &drives, seconds);
    let foresight = blocking(foresee)
        .await?
        .map_err(|problem| Refusal::conflict(problem, "correct [exposure] in the rig file"))?;
    accepts.covers(foresight.as_ref())?;
    Ok(foresight)
}

/// A heartbeat. It has a route of its own, so that the audit log need not read bodies to leave them out.
pub(crate) async fn jog(State(app): State<App>, body: Bytes) -> Result<Answer<Value>, Refusal> {
    match parsed(&body)? {
        order @ (Order::Jog { .. } | Order::Release { .. }) => app.hand().order(order).await?,
        _ => return Err(Refusal::bad("this is no heartbeat", "send the order to /api/hand/order")),
    }
    Ok(Answer(json!({})))
}
