//! Swipes of a hand over a display, told from four of its elements that listen: two on the left, two on the right.
//!
//! A hand over the array throws its sound back, and what an element hears changes: up or down, as echo and leakage add or
//! cancel. A hand that passes changes one side before the other. The [detector](SwipeDetector) knows neither the array nor the
//! air nor the hand: four readings at a time go in, swipes come out.

mod channel;
mod detector;
mod section;
mod session;

pub use detector::{Direction, Swipe, SwipeDetector};
pub use section::SensingSection;
pub use session::SensingSession;
