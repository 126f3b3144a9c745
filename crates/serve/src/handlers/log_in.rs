//! Log in, links and tokens.

use std::net::IpAddr;
use std::time::{Duration, Instant};

use axum::Extension;
use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::http::header::SET_COOKIE;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::access::role::Role;
use crate::access::sessions::Who;
use crate::access::users::UserName;
use crate::answer::Answer;
use crate::app::App;
use crate::check::{COOKIE_NAME, Peer};
use crate::refusal::{Refusal, parsed};

/// Longest life of a token, minutes: 30 days.
const LONGEST_TOKEN_MINUTES: u64 = 30 * 24 * 60;

#[derive(Deserialize)]
#[serde(untagged)]
enum LogIn {
    Link(ByLink),
    Password(ByPassword),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ByLink {
    secret: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ByPassword {
    name: String,
    password: String,
}

pub(crate) async fn open(
    State(app): State<App>,
    peer: Option<Extension<Peer>>,
    body: Bytes,
) -> Result<Response, Refusal> {
    let from = peer.map_or(IpAddr::from([0, 0, 0, 0]), |Extension(peer)| peer.0.ip());
    let log_in = parsed(&body)?;
    tokio::time::sleep(app.failed_logins().attempt(from, Instant::now())).await;
    let opened = match log_in {
        LogIn::Link(ByLink { secret }) => {
            app.sessions().open(&secret, Instant::now()).ok_or_else(|| {
                Refusal::forbidden(
                    "this link was used already, or is older than 15 minutes",
                    "ask for a new link",
                )
            })?
        }
        LogIn::Password(ByPassword { name, password }) => {
            let user = app.user_with_password(name, password).await.ok_or_else(|| {
                Refusal::forbidden(
                    "name or password are wrong",
                    "try again, or ask an admin for a link",
                )
            })?;
            app.sessions().open_for(&user, Instant::now()).ok_or_else(|| {
                Refusal::conflict("too many people are logged in", "ask an admin to end sessions")
            })?
        }
    };
    app.failed_logins().succeeded(from);
    app.live().note(format!("{} logged in", App::name(Some(&opened.who))));
    // On loopback the connection is not encrypted, so the cookie cannot be `Secure`.
    let secure = if app.names().are_encrypted() { "; Secure" } else { "" };
    let cookie =
        format!("{COOKIE_NAME}={}; HttpOnly; SameSite=Strict; Path=/{secure}", opened.secret);
    Ok(([(SET_COOKIE, cookie)], Answer(described(&opened.who))).into_response())
}

fn described(who: &Who) -> Value {
    json!({"id": who.id, "name": who.name, "role": who.role, "csrf": who.csrf, "view_key": who.view_key})
}

pub(crate) async fn who(Extension(who): Extension<Option<Who>>) -> Result<Answer<Value>, Refusal> {
    Ok(Answer(described(&who.ok_or_else(Refusal::unauthorized)?)))
}

pub(crate) async fn end(
    State(app): State<App>,
    Extension(who): Extension<Option<Who>>,
) -> Result<Answer<Value>, Refusal> {
    end_session(&app, who.ok_or_else(Refusal::unauthorized)?.id).await;
    Ok(Answer(json!({})))
}

pub(crate) async fn end_session(app: &App, id: u64) {
    app.sessions().end(id);
    if app.live().lease(|lease| lease.release(id)) {
        app.controls_were_released().await;
    }
}

pub(crate) async fn people(State(app): State<App>) -> Answer<Vec<Who>> {
    Answer(app.sessions().all(Instant::now()))
}

pub(crate) async fn end_other(State(app): State<App>, Path(id): Path<u64>) -> Answer<Value> {
    end_session(&app, id).await;
    Answer(json!({}))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Invitation {
    name: String,
    role: Role,
}

pub(crate) async fn invite(State(app): State<App>, body: Bytes) -> Result<Answer<Value>, Refusal> {
    let Invitation { name, role } = parsed(&body)?;
    let secret = app.sessions().invite(&named(&name)?, role, Instant::now());
    Ok(Answer(json!({"path": format!("/#link={secret}"), "minutes": 15})))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NewToken {
    name: String,
    role: Role,
    minutes: u64,
}

pub(crate) async fn token(State(app): State<App>, body: Bytes) -> Result<Answer<Value>, Refusal> {
    let NewToken { name, role, minutes } = parsed(&body)?;
    if !(1..=LONGEST_TOKEN_MINUTES).contains(&minutes) {
        let problem = format!("a token lasts 1 to {LONGEST_TOKEN_MINUTES} minutes, not {minutes}");
        return Err(Refusal::bad(problem, "choose another time"));
    }
    let lasts = Duration::from_secs(minutes * 60);
    let opened = app.sessions().token(&named(&name)?, role, lasts, Instant::now());
    Ok(Answer(json!({"token": opened.secret, "id": opened.who.id})))
}

fn named(name: &str) -> Result<String, Refusal> {
    let name = UserName::try_from(name.to_owned());
    let name = name.map_err(|error| Refusal::bad(error.to_string(), "choose another name"))?;
    Ok(name.as_str().to_owned())
}
