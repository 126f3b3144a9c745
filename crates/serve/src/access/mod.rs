//! Access: roles, sessions and tokens, the controls of the rig, the names of the server, and the audit log.

pub mod audit;
pub mod failed_logins;
pub mod lease;
pub mod names;
pub mod rates;
pub mod role;
pub mod secret;
pub mod sessions;
pub mod users;
