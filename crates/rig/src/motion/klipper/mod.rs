//! Robots behind Klipper's host software, which drives the motors and offers G-code on a pseudo-terminal (`/tmp/printer`).
//!
//! What the driver builds on, as observed on Klipper's host software with its own micro-controller code:
//!
//! - Each line is answered by exactly one `ok`, **also where it failed**: `!! Must home axis first` and then `ok`. So a `!!`
//!   is the result, and the `ok` only its end.
//! - Line numbers and checksums are ignored. The terminal is on this computer, so nothing is damaged on the way.
//! - An unknown command is repeated: `// Unknown command:"…"`. A command that nobody knows is thus a mark, behind which no
//!   earlier answer can come.
//! - `ok` means planned. `M400` comes back 17 to 40 ms after the last step. Nothing is answered meanwhile, and there are no messages of
//!   being busy.
//! - `M114` reports the target with whatever offsets were set; the line `kinematic` of `GET_POSITION` is the position by the
//!   motors' steps, once they stand still.
//! - Nothing stops a move but `M112`. It acts at once, also behind a pending `M400`, and shuts Klipper down: only
//!   `FIRMWARE_RESTART` ends that, and the position is lost. So a stop sends it only where something may be moving.
//! - After a shutdown `M114` and `M115` still answer as if nothing had happened.
//! - `M84` switches the motors off, whatever follows it. They switch off by themselves after `[idle_timeout]`.

mod config;
mod connection;
mod driver;
mod reply;
#[cfg(test)]
mod tests;

pub use config::KlipperConfig;
pub use driver::Klipper;
