//! What the server does by itself, for as long as it lives.

mod follow;
mod follow_users;
mod run_queue;
mod settle_lease;

pub(crate) use follow::follow_all;
pub(crate) use follow_users::follow_users;
pub(crate) use run_queue::run_queue;
pub(crate) use settle_lease::settle_lease;
