//! Robots that speak Marlin's dialect of G-code.
//!
//! What the driver builds on, as observed on Marlin 2.1 and read in its users' bug reports:
//!
//! - A line is numbered and carries a checksum (`line.rs`). A damaged or missing one is answered `Resend: n` and an
//!   `ok` that acknowledges nothing, which some builds omit.
//! - A repeat of either of the last two accepted numbers is dropped **without** an `ok`. So after silence nothing is
//!   sent again: a numbered mark, which the firmware echoes, shows whether the line before it was taken (`exchange.rs`).
//! - `ok` means planned, not arrived. Arrived means that `G4 P0` came back, and the proof of that is a position report
//!   asked for behind it: commands are executed in order.
//! - One command is under way at a time: a firmware whose receive buffer overruns loses lines without an error.
//! - `start` in mid-session is a reset: the position is gone. `kill()` is the end until the power is cycled.
//! - `M410` stops quickly and loses the position. It is answered after one second, in which the queue is discarded. Without the
//!   emergency parser it is obeyed when it is read, which waits while the command ring is full, and again in its turn: two
//!   seconds. A stop counts when a mark behind it came. `M112` is not sent: it halts the firmware until the power is cycled,
//!   and belongs to the button on the machine.
//! - A halted firmware switches its motors off within a second and answers nothing more.

mod config;
mod connection;
mod driver;
mod exchange;
mod line;
mod numbered_line;
mod reply;
#[cfg(test)]
mod tests;

pub use config::MarlinConfig;
pub use driver::Marlin;
