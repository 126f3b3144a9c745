//! A request that was refused, as JSON: `{"error": …, "remedy": …}`.

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
}

impl Refusal {
    fn new(status: StatusCode, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { status, problem: problem.into(), remedy: remedy.into() }
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
        let body = json!({"error": self.problem, "remedy": self.remedy});
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
