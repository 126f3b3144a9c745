//! Robots that speak GRBL 1.1, grblHAL's dialect of it included.
//!
//! What the driver builds on, as observed on GRBL 1.1h and grblHAL and read in their users' bug reports:
//!
//! - A receive buffer that overruns loses bytes without an error, and the rest may be a valid line. So lines are
//!   counted against the buffer's true size, which `$I` reports (`window.rs`).
//! - There are no line numbers and no checksums. What a damaged line made of a move shows in where the robot then is;
//!   what a lost one made of it, in that the robot did not move. Each move states everything (units,
//!   absolute, machine coordinates, feed), so that it may be sent again.
//! - Steps that run out end a move in its middle, and the state is `Idle` (seen on a loaded machine). What is left of
//!   the same straight path is gone then.
//! - `ok` means planned. Arrived means that `G4 P0` came back, that the state is `Idle`, and that the position is the
//!   target: `Idle` alone also shows between moves and during a dwell.
//! - Where an `ok` stays out and the robot stands still, the firmware is reset (`0x18`): at standstill the position
//!   is kept, and a line of which only a part arrived is thrown away, not executed.
//! - A greeting that was not asked for is a reset, and the position is unknown. So it is after every opening of the
//!   port, which resets most boards in silence: `Idle` and zero then mean nothing.
//! - After a hard or soft limit GRBL answers nothing, not even `?` or `$X`, until `0x18`. grblHAL answers `?`.
//! - `$X` declares a position for good, lost or not. It is sent in one case: a soft limit (`ALARM:2`), by which the firmware
//!   refuses a line before any step, and behind the reset the place is the one before. Otherwise only `$H` unlocks.
//! - One inverted bit makes a digit another one, `1` a hold (`!`), `8` a reset (`0x18`), a full stop the letter `N`; a byte below
//!   the blank or above `0x7f` is dropped. So a damaged move may go elsewhere, be held, or be refused.
//! - grblHAL repeats its first error to all G-code until a blank line.
//! - `?`, `!`, `~`, `0x18` and all bytes from `0x80` on act at once wherever they stand, so no line may hold one (`line.rs`).
//! - Coordinates are the machine's (`MPos`, `G53`): work offsets of other programs do not matter. They are usually
//!   negative, from minus the travel to zero.

mod advice;
mod alarm;
mod build_info;
mod config;
mod connection;
mod driver;
mod error_code;
mod line;
mod reply;
mod settings;
mod status;
mod window;

pub use config::{GrblConfig, HomingCommand};
pub use driver::Grbl;
