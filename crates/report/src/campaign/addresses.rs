//! Addresses of what lies beside the page of a campaign.

/// The address of a cell's report.
pub(super) fn report_address(id: &str) -> String {
    format!("cells/{}/report/index.html", encoded(id))
}

/// A name as a part of an address: percent-encoded where an address gives its letters a meaning of their own.
pub(super) fn encoded(name: &str) -> String {
    let mut address = String::new();
    for byte in name.bytes() {
        match byte {
            b'0'..=b'9' | b'a'..=b'z' | b'A'..=b'Z' | b'-' | b'_' | b'.' | b'+' | b'=' => {
                address.push(char::from(byte));
            }
            other => address.push_str(&format!("%{other:02X}")),
        }
    }
    address
}

/// A name as one of a file: nothing in it that a file system treats in its own way.
pub(super) fn file_name(name: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || "-_.+=".contains(c) { c } else { '-' };
    name.chars().map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_inside_their_folder() {
        assert_eq!(report_address("r001-22°C"), "cells/r001-22%C2%B0C/report/index.html");
        assert_eq!(encoded("../a b#?"), "..%2Fa%20b%23%3F");
        assert_eq!(file_name("../chart 22 °C"), "..-chart-22--C");
    }
}
