//! The page and its parts, which are compiled into the program.

use axum::body::Body;
use axum::extract::{Path, Request, State};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName, HeaderValue, REFERRER_POLICY,
    X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::app::App;
use crate::camera::CameraAddress;
use crate::refusal::Refusal;

/// Nothing but the page's own files runs or is loaded; nobody else's page shows it.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; \
     frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// The parts of the page: name, media type, contents.
const PARTS: [(&str, &str, &str); 10] = [
    ("style.css", "text/css; charset=utf-8", include_str!("../page/style.css")),
    ("main.js", SCRIPT, include_str!("../page/main.js")),
    ("server.js", SCRIPT, include_str!("../page/server.js")),
    ("state.js", SCRIPT, include_str!("../page/state.js")),
    ("now.js", SCRIPT, include_str!("../page/now.js")),
    ("map.js", SCRIPT, include_str!("../page/map.js")),
    ("hand.js", SCRIPT, include_str!("../page/hand.js")),
    ("rig.js", SCRIPT, include_str!("../page/rig.js")),
    ("scans.js", SCRIPT, include_str!("../page/scans.js")),
    ("records.js", SCRIPT, include_str!("../page/records.js")),
];

pub(crate) async fn index(State(app): State<App>) -> Response {
    let camera = app.camera().map_or("", CameraAddress::origin);
    let policy = POLICY.replace("frame-src 'self'", &format!("frame-src 'self' {camera}"));
    let headers = [(CONTENT_TYPE, HTML), (CONTENT_SECURITY_POLICY, &*policy)];
    (headers, include_str!("../page/index.html")).into_response()
}

pub(crate) async fn part(Path(name): Path<String>) -> Result<Response, Refusal> {
    let part = PARTS.iter().find(|(known, ..)| *known == name);
    let (_, kind, text) = part.ok_or_else(|| Refusal::missing("the page has no such part"))?;
    Ok(([(CONTENT_TYPE, *kind)], *text).into_response())
}

pub(crate) async fn missing() -> Refusal {
    Refusal::missing("there is no such address")
}

/// Adds the headers that every answer has.
pub(crate) async fn hardened(request: Request<Body>, next: Next) -> Response {
    let mut answer = next.run(request).await;
    let headers = answer.headers_mut();
    let mut set = |name: HeaderName, value: &'static str| {
        headers.entry(name).or_insert(HeaderValue::from_static(value));
    };
    set(X_FRAME_OPTIONS, "SAMEORIGIN");
    set(CONTENT_SECURITY_POLICY, POLICY);
    set(X_CONTENT_TYPE_OPTIONS, "nosniff");
    set(REFERRER_POLICY, "no-referrer");
    set(CACHE_CONTROL, "no-store");
    set(HeaderName::from_static("cross-origin-opener-policy"), "same-origin");
    answer
}
