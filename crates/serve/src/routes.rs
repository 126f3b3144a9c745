//! Every route of the server, with the authority that it takes. There is no other way in.

use axum::Router;
use axum::http::Method;
use axum::middleware::{from_fn, from_fn_with_state};
use axum::routing::{MethodFilter, MethodRouter, get, on};

use crate::access::role::Authority::{Administer, Control, Operate, Public, View};
use crate::answer::Answer;
use crate::app::App;
use crate::check::{STOP, addressed, authorised};
use crate::handlers::{by_hand, log_in, look, notes, page, rig, scans};
use crate::openapi::{self, Operation};

/// A route: its description, and what it does.
#[derive(Clone)]
pub(crate) struct Route {
    pub operation: Operation,
    handler: MethodRouter<App>,
}

/// All routes.
pub(crate) fn all() -> Vec<Route> {
    let route = |method, path, needs, what, handler| Route {
        operation: Operation { method, path, needs, what },
        handler,
    };
    let read = |path, needs, what, handler| route(Method::GET, path, needs, what, handler);
    let act = |path, needs, what, handler| route(Method::POST, path, needs, what, handler);
    macro_rules! post {
        ($handler:path) => {
            on(MethodFilter::POST, $handler)
        };
    }
    vec![
        read("/", Public, "The page", get(page::index)),
        read("/static/{name}", Public, "A part of the page", get(page::part)),
        act(
            "/api/session",
            Public,
            "Log in: {secret} of a one-time link, or {name, password}",
            post!(log_in::open),
        ),
        read("/api/session", View, "Who you are", get(log_in::who)),
        act("/api/session/end", View, "Log out", post!(log_in::end)),
        act(STOP, View, "STOP: silence the array and stop the robot", post!(by_hand::stop)),
        read("/api/state", View, "Everything but the readings", get(look::state)),
        read(
            "/api/live",
            View,
            "Everything, then each change, as server-sent events",
            get(look::live),
        ),
        read("/api/rig", View, "Travel, keep-out boxes and array of the rig", get(look::rig)),
        read(
            "/api/rig/wires",
            View,
            "The last minute of each wire of the shown scan",
            get(rig::wires),
        ),
        act(
            "/api/records/{name}/correction",
            Operate,
            "The rig file corrected by what a record shows: {keep}; a new file, or its lines only",
            post!(rig::correct),
        ),
        read("/api/records/{name}/notes", View, "The notes about a record", get(notes::all)),
        act("/api/records/{name}/notes", Operate, "Note something: {text}", post!(notes::add)),
        act("/api/rig/check", Control, "Check each device; nothing moves", post!(rig::check)),
        read("/api/records", View, "The records, the newest first", get(look::records)),
        read(
            "/view/{key}/{*file}",
            Public,
            "A file of a record, by the view key of a session",
            get(look::file),
        ),
        read("/api/plans", View, "The plans", get(scans::list)),
        read("/api/plans/{name}", View, "A plan with its dry run and digest", get(scans::check)),
        act(
            "/api/plans/check",
            Operate,
            "The dry run of a text: {name, text}",
            post!(scans::check_text),
        ),
        act("/api/plans", Operate, "Write a plan: {name, text, replaces?}", post!(scans::write)),
        act(
            "/api/scans",
            Control,
            "Run a plan as it was shown: {plan, digest, accepts?}; accepts is a list of the plan's exposure.concerns",
            post!(scans::start),
        ),
        act("/api/scans/pause", Control, "Pause the scan, the array silent", post!(scans::pause)),
        act("/api/scans/continue", Control, "Continue the scan", post!(scans::go_on)),
        act(
            "/api/queue/{id}/first",
            Control,
            "Move a waiting scan to the front",
            post!(scans::first),
        ),
        act("/api/queue/{id}/remove", Control, "Remove a waiting scan", post!(scans::remove)),
        act("/api/queue/continue", Control, "Let a held queue go on", post!(scans::release_queue)),
        act(
            "/api/controls/take",
            Operate,
            "Take the controls, or ask their holder for them",
            post!(by_hand::take),
        ),
        act("/api/controls/release", Operate, "Release the controls", post!(by_hand::release)),
        act(
            "/api/controls/give",
            Control,
            "Hand the controls to a session: {to}",
            post!(by_hand::give),
        ),
        act(
            "/api/controls/seize",
            Administer,
            "Take the controls after a warning of 10 s",
            post!(by_hand::seize),
        ),
        act("/api/hand/open", Control, "Open the rig for operation by hand", post!(by_hand::open)),
        act("/api/hand/close", Control, "Leave the rig safe and close it", post!(by_hand::close)),
        act(
            "/api/hand/order",
            Control,
            "Operate the rig: {order, ...}; a focus or find-axis may need accepts, a list of the concerns of its refusal",
            post!(by_hand::order),
        ),
        act(
            "/api/hand/jog",
            Control,
            "A heartbeat of a jog: {order: \"jog\", hold, axis, speed_mm_s}",
            post!(by_hand::jog),
        ),
        read("/api/people", Administer, "Sessions and tokens", get(log_in::people)),
        act("/api/people/{id}/end", Administer, "End a session or token", post!(log_in::end_other)),
        act("/api/links", Administer, "Make a one-time link: {name, role}", post!(log_in::invite)),
        act("/api/tokens", Administer, "Make a token: {name, role, minutes}", post!(log_in::token)),
        read("/api/openapi.json", Public, "This description", get(description)),
    ]
}

async fn description() -> Answer<serde_json::Value> {
    Answer(openapi::description(all().into_iter().map(|route| route.operation)))
}

/// The routes as a service.
pub(crate) fn router(app: App) -> Router {
    let mut router = Router::new();
    for Route { operation: Operation { path, needs, .. }, handler } in all() {
        let checked = handler.layer(from_fn_with_state((app.clone(), needs), authorised));
        router = router.route(path, checked);
    }
    router
        .fallback(page::missing)
        .layer(from_fn_with_state(app.clone(), addressed))
        .layer(from_fn(page::hardened))
        .with_state(app)
}
