//! A rig in a browser: the scan that runs, operation by hand, plans and records, for several people at once.
//!
//! [`Server::bind`] listens, for this computer alone or for others too ([`Reach`]), and [`Server::run`] answers until it is told to end. The scan is a process of its own: it
//! runs the same whether this server lives or not, and the server reads its journal.
//!
//! | to change | see |
//! |---|---|
//! | who may do what | `routes`, the table of all routes with the authority that each takes; `check`; `access` |
//! | what a page is told | `live`, `scan_view` |
//! | how a scan is started, followed, paused and stopped | `background`, `scan_process`, `queue` |
//! | operation by hand | `hand` |
//! | what is asked before a real array sounds | `exposure` |
//! | plans and records | `plans`, `records` |
//! | the page | `page/`: HTML, one style sheet and plain JavaScript modules, without other libraries |

mod access;
mod answer;
mod app;
mod background;
mod camera;
mod check;
mod correction;
mod exposure;
mod hand;
mod hand_state;
mod handlers;
mod live;
mod openapi;
mod plans;
mod queue;
mod records;
mod refusal;
mod routes;
mod scan_process;
mod scan_view;
mod server;
#[cfg(test)]
mod tests;
mod tls;
mod wire;

pub use access::role::Role;
pub use access::users::{SHORTEST_PASSWORD, User, UserError, UserName, Users};
pub use app::Bench;
pub use camera::{CameraAddress, NoCameraAddress};
pub use exposure::{Exposing, Foresight};
pub use hand::{HEARTBEAT_WITHIN, HandRig, Opening};
pub use server::{Reach, ServeError, Server};
pub use tls::{Identity, NoIdentity};
