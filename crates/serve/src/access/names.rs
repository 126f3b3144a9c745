//! The names under which the server may be addressed.

use std::net::IpAddr;

use axum::http::HeaderMap;
use axum::http::header::{HOST, ORIGIN};

use crate::refusal::Refusal;

/// The hosts and origins under which the server may be addressed. A page of another site that has its name resolve to this machine
/// is known by its host.
#[derive(Debug, Clone)]
pub(crate) struct Names {
    scheme: &'static str,
    hosts: Vec<String>,
    /// The port of addresses in digits that are answered. No other site can have such an address for its name.
    any_address_at: Option<u16>,
}

impl Names {
    /// Of a server on a loopback address.
    pub fn loopback(port: u16) -> Self {
        let hosts = ["127.0.0.1", "localhost", "[::1]"];
        let hosts = hosts.map(|host| format!("{host}:{port}")).to_vec();
        Self { scheme: "http", hosts, any_address_at: None }
    }

    /// Of a server that other computers reach under these names, encrypted.
    pub fn network(names: &[String], port: u16) -> Self {
        let mut hosts: Vec<String> =
            names.iter().map(|name| format!("{}:{port}", name.to_lowercase())).collect();
        // Browsers leave the usual port out.
        if port == 443 {
            hosts.extend(names.iter().map(|name| name.to_lowercase()));
        }
        Self { scheme: "https", hosts, any_address_at: Some(port) }
    }

    /// Whether connections are encrypted.
    pub fn are_encrypted(&self) -> bool {
        self.scheme == "https"
    }

    /// Checks host and origin.
    pub fn check(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let host = text(HOST).unwrap_or_default();
        if !self.is_one(host) {
            let known = self.hosts.first().map_or("", String::as_str);
            return Err(Refusal::forbidden(
                "the server does not answer under this host name",
                format!("open {}://{known}/, or name the host by --host-name", self.scheme),
            ));
        }
        let fetched = headers.get("sec-fetch-site").and_then(|value| value.to_str().ok());
        let own =
            text(ORIGIN).and_then(|origin| origin.strip_prefix(self.scheme)?.strip_prefix("://"));
        let foreign = headers.contains_key(ORIGIN) && own != Some(host);
        if foreign || fetched == Some("cross-site") && !is_navigation(headers) {
            return Err(Refusal::forbidden(
                "the request comes from the page of another site",
                "close that page",
            ));
        }
        Ok(())
    }

    fn is_one(&self, host: &str) -> bool {
        let (name, port) = match host.rsplit_once(':') {
            Some((name, port)) if !port.ends_with(']') => (name, port.parse().ok()),
            _ => (host, Some(443)),
        };
        let digits = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        let address =
            digits.parse::<IpAddr>().is_ok() && port.is_some() && port == self.any_address_at;
        address || self.hosts.iter().any(|known| known.eq_ignore_ascii_case(host))
    }
}

/// Whether a person follows a link, which carries no cookie of this server where it comes from another site.
fn is_navigation(headers: &HeaderMap) -> bool {
    headers.get("sec-fetch-mode").is_some_and(|mode| mode == "navigate")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_is_a_name_of_the_server_or_where_others_reach_it_an_address() {
        let local = Names::loopback(8321);
        for (host, known) in [
            ("127.0.0.1:8321", true),
            ("localhost:8321", true),
            ("[::1]:8321", true),
            ("localhost", false),
            ("10.0.0.7:8321", false),
            ("evil.example:8321", false),
            ("", false),
        ] {
            assert_eq!(local.is_one(host), known, "{host}");
        }
        let bench = Names::network(&["Bench.example".to_owned()], 8321);
        for (host, known) in [
            ("bench.example:8321", true),
            ("BENCH.example:8321", true),
            ("10.0.0.7:8321", true),
            ("[fe80::1]:8321", true),
            ("10.0.0.7:80", false),
            ("10.0.0.7", false),
            ("bench.example", false),
            ("bench.example:8321.evil.example", false),
            ("10.0.0.7.evil.example:8321", false),
            ("evil.example:8321", false),
            ("", false),
            ("[fe80::1", false),
        ] {
            assert_eq!(bench.is_one(host), known, "{host}");
        }
        let usual = Names::network(&["bench.example".to_owned()], 443);
        assert!(
            usual.is_one("bench.example") && usual.is_one("10.0.0.7") && usual.is_one("[fe80::1]")
        );
    }
}
