//! Parameter studies: peak, focal radius and sub-peaks of a field as functions of any parameter of array, focus, medium, model or map.
//!
//! A study is a file ([`Study`]): a set-up in the sections of rig files and plans, and one or two sweeps. A sweep gives values to one key,
//! or the same values to several. Every combination of values is written into the set-up, which is then read like any other. Every key of a
//! set-up can therefore be swept, and an invalid value is an error at its line. The studies of the thesis ([`Study::OF_THESIS`]) are such files.
//!
//! ```
//! use fieldgap_study::{Figure, Study, run};
//!
//! let study = Study::read(Study::of_thesis("height")?)?;
//! let result = run(&study, false)?;
//! let radius_mm = result.rows[0].figure(Figure::FocalRadius).expect("a focus").median;
//! assert!(radius_mm > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | to | begin with |
//! |---|---|
//! | read a study, or one of the thesis's | [`Study::read`], [`Study::of_thesis`] |
//! | run it | [`run`] |
//! | run one combination of its values, perhaps in another process | [`run_cell`], [`StudyFiles`] |
//! | find where sub-peaks appear between two values | [`onsets`] |
//! | write the result as a table | [`csv()`], [`draws_csv`], [`text()`] |
//! | see where a transducer model is valid | [`models_against_integral`] |

mod cell;
mod documents;
mod limits;
mod observation;
mod onset;
mod point;
mod quantiles;
mod run;
mod shared_sums;
mod study_file;
mod sweep;
mod table;
mod text;
mod transducer_models;

pub use cell::{Cell, run_cell};
pub use documents::StudyFiles;
pub use limits::Limits;
pub use observation::{MapFigures, Observation};
pub use onset::{Onset, onsets};
pub use quantiles::Quantiles;
pub use run::{Figure, Row, StudyResult, run};
pub use study_file::{Study, UnknownStudy};
pub use sweep::{Sweep, SweepTable, SweptValue};
pub use table::{csv, draws_csv};
pub use text::text;
pub use transducer_models::{LOBE_DISTANCES_M, ModelAgainstIntegral, models_against_integral};
