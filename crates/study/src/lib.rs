//! Studies: how peak, focal radius and sub-peaks of a field go with any parameter of the array, the focus, the medium,
//! the model or the map.
//!
//! A study is a file ([`Study`]): a set-up in the sections that rig files and plans have, and one or two sweeps, each of
//! which gives values to one key (or the same to several). Every combination of values is written into the set-up and
//! read as if it had stood there, so that whatever a set-up may say can be swept, and what cannot be is a fault at its
//! line. The studies of the thesis ([`Study::OF_THESIS`]) are such files.
//!
//! | to | see |
//! |---|---|
//! | read a study, or one of the thesis's | [`Study::read`], [`Study::of_thesis`] |
//! | run it | [`run`] |
//! | find where sub-peaks appear between two values | [`onsets`] |
//! | write what was found as a table | [`csv()`], [`draws_csv`], [`text()`] |
//! | see how far a transducer model can be trusted | [`models_beside_integral`] |

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

pub use limits::Limits;
pub use observation::Observation;
pub use onset::{Onset, onsets};
pub use quantiles::Quantiles;
pub use run::{Figure, Row, StudyResult, run};
pub use study_file::{Study, UnknownStudy};
pub use sweep::{Sweep, SweptValue};
pub use table::{csv, draws_csv};
pub use text::text;
pub use transducer_models::{LOBE_DISTANCES_M, ModelBesideIntegral, models_beside_integral};
