//! Maps of a sound field with standard errors, from as few readings as they need.

mod batch;
mod checks;
mod diffuse;
mod estimate;
mod field_map;
mod linear;
mod mapping;
mod normal;
mod posterior;
mod prior;
mod round;
mod sizes;
mod stationary;
mod words;

pub use checks::Checks;
pub use estimate::{Estimate, Foretold};
pub use field_map::{FieldMap, MapError, MapErrors, MapSizes, map};
pub use mapping::{Mapping, MappingError, checks_of, places_of};
pub use round::{LoggedChecks, MapEnd, MapRound};
pub use words::{in_words, to_csv};
