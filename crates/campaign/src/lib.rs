//! Many scans against many simulations, by a schedule, on several rigs.

mod schedule;

pub use schedule::Schedule;
