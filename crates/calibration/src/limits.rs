//! The numbers that decide something, each with its reason.

/// Standard deviation of an ordinary element's gain: manufacturers' batches of 40 kHz transducers differ by 5 to 10 %.
pub const ORDINARY_GAIN: f64 = 0.1;

/// The same of its phase, rad: 10°.
pub const ORDINARY_PHASE_RAD: f64 = 0.175;

/// Standard deviation of each part of a complex weight about 1 that the fit assumes beforehand. As wide as a reversed element is away, so
/// that it decides nothing but the common phase.
pub const WEIGHT_SD: f64 = 1.0;

/// How far the array may stand from where the rig file has it, standard deviation, m: a tip that was set by eye.
pub const OFFSET_SD_M: f64 = 1e-3;

/// Relative uncertainty of the speed of sound: 5 K.
pub const SPEED_SD: f64 = 0.01;

/// Relative standard deviation of the level between two knots of its slow change.
pub const DRIFT_SD: f64 = 0.05;

/// Time between two such knots, s: a transducer warms up over minutes.
pub const KNOT_S: f64 = 60.0;

/// Noise that is assumed where no reading was repeated, relative to each. The fit's residual replaces it in the errors.
pub const ASSUMED_NOISE: f64 = 0.02;

/// Least noise of a reading, relative to the rms of all: what no converter and no medium is better than, and what keeps a small reading
/// from deciding alone.
pub const LEAST_NOISE: f64 = 1e-3;

/// A channel below this gain is dead: a fifth of 14 dB below the others, five spreads below a weak one.
pub const DEAD_GAIN: f64 = 0.15;

/// A channel below this gain is weak: five ordinary spreads below the median.
pub const WEAK_GAIN: f64 = 0.5;

/// A channel within this angle of half a turn is reversed, rad: four and a half ordinary spreads.
pub const REVERSED_WITHIN_RAD: f64 = 0.785;

/// Standard errors by which a gain or phase must pass such a limit.
pub const SURE: f64 = 3.0;

/// Largest number of channels that are tried in pairs as exchanged: 780 pairs.
pub const MOST_SUSPECTS: usize = 40;

/// Fall of twice the log likelihood by which an exchange of two channels must explain the readings better. A pair of 780 that improves
/// by chance, with two parameters each way, exceeds this once in a million.
pub const SWAP_FALL: f64 = 40.0;

/// A reading this many standard deviations off the fit is not used.
pub const OUTLIER: f64 = 6.0;

/// Starts that end within this distance of one another, rms of the complex weights, are the same solution.
pub const SAME_SOLUTION: f64 = 0.02;

/// Residual in units of the noise from which on a fit is not trusted. In 299 drawn arrays of 36 elements whose channels were all judged
/// rightly it was at most 2.3, since few repeats tell the noise; where an exchange of channels was missed, at least 2.6.
pub const UNEXPLAINED: f64 = 2.5;
