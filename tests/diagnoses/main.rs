//! Diagnoses of scans made by hand, by sealed sets and by others. Each keeps a processor busy for seconds: in one program none waits for another to end.

mod blind;
mod causes_outside;
mod distinguish;
mod figures;
mod measured_field;
mod named;
#[path = "../scanned_pistons/mod.rs"]
mod scanned_pistons;
mod withheld_effect;
