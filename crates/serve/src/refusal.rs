//! A request that was refused, as JSON: `{"error": …, "remedy": …}`, and `concerns` where it exposes people.

use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::de::DeserializeOwned;
use serde_json::json;

use crate::answer::Answer;

/// Why a request was refused, and what to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    pub(crate) status: StatusCode,
    pub(crate) problem: String,
    pub(crate) remedy: String,
    /// What speaks against the exposure of people: a request that accepts all of this is not refused for it.
    pub(crate) concerns: Vec<String>,
}

impl Refusal {
    fn new(status: StatusCode, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { status, problem: problem.into(), remedy: remedy.into(), concerns: Vec::new() }
    }

    /// The request itself is wrong.
    pub(crate) fn bad(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, problem, remedy)
    }

    /// Nobody is logged in.
    pub(crate) fn unauthorized() -> Self {
        Self::new(
            StatusCode::UNAUTHORIZED,
            "you are not logged in",
            "open the link that `fieldgap serve` printed, or send `Authorization: Bearer TOKEN`",
        )
    }

    /// The role or the origin does not allow it.
    pub(crate) fn forbidden(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(StatusCode::FORBIDDEN, problem, remedy)
    }

    /// There is no such thing.
    pub(crate) fn missing(problem: impl Into<String>) -> Self {
        Self::new(
            StatusCode::NOT_FOUND,
            problem,
            "reload the page: it may have been moved or deleted",
        )
    }

    /// It is not possible now.
    pub(crate) fn conflict(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(StatusCode::CONFLICT, problem, remedy)
    }

    /// A limit of exposure is not shown to be kept, and nobody accepted it.
    pub(crate) fn exposes(concerns: &[String]) -> Self {
        let refusal = Self::conflict(
            format!("exposure: {}", concerns.join("; ")),
            "lower the drive or move people; or repeat the request with all `concerns` of this answer in `accepts`, where everybody is away or protected",
        );
        Self { concerns: concerns.to_vec(), ..refusal }
    }

    /// The address asks too often.
    pub(crate) fn too_many() -> Self {
        Self::new(
            StatusCode::TOO_MANY_REQUESTS,
            "this address sends too many requests",
            "send fewer than 200 a second",
        )
    }

    /// The server or the rig failed.
    pub(crate) fn failed(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, problem, remedy)
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let mut body = json!({"error": self.problem, "remedy": self.remedy});
        if !self.concerns.is_empty() {
            body["concerns"] = json!(self.concerns);
        }
        (self.status, Answer(body)).into_response()
    }
}

/// The JSON body of a request.
pub(crate) fn parsed<T: DeserializeOwned>(body: &[u8]) -> Result<T, Refusal> {
    serde_json::from_slice(body).map_err(|error| {
        Refusal::bad(
            format!("the body of the request is not as expected: {error}"),
            "see /api/openapi.json",
        )
    })
}

/// Does something on a thread that may wait for the disk.
pub(crate) async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Refusal> {
    let done = tokio::task::spawn_blocking(work).await;
    done.map_err(|error| Refusal::failed(error.to_string(), "report this error"))
}
