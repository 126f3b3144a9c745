//! An index of all records below a folder, and queries of it.
//!
//! The figures of a record, [`RecordFigures`], lie in the record itself, in `report/figures.json`.

mod air;
mod cause;
mod figures;
mod sampling_error;
mod series;

pub use air::AirFigures;
pub use cause::CauseFigures;
pub use figures::{FIGURES, HeightFigures, RecordFigures};
pub use series::{NoSeriesName, SeriesName};
