//! An index of all records below a folder, and queries of it.
//!
//! The figures of a record, [`RecordFigures`], lie in the record itself, in `report/figures.json`. [`Index`] reads them, and what else is said
//! of a record in its files, into one file that is queried.

mod air;
mod cause;
mod changes;
mod compare_record;
mod early_report;
mod entry;
mod figures;
mod index;
mod listing;
mod place;
mod query;
mod reading;
mod sampling_error;
mod series;
mod store;

pub use air::AirFigures;
pub use cause::CauseFigures;
pub use compare_record::{NotCompared, compare_record};
pub use entry::{Entry, State};
pub use figures::{FIGURES, HeightFigures, RecordFigures};
pub use index::{ArchiveError, Index, Updated};
pub use listing::{to_csv, to_text};
pub use place::Place;
pub use query::{Filter, Query, SAME_FOCUS_MM, Sort, Wanted};
pub use series::{NoSeriesName, SeriesName};
