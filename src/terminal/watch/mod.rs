//! The view of a running scan: a live map, and keys to pause or end the scan.

mod draw;
mod map;
mod palette;
mod rounds;
mod sheet;
mod view;

pub use draw::draw;
pub use palette::Palette;
pub use sheet::{Sheet, Sheets};
pub use view::{Request, ScanView, Stage};
