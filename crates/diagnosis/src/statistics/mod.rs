//! Statistics of readings, without a model of the field.
//!
//! - [`detector`]: mean and variance of the magnitude of a noisy level.
//! - [`noise_scale`]: the scale on which readings scatter by one everywhere.
//! - [`fluctuation`]: what makes a reading differ from its own repeat.
//! - [`reading_pairs`]: differences of two readings of one level.
//! - [`dark_readings`]: noise and floor, from readings without a drive.
//! - [`scatter`]: how the readings of a scan scatter.
//! - [`significance`]: how rare a statistic is.
//! - [`golden_section`]: the minimum of a function of one number.

pub mod dark_readings;
pub mod detector;
pub mod fluctuation;
pub mod golden_section;
pub mod noise_scale;
pub mod reading_pairs;
pub mod scatter;
pub mod significance;
