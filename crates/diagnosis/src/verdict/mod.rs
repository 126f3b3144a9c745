//! The verdict, and the size of the gap.
//!
//! - [`judgement`]: which set, if any, is named.
//! - [`judged`]: the sets with their verdict, those of many effects where none of few explains the gap.
//! - [`gap_size`]: the gap over some readings.
//! - [`held_out`]: the gap over readings kept out of the fit.
//! - [`fresh`]: the named set held against readings taken after its fit.
//! - [`waterfall`]: how the gap shrinks as the effects are added one after another.
//! - [`gap_budget`]: the gap shared out over heights, regions and kinds.

pub mod fresh;
pub mod gap_budget;
pub mod gap_size;
pub mod held_out;
pub mod judged;
pub mod judgement;
pub mod waterfall;
