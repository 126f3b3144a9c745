//! The names under which the server may be addressed.

use axum::http::HeaderMap;
use axum::http::header::{HOST, ORIGIN};

use crate::refusal::Refusal;

/// The hosts and origins under which the server may be addressed. A page of another site that has its name resolve to this machine
/// is known by its host.
#[derive(Debug, Clone)]
pub(crate) struct Names {
    hosts: Vec<String>,
}

impl Names {
    /// Of a server on a loopback address.
    pub fn loopback(port: u16) -> Self {
        let hosts = ["127.0.0.1", "localhost", "[::1]"];
        Self { hosts: hosts.map(|host| format!("{host}:{port}")).to_vec() }
    }

    /// Checks host and origin.
    pub fn check(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let host = text(HOST).unwrap_or_default();
        if !self.hosts.iter().any(|known| known == host) {
            return Err(Refusal::forbidden(
                "the server does not answer under this host name",
                format!("open http://{}/", self.hosts[0]),
            ));
        }
        let fetched = headers.get("sec-fetch-site").and_then(|value| value.to_str().ok());
        let foreign = headers.contains_key(ORIGIN)
            && text(ORIGIN).and_then(|origin| origin.strip_prefix("http://")) != Some(host);
        if foreign || fetched == Some("cross-site") && !is_navigation(headers) {
            return Err(Refusal::forbidden(
                "the request comes from the page of another site",
                "close that page",
            ));
        }
        Ok(())
    }
}

/// Whether a person follows a link, which carries no cookie of this server where it comes from another site.
fn is_navigation(headers: &HeaderMap) -> bool {
    headers.get("sec-fetch-mode").is_some_and(|mode| mode == "navigate")
}
