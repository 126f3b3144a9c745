//! Full-screen views on a terminal: jogging a robot, and watching a scan.
//!
//! State and drawing are separate: each view is a plain value that takes events and keys, and is drawn into any backend. Only
//! [`Screen`] uses the terminal.

pub mod jog;
mod keys;
pub mod level;
mod screen;
pub mod watch;

pub use keys::{KeyPresses, Press};
pub use screen::Screen;
