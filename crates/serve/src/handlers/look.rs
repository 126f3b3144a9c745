//! What can be looked at: the state, the rig, the records.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Extension;
use axum::extract::{Path, State};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use serde_json::{Value, json};
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;

use crate::access::sessions::Who;
use crate::answer::Answer;
use crate::app::App;
use crate::camera::CameraAddress;
use crate::live::{Live, Message};
use crate::records;
use crate::refusal::Refusal;

/// Time between two signs of life on a quiet stream.
const SIGN_OF_LIFE: Duration = Duration::from_secs(5);

pub(crate) async fn state(State(app): State<App>) -> Answer<Value> {
    Answer(app.live().summary())
}

/// A page that follows; counted for as long as it does.
struct Viewer {
    live: Arc<Live>,
    changes: Receiver<Message>,
    first: Option<String>,
    session: u64,
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.live.viewers_changed(self.session, -1);
    }
}

pub(crate) async fn live(
    State(app): State<App>,
    Extension(who): Extension<Option<Who>>,
) -> Result<Response, Refusal> {
    let session = who.ok_or_else(Refusal::unauthorized)?.id;
    let live = Arc::clone(app.live());
    live.viewers_changed(session, 1);
    let (first, changes) = live.follow();
    let viewer = Viewer { live, changes, first: Some(first), session };
    let events = stream::unfold(viewer, async |mut viewer| {
        if let Some(first) = viewer.first.take() {
            return Some((Ok::<_, Infallible>(Event::default().event("all").data(first)), viewer));
        }
        let event = match viewer.changes.recv().await {
            Ok((kind, text)) => Event::default().event(kind).data(&*text),
            // The page was too slow: it is sent everything again.
            Err(RecvError::Lagged(_)) => {
                let (all, changes) = viewer.live.follow();
                viewer.changes = changes;
                Event::default().event("all").data(all)
            }
            Err(RecvError::Closed) => return None,
        };
        Some((Ok(event), viewer))
    });
    Ok(Sse::new(events).keep_alive(KeepAlive::new().interval(SIGN_OF_LIFE)).into_response())
}

pub(crate) async fn rig(State(app): State<App>) -> Answer<Value> {
    let setup = app.rig_setup();
    let (frame, envelope) = (setup.rig.motion.frame(), setup.rig.motion.envelope());
    // Travel and boxes are given in the robot's axes; the pages draw in the frame of the array.
    let corners = |space: &fieldgap_rig::travel::AxisBox| {
        let corner = |axes| {
            let at: [f64; 3] =
                (frame.to_array(fieldgap_rig::RobotPosition::from_axes_m(axes)) * 1e3).into();
            at
        };
        let (a, b) = (corner(space.least_m), corner(space.largest_m));
        let pairs: Vec<[f64; 2]> = a.iter().zip(b).map(|(&a, b)| [a.min(b), a.max(b)]).collect();
        pairs
    };
    let elements: Vec<[f64; 3]> = setup
        .nominal_array()
        .elements()
        .iter()
        .map(|element| (element.centre_m * 1e3).into())
        .collect();
    let boxes: Vec<Value> = envelope
        .keep_out
        .iter()
        .map(|one| json!({"name": one.name, "mm": corners(&one.space)}))
        .collect();
    Answer(json!({
        "name": setup.name, "virtual": setup.is_virtual(), "travel_mm": corners(&envelope.travel), "keep_out": boxes,
        "elements_mm": elements, "feed_mm_s": setup.rig.motion.feed().mm_s().get(),
        "camera": app.camera().map(CameraAddress::as_str),
    }))
}

pub(crate) async fn records(State(app): State<App>) -> Result<Answer<Value>, Refusal> {
    let folder = app.records().to_owned();
    let listed = tokio::task::spawn_blocking(move || records::list(&folder)).await;
    let listed = listed.map_err(|error| Refusal::failed(error.to_string(), "report this error"))?;
    Ok(Answer(json!(listed)))
}

pub(crate) async fn file(
    State(app): State<App>,
    Path((key, path)): Path<(String, String)>,
) -> Result<Response, Refusal> {
    app.sessions().viewer(&key, Instant::now()).ok_or_else(Refusal::unauthorized)?;
    let folder = app.records().to_owned();
    let shown =
        tokio::task::spawn_blocking(move || records::shown(&records::file(&folder, &path)?)).await;
    shown.map_err(|error| Refusal::failed(error.to_string(), "report this error"))?
}
