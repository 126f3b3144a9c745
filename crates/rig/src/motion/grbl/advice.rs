//! Advice on the firmware's settings.

use super::settings::Settings;
use crate::motion::Advice;
use crate::space::Feed;

/// What makes scans poorer or less safe than they need be.
pub(super) fn advice(settings: &Settings, feed: Feed) -> Vec<Advice> {
    let mut found = Vec::new();
    let mut say = |problem: String, remedy: &'static str| found.push(Advice { problem, remedy });
    if !settings.homing_enabled() {
        say(
            "homing is off ($22=0), so no scan can begin".to_owned(),
            "fit end switches and set `$22=1` in a G-code terminal",
        );
    }
    if !settings.soft_limits() {
        say(
            "soft limits are off ($20=0)".to_owned(),
            "set $130 to $132 to the travel and set `$20=1`, so that a damaged command cannot drive an axis into its end",
        );
    }
    if !settings.hard_limits() {
        say(
            "hard limits are off ($21=0)".to_owned(),
            "set `$21=1`, so that an end switch stops the robot even when the position is lost",
        );
    }
    if let Some(idle_ms) = settings.motors_release_after_ms() {
        say(
            format!("the motors switch off {idle_ms} ms after each move ($1={idle_ms})"),
            "set `$1=255`, or `hold_motors = true` under [motion.grbl]: an axis may sag or lose steps between two points",
        );
    }
    if let Some(slowest_mm_s) = settings.slowest_axis_mm_s().filter(|&slow| slow < feed.m_s() * 1e3)
    {
        say(
            format!(
                "the slowest axis is limited to {slowest_mm_s:.1} mm/s ($110 to $112), less than `feed_mm_s` in the rig file"
            ),
            "lower `feed_mm_s` in the rig file; otherwise moves along that axis take longer than planned",
        );
    }
    found
}
