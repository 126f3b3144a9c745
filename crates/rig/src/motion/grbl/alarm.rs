//! What an alarm means, and what it does to the position.

/// The meaning of `ALARM:n`, for people at the rig.
///
/// Codes 1 to 9 are GRBL 1.1's (doc/markdown/interface.md of its sources), the others grblHAL's.
pub(super) fn meaning(code: u32) -> &'static str {
    match code {
        1 => "an axis ran into its end switch; the position is lost",
        2 => "a move would have left the firmware's travel ($130 to $132); nothing moved",
        3 => "it was reset in motion; the position is lost",
        4 | 5 => "the probe is not in the expected state",
        6 => "it was reset while homing",
        7 => "the safety door was opened while homing",
        8 => "homing failed: backing off, an axis did not release its end switch",
        9 => "homing failed: an axis did not find its end switch",
        10 => "the emergency stop is pressed",
        11 => "homing is required first",
        12 => "an axis stands on its end switch",
        17 => "a motor driver reports a fault",
        _ => "see the firmware's list of alarms",
    }
}
