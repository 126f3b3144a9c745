//! The address of a camera beside the rig.

use std::str::FromStr;

use axum::http::Uri;

/// The address of a page or of an MJPEG stream, shown in a frame of its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CameraAddress {
    address: String,
    origin: String,
}

/// The address cannot be that of a camera.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no address of a camera; give one as http://camera.local:8080/stream")]
pub struct NoCameraAddress(String);

impl FromStr for CameraAddress {
    type Err = NoCameraAddress;

    fn from_str(address: &str) -> Result<Self, Self::Err> {
        let wrong = || NoCameraAddress(address.to_owned());
        // The origin becomes a word of a header, in which these would begin another.
        if address.contains([';', ',', ' ', '"', '\'']) {
            return Err(wrong());
        }
        let uri: Uri = address.parse().map_err(|_| wrong())?;
        let (Some(scheme @ ("http" | "https")), Some(authority)) =
            (uri.scheme_str(), uri.authority())
        else {
            return Err(wrong());
        };
        if authority.as_str().contains('@') {
            return Err(wrong());
        }
        Ok(Self { address: address.to_owned(), origin: format!("{scheme}://{authority}") })
    }
}

impl CameraAddress {
    /// The address.
    pub fn as_str(&self) -> &str {
        &self.address
    }

    /// Scheme, host and port.
    pub(crate) fn origin(&self) -> &str {
        &self.origin
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_page_of_the_web_is_a_camera() {
        let camera: CameraAddress =
            "http://camera.local:8080/stream?fps=5".parse().expect("a camera");
        assert_eq!(camera.origin(), "http://camera.local:8080");
        for wrong in [
            "",
            "camera",
            "javascript:alert(1)",
            "file:///etc/passwd",
            "http://a b/",
            "http://a;script-src *",
            "http://user:word@host/",
        ] {
            assert!(wrong.parse::<CameraAddress>().is_err(), "{wrong}");
        }
    }
}
