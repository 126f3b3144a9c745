//! Moving a robot with the keyboard.

mod draw;
mod state;

pub use draw::draw;
pub use state::{Act, Doing, Jog, STEPS_MM};
