//! Swipes of a hand over an array, recognised from the signals of four of its elements: two on the left, two on the right.
//!
//! A hand over the array reflects its sound. The level at a receiving element then rises or falls, depending on the phase of the echo
//! relative to the direct sound. A hand that passes changes one side before the other. The detector needs no model of array, air or
//! hand: it takes four readings at a time and returns swipes.
//!
//! ```
//! use fieldgap_sensing::{Direction, SwipeDetector};
//!
//! let mut detector = SwipeDetector::new(250.0);
//! let swipes = (0..1000).filter_map(|n| {
//!     let time_s = f64::from(n) / 250.0;
//!     let noise = 1e-3 * f64::from(n % 2);
//!     let echo = |at_s: f64| 0.2 * (-((time_s - at_s) / 0.2f64).powi(2)).exp();
//!     // The echo reaches the left elements 0.1 s before the right ones.
//!     let [left, right] = [2.0, 2.1].map(|at_s| 0.3 + noise + echo(at_s));
//!     detector.take(time_s, [left, left, right, right])
//! });
//! let directions: Vec<Direction> = swipes.map(|swipe| swipe.direction).collect();
//! assert_eq!(directions, [Direction::Right]);
//! ```
//!
//! Begin with [`SwipeDetector`] for readings from anywhere, or with [`SwipeListener`] for the array of a rig.

mod channel;
mod detector;
mod section;
mod swipe_listener;

pub use detector::{Direction, Swipe, SwipeDetector};
pub use section::SensingSection;
pub use swipe_listener::SwipeListener;
