//! Addresses of files for links of a page.

use std::path::{Component, Path};

/// The address of a file relative to the folder of a page; `None` where the one cannot be reached from the other.
pub(super) fn address(from: &Path, to: &Path) -> Option<String> {
    let (from, to) = (std::path::absolute(from).ok()?, std::path::absolute(to).ok()?);
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(shared).map(|_| "..".to_owned());
    let down = to.components().skip(shared).map(|part| match part {
        Component::Normal(name) => Some(encoded(name.as_encoded_bytes())),
        _ => None,
    });
    let parts: Option<Vec<String>> = up.map(Some).chain(down).collect();
    Some(parts?.join("/"))
}

/// A name in an address: every byte that has a meaning of its own there is written as `%` and two digits (RFC 3986, section 2).
fn encoded(name: &[u8]) -> String {
    let mut text = String::new();
    for &byte in name {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' => {
                text.push(char::from(byte))
            }
            _ => text += &format!("%{byte:02X}"),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_leads_from_the_page_to_the_file() {
        let address = |from: &str, to: &str| address(Path::new(from), Path::new(to));
        assert_eq!(
            address("/lab/pages", "/lab/out/50 % #1/report/index.html").as_deref(),
            Some("../out/50%20%25%20%231/report/index.html")
        );
        assert_eq!(address("/lab", "/lab/a:b?.html").as_deref(), Some("a%3Ab%3F.html"));
    }
}
