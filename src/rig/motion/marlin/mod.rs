//! Robots that speak Marlin's dialect of G-code.

mod config;

pub use config::MarlinConfig;
