//! A hand that gestures over the array, and its echo at the elements used as receivers.
//!
//! Direction, speed, height, size, lateral offset, tilt and reflection of every gesture are drawn from the seed. A pause without a
//! hand precedes each. Tests get the true gestures from [`World`](crate::World).

mod echo;
mod fresnel;
mod swipes;
mod truth;

pub use echo::{ElementPaths, Plate};
pub use swipes::{Gesture, Swipe, Swipes};
pub use truth::{HandTruth, Range};
