//! Full-screen views on a terminal: a robot jogged by keys, a scan watched as it runs.
//!
//! What is shown is worked out apart from showing it: each view is a plain value that takes events and keys, and is drawn
//! into any backend. [`Screen`] alone touches the terminal.

pub mod jog;
mod keys;
pub mod level;
mod screen;
pub mod watch;

pub use keys::{KeyPresses, Press};
pub use screen::Screen;
