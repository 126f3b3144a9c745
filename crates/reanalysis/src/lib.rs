//! Records compared and diagnosed again, with another simulator, another registration or a part of the catalogue of effects. Results go beside the
//! first ones, into `reanalyses/NAME` of each record; nothing else in the record is touched.
//!
//! Begin with [`With`], which says what is done differently, and [`Reanalysis`], which finds the records below a folder and is a
//! [`Work`](fieldgap_jobs::Work) with one item a record. [`Reanalysed`] is the result of an item; [`Keep::keep`] writes it into the record, and
//! [`Summary`] is the table of all.

mod before;
mod error;
mod keep;
mod name;
mod reanalysed;
mod record_item;
mod summary;
mod with;
mod work;

pub use before::Before;
pub use error::ReanalysisError;
pub use keep::{FOLDER, Keep};
pub use name::{NoName, ReanalysisName};
pub use reanalysed::Reanalysed;
pub use record_item::RecordItem;
pub use summary::{Summary, SummaryRow};
pub use with::{With, WrongWith};
pub use work::{KIND, Reanalysis};
