//! `fieldgap serve` with a virtual rig, by its interface for programs.

mod by_hand;
mod exposure;
mod load;
mod people;
mod scans;
#[path = "../served/mod.rs"]
mod served;

use served::{Served, Session};

/// A session of somebody whom an admin invites.
fn invited(served: &Served, admin: &Session, role: &str) -> Session {
    let link = admin.post("/api/links", &format!("{{\"name\":\"visitor\",\"role\":\"{role}\"}}"));
    let path = link["path"].as_str().and_then(|path| path.split_once('='));
    Session::by(served.port, path.expect("a link").1)
}
