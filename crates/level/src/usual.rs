//! Standard uncertainties that are taken where nobody stated one. They are set by judgement and are marked as assumed in every budget.

/// Of the receiver's place along each axis, m: a robot whose tolerance is not known.
pub const PLACE_M: f64 = 1e-4;

/// Of the direction of the receiver's axis about each axis across it, rad: two degrees, a holder set up by eye.
pub const TILT_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Of the temperature of the air, °C: a room without a sensor.
pub const TEMPERATURE_C: f64 = 2.0;

/// Of its relative humidity, percent: the same.
pub const HUMIDITY_PERCENT: f64 = 10.0;

/// Of a simulated level beside that of its source, dB: places to which the elements radiate at large angles.
pub const SIMULATION_DB: f64 = 2.0;
