//! All effects at once, each with a prior whose width the evidence chooses: for a rig on which many small causes act together.
//!
//! A search that adds one effect at a time ends early where ten act: no single one brings the fit near the readings, and the first ones
//! chosen take up parts of the others. Here every effect that has a slope is in the fit from the beginning, with departures of all elements
//! beside them. A prior of each effect holds back what the readings do not ask for, and its width is the one with the
//! greatest evidence (automatic relevance determination: D. J. C. MacKay, Neural Computation 4, 415, 1992; M. E. Tipping, J. Mach. Learn.
//! Res. 1, 211, 2001). Effects whose width goes to zero leave the fit.
//!
//! - [`posterior`]: the effects' numbers and their covariance, and what the evidence says of each effect.
//! - [`widths`]: the fit of all effects, with the widths of their priors.
//! - [`exchanges`]: sets that differ by a few effects, compared by the quadratic form of the cost.
//! - [`many_causes`]: the sets of effects that come of it, fitted and scored as those of the stepwise search are.

pub mod exchanges;
pub mod many_causes;
pub mod posterior;
pub mod widths;
