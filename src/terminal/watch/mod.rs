//! A scan watched while it runs: its map filling in, and keys that let it wait or end.

mod draw;
mod map;
mod palette;
mod sheet;
mod view;

pub use draw::draw;
pub use palette::Palette;
pub use sheet::{Sheet, Sheets};
pub use view::{ScanView, Stage, Wish};
