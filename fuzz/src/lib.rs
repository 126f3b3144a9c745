//! Fuzz targets of fieldgap: for every file and line that it reads, what happens with contents that nobody meant to write.
//!
//! A case is accepted or refused with an error. It may not panic, take more than [`MOST_BYTES`](bounds::MOST_BYTES) of memory, or more than
//! [`MOST_SECONDS`](bounds::MOST_SECONDS). `corpus/TARGET` has the seeds, which are valid, and the cases that were once at fault.
//! `tests/reading.rs` reads each byte for byte, and then mutations of them for as long as `BOLERO_RANDOM_TEST_TIME_MS` says.

pub mod batches;
pub mod bounds;
pub mod corpus;
pub mod devices;
pub mod files;
pub mod mutation;
pub mod records;
