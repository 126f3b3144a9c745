//! The firmware's settings, `$$`.

use std::collections::BTreeMap;
use std::time::Duration;

use super::build_info::BuildInfo;
use super::reply::{Flavour, Reply};
use crate::error::Cause;
use crate::travel::Envelope;

/// The time after which the motors switch off.
const MOTORS_RELEASE: u32 = 1;

/// At this value of `$1` the motors never switch off.
const HOLDS_FOR_EVER: f64 = 255.0;

/// Two positions that differ by less are the same for soft limits, mm.
const EDGE_MM: f64 = 0.0005;

/// Homing takes longer than computed from speeds: axes accelerate, switches settle.
const HOMING_SLACK: f64 = 1.5;

/// The settings, and what follows from them.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Settings {
    values: BTreeMap<u32, f64>,
    origin_at_switches: bool,
}

/// The numbered values in the answer to `$$`.
fn values_in(lines: &[String]) -> BTreeMap<u32, f64> {
    let values = lines.iter().filter_map(|line| match Reply::parse(line) {
        Reply::Setting(number, value) => Some((number, value)),
        _ => None,
    });
    values.collect()
}

/// Several answers to `$$`, of which some lines may be lost or damaged: what two of them say alike is true.
#[derive(Debug, Default)]
pub(super) struct SettingsReadings {
    seen: BTreeMap<u32, Vec<f64>>,
    confirmed: BTreeMap<u32, f64>,
}

impl SettingsReadings {
    /// Adds an answer.
    pub(super) fn add(&mut self, lines: &[String]) {
        for (number, value) in values_in(lines) {
            let seen = self.seen.entry(number).or_default();
            if seen.contains(&value) {
                self.confirmed.insert(number, value);
            }
            seen.push(value);
        }
    }

    /// The settings, once all that every build has are confirmed.
    pub(super) fn settings(&self, build: BuildInfo, flavour: Flavour) -> Option<Settings> {
        let settings = Settings::from_values(self.confirmed.clone(), build, flavour);
        settings.is_complete().then_some(settings)
    }
}

impl Settings {
    /// Reads one answer to `$$`; what a build lacks is taken as off.
    #[cfg(test)]
    fn from_lines(lines: &[String], build: BuildInfo, flavour: Flavour) -> Self {
        Self::from_values(values_in(lines), build, flavour)
    }

    fn from_values(values: BTreeMap<u32, f64>, build: BuildInfo, flavour: Flavour) -> Self {
        let homing_flags = values.get(&22).copied().unwrap_or(0.0) as u32;
        let origin_at_switches = match flavour {
            Flavour::Grbl => build.origin_at_switches,
            Flavour::GrblHal => homing_flags & 8 != 0,
        };
        Self { values, origin_at_switches }
    }

    /// Whether it holds what every build has.
    pub(super) fn is_complete(&self) -> bool {
        [1, 13, 20, 21, 22, 23, 24, 25, 27]
            .iter()
            .chain(&[100, 101, 102])
            .chain(&[110, 111, 112])
            .chain(&[120, 121, 122])
            .chain(&[130, 131, 132])
            .all(|number| self.values.contains_key(number))
    }

    fn value(&self, number: u32) -> f64 {
        self.values.get(&number).copied().unwrap_or(0.0)
    }

    fn flag(&self, number: u32) -> bool {
        self.value(number) as u32 & 1 != 0
    }

    /// Whether `$H` is possible.
    pub(super) fn homing_enabled(&self) -> bool {
        self.flag(22)
    }

    /// Whether targets are checked against the travel.
    pub(super) fn soft_limits(&self) -> bool {
        self.flag(20)
    }

    /// Whether end switches stop the machine.
    pub(super) fn hard_limits(&self) -> bool {
        self.flag(21)
    }

    /// Whether positions are reported in inches.
    pub(super) fn reports_inches(&self) -> bool {
        self.flag(13)
    }

    /// What differs from the settings before the motors were told to hold: a damaged line has written it.
    pub(super) fn changed_beside_the_motors(&self, before: &Self) -> Option<Cause> {
        let changed = |(number, value): &(&u32, &f64)| {
            let was = before.values.get(number);
            **number != MOTORS_RELEASE && was.is_some_and(|was| was != *value)
        };
        let (number, value) = self.values.iter().find(changed)?;
        let was = before.value(*number);
        Some(Cause::Setting {
            name: format!("${number}={value}"),
            problem: format!(
                "it was {was} before `$1=255` was sent, and a line damaged on its way has changed it. Set `${number}={was}`"
            ),
        })
    }

    /// How long after a move the motors switch off, ms, if they do.
    pub(super) fn motors_release_after_ms(&self) -> Option<f64> {
        Some(self.value(MOTORS_RELEASE)).filter(|&idle_ms| idle_ms < HOLDS_FOR_EVER)
    }

    /// The largest speed of the slowest axis, mm/s.
    pub(super) fn slowest_axis_mm_s(&self) -> Option<f64> {
        let least = (110..=112).map(|number| self.value(number)).reduce(f64::min)?;
        Some(least / 60.0).filter(|&mm_s| mm_s > 0.0)
    }

    /// The acceleration of the slowest axis, mm/s².
    pub(super) fn least_acceleration_mm_s2(&self) -> Option<f64> {
        let least = (120..=122).map(|number| self.value(number)).reduce(f64::min)?;
        Some(least).filter(|&mm_s2| mm_s2 > 0.0)
    }

    /// How far a reported position may be from the commanded one at rest: a step and what is rounded, mm.
    pub(super) fn resolution_mm(&self) -> f64 {
        let step_mm = (100..=102)
            .map(|number| self.value(number))
            .filter(|&steps_per_mm| steps_per_mm > 0.0)
            .map(|steps_per_mm| 1.0 / steps_per_mm)
            .fold(0.0, f64::max);
        step_mm + if self.reports_inches() { 0.004 } else { 0.0015 }
    }

    /// Where each axis may go by the soft limits, machine coordinates, mm.
    fn spans_mm(&self) -> [[f64; 2]; 3] {
        std::array::from_fn(|axis| {
            let travel_mm = self.value(130 + axis as u32);
            let homes_to_the_low_end = self.value(23) as u32 & (1 << axis) != 0;
            if self.origin_at_switches && homes_to_the_low_end {
                [0.0, travel_mm]
            } else {
                [-travel_mm, 0.0]
            }
        })
    }

    /// Where the machine stands once it is homed: backed off its switches, machine coordinates, mm.
    pub(super) fn home_mm(&self) -> [f64; 3] {
        let pull_off_mm = self.value(27);
        std::array::from_fn(|axis| {
            let homes_to_the_low_end = self.value(23) as u32 & (1 << axis) != 0;
            match (self.origin_at_switches, homes_to_the_low_end) {
                (true, _) => 0.0,
                (false, true) => pull_off_mm - self.value(130 + axis as u32),
                (false, false) => -pull_off_mm,
            }
        })
    }

    /// Compares the rig file's travel with the firmware's soft limits.
    ///
    /// # Errors
    /// [`Cause::Setting`] with the first axis that the firmware would not let go as far.
    pub(super) fn check_travel(&self, envelope: &Envelope) -> Result<(), Cause> {
        if !self.soft_limits() {
            return Ok(());
        }
        for (axis, [low_mm, high_mm]) in self.spans_mm().into_iter().enumerate() {
            let (least_mm, largest_mm) =
                (envelope.travel.least_m[axis] * 1e3, envelope.travel.largest_m[axis] * 1e3);
            if least_mm < low_mm - EDGE_MM || largest_mm > high_mm + EDGE_MM {
                let (name, number) = (["x", "y", "z"][axis], 130 + axis);
                return Err(Cause::Setting {
                    name: format!("${number}={}", self.value(number as u32)),
                    problem: format!(
                        "the soft limits allow {name} from {low_mm:.2} to {high_mm:.2} mm (machine coordinates), \
                         the rig file from {least_mm:.2} to {largest_mm:.2} mm"
                    ),
                });
            }
        }
        Ok(())
    }

    /// How long homing may take by the settings' own speeds and travels, one axis after the other.
    ///
    /// GRBL seeks a switch over one and a half times the travel, and approaches it over five times the pull-off.
    pub(super) fn homing_within(&self) -> Option<Duration> {
        let (locate_mm_s, seek_mm_s) = (self.value(24) / 60.0, self.value(25) / 60.0);
        let pull_off_mm = self.value(27);
        let seconds: f64 = (130..=132)
            .map(|number| {
                1.5 * self.value(number) / seek_mm_s
                    + 7.0 * pull_off_mm / locate_mm_s
                    + pull_off_mm / seek_mm_s
            })
            .sum();
        Duration::try_from_secs_f64(10.0 + HOMING_SLACK * seconds).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::travel::AxisBox;

    const DUMP: &str = "$0=10\n$1=25\n$13=0\n$20=1\n$21=0\n$22=1\n$23=3\n$24=100.000\n$25=3000.000\n$27=2.000\n\
        $100=80.000\n$101=80.000\n$102=400.000\n$110=6000.000\n$111=6000.000\n$112=3000.000\n$120=500.000\n\
        $121=500.000\n$122=200.000\n$130=300.000\n$131=300.000\n$132=250.000";

    fn settings(change: (&str, &str), origin_at_switches: bool, flavour: Flavour) -> Settings {
        let text = DUMP.replace(change.0, change.1);
        let lines: Vec<String> = text.lines().map(str::to_owned).collect();
        Settings::from_lines(
            &lines,
            BuildInfo { receive_buffer: None, origin_at_switches },
            flavour,
        )
    }

    fn stock() -> Settings {
        settings(("", ""), false, Flavour::Grbl)
    }

    fn envelope(least_mm: [f64; 3], largest_mm: [f64; 3]) -> Envelope {
        let travel = AxisBox {
            least_m: least_mm.map(|mm| mm * 1e-3),
            largest_m: largest_mm.map(|mm| mm * 1e-3),
        };
        Envelope { travel, keep_out: vec![] }
    }

    #[test]
    fn the_settings_that_matter_for_a_scan_are_read() {
        let settings = stock();
        assert!(settings.is_complete() && settings.homing_enabled() && settings.soft_limits());
        assert!(!settings.hard_limits() && !settings.reports_inches());
        assert_eq!(settings.motors_release_after_ms(), Some(25.0));
        assert_eq!(settings.slowest_axis_mm_s(), Some(50.0));
        assert!((settings.resolution_mm() - 0.014).abs() < 1e-12);
        assert!(!self::settings(("$22=1\n", ""), false, Flavour::Grbl).is_complete());
    }

    #[test]
    fn what_two_readings_say_alike_is_taken_line_by_line() {
        let answer = |lost: &str, damaged: (&str, &str)| -> Vec<String> {
            let lines = DUMP.lines().filter(|line| *line != lost);
            lines.map(|line| line.replace(damaged.0, damaged.1)).collect()
        };
        let build = BuildInfo { receive_buffer: None, origin_at_switches: false };
        let mut readings = SettingsReadings::default();
        readings.add(&answer("$22=1", ("$130=300", "$130=100")));
        assert_eq!(readings.settings(build, Flavour::Grbl), None, "one reading says nothing");
        readings.add(&answer("$1=25", ("$100", "$180")));
        assert_eq!(readings.settings(build, Flavour::Grbl), None, "$22 was read once");
        readings.add(&answer("", ("", "")));
        assert_eq!(readings.settings(build, Flavour::Grbl), Some(stock()));
    }

    #[test]
    fn a_setting_that_a_damaged_line_has_written_is_told_with_its_old_value() {
        let changed = settings(("$21=0", "$21=255"), false, Flavour::Grbl);
        let cause = changed.changed_beside_the_motors(&stock()).expect("changed");
        assert!(cause.to_string().contains("$21=255: it was 0 before"), "{cause}");
        let held = settings(("$1=25", "$1=255"), false, Flavour::Grbl);
        assert!(held.changed_beside_the_motors(&stock()).is_none());
    }

    #[test]
    fn stock_builds_have_their_travel_below_zero() {
        let below = envelope([-300.0, -300.0, -250.0], [0.0, -1.0, -2.0]);
        assert!(stock().check_travel(&below).is_ok());
        let cause = stock().check_travel(&envelope([0.0; 3], [300.0; 3])).expect_err("above zero");
        assert!(cause.to_string().contains("allow x from -300.00 to 0.00 mm"), "{cause}");
        let without = settings(("$20=1", "$20=0"), false, Flavour::Grbl);
        assert!(
            without.check_travel(&envelope([0.0; 3], [300.0; 3])).is_ok(),
            "nobody enforces them"
        );
    }

    #[test]
    fn an_origin_at_the_switches_turns_axes_that_home_to_the_low_end() {
        let positive = envelope([0.0, 0.0, -250.0], [300.0, 300.0, 0.0]);
        assert!(settings(("", ""), true, Flavour::Grbl).check_travel(&positive).is_ok());
        assert!(
            settings(("$22=1", "$22=9"), false, Flavour::GrblHal).check_travel(&positive).is_ok()
        );
        assert!(
            settings(("$22=1", "$22=9"), false, Flavour::Grbl).check_travel(&positive).is_err()
        );
    }

    #[test]
    fn homing_ends_off_the_switches() {
        assert_eq!(stock().home_mm(), [-298.0, -298.0, -2.0]);
        assert_eq!(settings(("", ""), true, Flavour::Grbl).home_mm(), [0.0; 3]);
    }

    #[test]
    fn homing_is_bounded_by_its_own_speeds() {
        let within = stock().homing_within().expect("finite");
        let seconds = 10.0 + 1.5 * (1.5 * 850.0 / 50.0 + 3.0 * 14.0 / (100.0 / 60.0) + 3.0 * 0.04);
        assert!((within.as_secs_f64() - seconds).abs() < 1e-9, "{within:?}");
        assert_eq!(
            settings(("$25=3000.000", "$25=0.000"), false, Flavour::Grbl).homing_within(),
            None
        );
    }
}
