//! Rigs and scans on virtual ports. These tests mostly wait for devices: in one program they wait beside each other.

mod campaign;
mod campaign_alarm;
mod devices_on_virtual_rig;
mod kill_and_resume;
mod mixed_devices;
mod replay_wire;
mod repository;
mod rig_manual;
mod scan_ends_safe;
#[path = "../script/mod.rs"]
mod script;
#[path = "../served/mod.rs"]
mod served;
mod slow_answers;
#[path = "../terminal/mod.rs"]
mod terminal;
mod transcripts;
mod watchdog;
mod watched_scan;
