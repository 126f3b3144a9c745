//! The result of a diagnosis, put together.
//!
//! - [`builder`]: the result, from what the phases found.
//! - [`sentence`]: the verdict in one sentence.
//! - [`within_uncertainty`]: how far the set-up departs from what is stated.
//! - [`maps`]: scan and simulations height by height.

pub mod builder;
pub mod maps;
pub mod sentence;
pub mod within_uncertainty;
