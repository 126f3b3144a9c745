//! Rigs and scans on virtual ports. These tests mostly wait for devices: in one program they wait beside each other.

mod campaign;
mod campaign_alarm;
mod devices_on_virtual_rig;
mod fly_scan;
mod grbl_rig;
mod kill_and_resume;
mod long_scan;
mod mixed_devices;
mod noise_floor;
mod phase_scan;
#[path = "../program/mod.rs"]
mod program;
mod replay_wire;
mod repository;
mod rig_manual;
mod rig_serial;
mod scan_ends_safe;
mod scan_plans;
#[path = "../script/mod.rs"]
mod script;
#[path = "../served/mod.rs"]
mod served;
mod slow_answers;
mod suspended_scan;
#[path = "../terminal/mod.rs"]
mod terminal;
mod transcripts;
mod virtual_ports;
mod watchdog;
mod watched_scan;
