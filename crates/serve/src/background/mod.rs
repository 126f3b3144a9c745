//! What the server does by itself, for as long as it lives.

mod follow;
mod run_queue;
mod settle_lease;

pub(crate) use follow::follow_all;
pub(crate) use run_queue::run_queue;
pub(crate) use settle_lease::settle_lease;
