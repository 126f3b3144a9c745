//! A hand that swipes over the array: what its echo adds to what elements hear that listen.
//!
//! Every swipe is drawn from the seed: which way, how fast, how high, how large, how far aside, how tilted, how much it throws
//! back; between swipes is a pause without a hand. Nothing of it is told to anybody but those who ask the world for the truth.

mod echo;
mod fresnel;
mod swipes;
mod truth;

pub use echo::{Listening, Plate};
pub use swipes::{Swipe, Swipes, Way};
pub use truth::{Between, HandTruth};
