//! The checks of every request: host, origin, session, role, controls, size.

use std::net::{IpAddr, SocketAddr};
use std::time::{Duration, Instant};

use axum::body::{Body, to_bytes};
use axum::extract::{Request, State};
use axum::http::header::{AUTHORIZATION, COOKIE};
use axum::http::{HeaderMap, Method};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use jiff::Timestamp;

use crate::access::audit::Act;
use crate::access::role::Authority;
use crate::access::sessions::Who;
use crate::app::App;
use crate::refusal::Refusal;

/// Name of the cookie of a session.
pub(crate) const COOKIE_NAME: &str = "fieldgap_session";

/// Header with which a page proves that it was served by this server.
const CSRF: &str = "x-fieldgap-csrf";

/// The route that stops the rig.
pub(crate) const STOP: &str = "/api/stop";

/// Largest body of a request, bytes: a plan with phases for 1024 elements has 30 kB.
const LARGEST_BODY: usize = 256 << 10;

/// How long a body may take to arrive.
const BODY_WITHIN: Duration = Duration::from_secs(5);

/// The address that a connection came from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Peer(pub SocketAddr);

/// Checks that a request is addressed to this server and comes from its own page.
pub(crate) async fn addressed(State(app): State<App>, request: Request, next: Next) -> Response {
    match app.names().check(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    }
}

/// Checks the authority of a request, runs it, and records it if it may change something.
pub(crate) async fn authorised(
    State((app, needs)): State<(App, Authority)>,
    request: Request,
    next: Next,
) -> Response {
    let peer = request.extensions().get::<Peer>().map(|peer| peer.0.ip());
    let from = peer.unwrap_or(IpAddr::from([0, 0, 0, 0]));
    let changes = request.method() != Method::GET;
    let act = format!("{} {}", request.method(), request.uri().path());
    let who = who(&app, request.headers());
    // A stop is never too many.
    let stops = request.uri().path() == STOP && who.is_some();
    if !stops && peer.is_some_and(|peer| !app.rates().allow(peer, Instant::now())) {
        return Refusal::too_many().into_response();
    }
    let answer = match permitted(&app, needs, who.as_ref(), &request) {
        Ok(()) => run(request, who.clone(), next).await,
        Err(refusal) => refusal.into_response(),
    };
    // The heartbeats of a jog would hide all else; its first and last are recorded by the operation itself.
    if changes && !(act.ends_with("/api/hand/jog") && answer.status().is_success()) {
        app.audit().add(&Act {
            at: Timestamp::now(),
            who: who.as_ref().map_or("", |who| &who.name),
            session: who.as_ref().map_or(0, |who| who.id),
            from,
            act: &act,
            status: answer.status().as_u16(),
        });
    }
    answer
}

async fn run(request: Request, who: Option<Who>, next: Next) -> Response {
    let (mut parts, body) = request.into_parts();
    parts.extensions.insert(who);
    let body = if parts.method == Method::GET {
        Body::empty()
    } else {
        match tokio::time::timeout(BODY_WITHIN, to_bytes(body, LARGEST_BODY)).await {
            Ok(Ok(bytes)) => Body::from(bytes),
            Ok(Err(_)) => {
                let problem = format!("the body has more than {LARGEST_BODY} bytes, or broke off");
                return Refusal::bad(problem, "send less").into_response();
            }
            Err(_) => {
                return Refusal::bad("the body did not arrive", "send it at once").into_response();
            }
        }
    };
    next.run(Request::from_parts(parts, body)).await
}

/// Who sends a request: by its token, or else by its cookie.
fn who(app: &App, headers: &HeaderMap) -> Option<Who> {
    let now = Instant::now();
    if let Some(authorization) = headers.get(AUTHORIZATION) {
        let token = authorization.to_str().ok()?.strip_prefix("Bearer ")?;
        return app.sessions().who(token, now).filter(|who| who.csrf.is_none());
    }
    let cookies = headers.get_all(COOKIE).iter().filter_map(|value| value.to_str().ok());
    let mut pairs =
        cookies.flat_map(|value| value.split("; ")).filter_map(|pair| pair.split_once('='));
    let (_, secret) = pairs.find(|(name, _)| *name == COOKIE_NAME)?;
    app.sessions().who(secret, now).filter(|who| who.csrf.is_some())
}

fn permitted(
    app: &App,
    needs: Authority,
    who: Option<&Who>,
    request: &Request,
) -> Result<(), Refusal> {
    let Some(role) = needs.role() else { return Ok(()) };
    let who = who.ok_or_else(Refusal::unauthorized)?;
    if request.method() != Method::GET
        && let Some(csrf) = &who.csrf
    {
        let sent = request.headers().get(CSRF).and_then(|value| value.to_str().ok());
        if sent != Some(csrf) {
            return Err(Refusal::forbidden(
                "the request was not made by the page of this session",
                "reload the page",
            ));
        }
    }
    if who.role < role {
        return Err(Refusal::forbidden(
            format!("this takes the role of {role}, and yours is {}", who.role),
            "ask an admin for a link with that role",
        ));
    }
    if needs == Authority::Control && !app.has_controls(who.id) {
        return Err(Refusal::conflict(
            "you do not have the controls of the rig",
            "take the controls first",
        ));
    }
    Ok(())
}
