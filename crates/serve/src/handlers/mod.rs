//! What each route does.

pub(crate) mod by_hand;
pub(crate) mod log_in;
pub(crate) mod look;
pub(crate) mod notes;
pub(crate) mod page;
pub(crate) mod rig;
pub(crate) mod scans;
