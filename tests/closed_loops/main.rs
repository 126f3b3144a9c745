//! Rigs that choose their own readings.

mod adaptive_map;
mod closed_loop;
mod closed_loop_flights;
#[path = "../dead_element_rig/mod.rs"]
mod dead_element_rig;
#[path = "../program/mod.rs"]
mod program;
