//! The cells of a campaign: words for their status, and the addresses of their reports.

use fieldgap_campaign::{CellOverview, CellStatus};

/// The status in a word.
pub(super) fn status_word(cell: &CellOverview) -> &'static str {
    match &cell.status {
        CellStatus::Open => "open",
        CellStatus::Scanning => "scanning",
        CellStatus::Measured => "measured",
        CellStatus::Done { changed: true, .. } => "changed",
        CellStatus::Done { .. } => "done",
        CellStatus::Failed { .. } => "failed",
    }
}

/// The address of a cell's report, from the campaign's page. The name of a cell's folder is percent-encoded where an address gives its
/// letters a meaning of their own.
pub(super) fn report_address(id: &str) -> String {
    let mut address = "cells/".to_owned();
    for byte in id.bytes() {
        match byte {
            b'0'..=b'9' | b'a'..=b'z' | b'A'..=b'Z' | b'-' | b'_' | b'.' | b'+' | b'=' => {
                address.push(char::from(byte));
            }
            other => address.push_str(&format!("%{other:02X}")),
        }
    }
    address.push_str("/report/index.html");
    address
}
