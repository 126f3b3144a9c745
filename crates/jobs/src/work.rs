//! What a batch consists of.

use std::fmt;

use serde::Serialize;
use serde_json::Value;

/// Work that consists of independent items.
///
/// It must be deterministic: an item gives the same bytes in every run, on any number of threads.
pub trait Work: Sync {
    /// The kind of work, by which another process knows how to make it from its description.
    fn kind(&self) -> &str;

    /// What another process needs besides an item to run it.
    fn description(&self) -> Value;

    /// The items, in order.
    fn items(&self) -> Vec<Value>;

    /// The threads that an item uses.
    fn threads(&self) -> Threads {
        Threads::One
    }

    /// Runs an item.
    ///
    /// # Errors
    /// A [`Failure`] if this item cannot be done; it is kept in the results, and the other items are run.
    fn run(&self, item: &Value) -> Result<Product, Failure>;
}

/// The threads that an item uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Threads {
    /// One; several items run at a time.
    One,
    /// All that there are; one item runs at a time.
    All,
}

/// The result of an item.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Product {
    /// JSON, as text on one line.
    Json(String),
    /// Bytes, such as the values of a plane.
    Bytes(Vec<u8>),
}

impl Product {
    /// A value as JSON.
    ///
    /// # Errors
    /// A [`Failure`] if it has no JSON.
    pub fn json(value: &impl Serialize) -> Result<Self, Failure> {
        serde_json::to_string(value).map(Self::Json).map_err(Failure::new)
    }
}

/// Why an item could not be done.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Failure(String);

impl Failure {
    /// A failure, from an error or a sentence.
    pub fn new(why: impl fmt::Display) -> Self {
        Self(why.to_string())
    }
}
