//! Statistics of readings, without a model of the field.
//!
//! - [`detector`]: mean and variance of the magnitude of a noisy level.
//! - [`noise_scale`]: the scale on which readings scatter by one everywhere.
//! - [`median`]: of a sample.
//! - [`phase_noise`]: the noise of phases.
//! - [`reference_motion`]: how the reference of phases moves during a scan.
//! - [`fluctuation`]: what makes a reading differ from its own repeat.
//! - [`reading_pairs`]: differences of two readings of one level.
//! - [`scatter`]: how the readings of a scan scatter.
//! - [`significance`]: how rare a statistic is.
//! - [`slow_level`]: slow noise of the level, taken out of residuals.

pub mod detector;
pub mod fluctuation;
pub mod median;
pub mod noise_scale;
pub mod phase_noise;
pub mod reading_pairs;
pub mod reference_motion;
pub mod scatter;
pub mod significance;
pub mod slow_level;
