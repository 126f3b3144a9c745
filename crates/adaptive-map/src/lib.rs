//! Maps of a sound field with standard errors, from as few readings as they need.
//!
//! A plan with `[adaptive]` names a grid and an error in place of points. [`Mapping`] plans a first round, spread evenly. After each round the
//! field is estimated from all readings, and the next are taken where they lower the errors of the map most, per second of this robot, until the
//! stated error is met. [`map`] makes such a map of any record.
//!
//! # The field
//!
//! The complex field is p(x) = p_m(x; θ) + d(x). p_m is the simulation with the set of effects that the diagnosis names
//! (`fieldgap_diagnosis::FoundField`); where it names none, with gain, shift and near field alone. What it misses is normal, of mean zero:
//!
//! | part | covariance |
//! |---|---|
//! | the parameters θ of the set | their priors; a fit to the same readings only says where to linearise |
//! | effects that the set does not hold | a derivative each, of the size that goes undetected: Σ (change / noise)² = 1 over all readings |
//! | errors of the elements' complex weights | Σₙ 2 s₁² gₙ(x) gₙ(y)*, gₙ what element n adds |
//! | reflections, scattering, anything else | s₂² j₀(k\|x - y\|), a diffuse field (Cook et al., J. Acoust. Soc. Am. 27, 1072, 1955) for each drive |
//! | the receiver's curve | two derivatives: compression, and a floor other than believed |
//!
//! Such kernels of plane waves are those of D. Caviedes-Nozal et al. (J. Acoust. Soc. Am. 149, 1107, 2021); here the mean and most of the
//! covariance come from the array.
//!
//! # The readings
//!
//! A reading is f(|p|) plus noise, f what the receiver makes of a level (Rice's mean, compression, floor, drift). It is linearised about the mean
//! p̂ of the field itself: with u = p̂/|p̂|, f(|p|) ≈ f(|p̂|) + f′ Re(u* (p - p̂)). The mean given all readings, with this derivative, is the next
//! p̂ (the iterated Kalman update: B. M. Bell and F. W. Cathey, IEEE Trans. Autom. Control 38, 294, 1993). The covariance of two readings along u
//! and v is half the real part of u* v E\[p p*\], because the process has no preferred phase.
//!
//! Where |p̂| is not large beside the standard deviation σ⊥ of the field across it, E|p| ≈ √(|p̂|² + σ⊥²): the mean reading is taken there, the
//! derivative falls by |p̂| over this, and ½ (σ⊥²/|p̂|)² is added to the variance. This keeps a zero of the field from taking up a wrong sign.
//!
//! s₁, s₂ and the size of the noise are those of the greatest evidence (`sizes`).
//!
//! # The errors
//!
//! Each reading of a round is foretold before it is taken. If they depart by more than was stated, the standard errors are made larger by the factor
//! that fits them (`checks`), and this is said. A map that ends is made by a whole search of the catalogue.
//!
//! # Cost
//!
//! With m readings and n places the factor of the covariance takes m³/3 multiplications and the errors m² n, all in products of matrices. Parameters
//! and elements enter as a matrix of low rank; only the diffuse field has an entry for each pair of readings.

mod batch;
mod checks;
mod diffuse;
mod estimate;
mod even;
mod field_map;
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
