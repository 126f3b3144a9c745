//! Status reports.

use nalgebra::Vector3;

use super::{GrblFirmware, MM_PER_INCH, Mode, say};

/// Reports between two that hold the work offset, and two that hold the overrides.
const OFFSET_EVERY: u32 = 10;
const OVERRIDES_EVERY: u32 = 10;

/// Which of the rarer fields are due.
#[derive(Debug, Clone, Default)]
pub(super) struct Reports {
    until_offset: u32,
    until_overrides: u32,
    moving: bool,
}

impl Reports {
    pub fn offset_changed(&mut self) {
        self.until_offset = 0;
    }

    pub fn override_changed(&mut self) {
        self.until_overrides = 0;
    }

    /// Whether the last report was of a machine that slows down.
    pub fn is_moving(&self) -> bool {
        self.moving
    }
}

impl GrblFirmware {
    fn state(&mut self, now_s: f64) -> &'static str {
        let held_s = self.machine.held_from_s();
        self.reports.moving = held_s.is_some_and(|rests_s| now_s < rests_s);
        match self.mode {
            Mode::Alarm | Mode::Critical => "Alarm",
            Mode::Homing => "Home",
            Mode::Check => "Check",
            Mode::Sleep => "Sleep",
            Mode::Door if self.reports.moving => "Door:2",
            Mode::Door => "Door:0",
            Mode::Ready if self.reports.moving => "Hold:1",
            Mode::Ready if held_s.is_some() => "Hold:0",
            Mode::Ready if self.machine.jogs_until_s().is_some() => "Jog",
            Mode::Ready if self.machine.is_busy() => "Run",
            Mode::Ready => "Idle",
        }
    }

    /// The answer to `?`.
    pub(super) fn report(&mut self, now_s: f64, out: &mut Vec<u8>) {
        let mask = self.stored.value(10) as u32;
        let unit_mm = if self.stored.flag(13) { MM_PER_INCH } else { 1.0 };
        let digits = if self.stored.flag(13) { 4 } else { 3 };
        let triple = |mm: Vector3<f64>| {
            let [x, y, z]: [f64; 3] = (mm / unit_mm).into();
            // A machine does not know a zero below zero.
            let [x, y, z] = [x, y, z].map(|v| if v.abs() < 5e-5 { 0.0 } else { v });
            format!("{x:.digits$},{y:.digits$},{z:.digits$}")
        };
        let at_mm = self.machine.at_mm(now_s);
        let mut fields = vec![self.state(now_s).to_owned()];
        fields.push(match mask & 1 != 0 {
            true => format!("MPos:{}", triple(at_mm)),
            false => format!("WPos:{}", triple(at_mm - self.work_offset_mm)),
        });
        if self.is_hal() || mask & 2 != 0 {
            let places = self.settings.planner_moves(self.dialect);
            let free = places.saturating_sub(self.machine.queued());
            fields.push(format!("Bf:{free},{}", self.intake.free()));
        }
        let feed_mm_min = 60.0 * self.machine.speed_mm_s(now_s);
        fields.push(format!("FS:{:.0},0", feed_mm_min / unit_mm));
        let pressed: String = self
            .machine
            .switches(now_s)
            .into_iter()
            .zip(["X", "Y", "Z"])
            .filter_map(|(pressed, name)| pressed.then_some(name))
            .collect();
        if !pressed.is_empty() {
            fields.push(format!("Pn:{pressed}"));
        }
        let reports = &mut self.reports;
        if reports.until_offset == 0 {
            reports.until_offset = OFFSET_EVERY;
            fields.push(format!("WCO:{}", triple(self.work_offset_mm)));
        } else {
            reports.until_offset -= 1;
            if reports.until_overrides == 0 {
                reports.until_overrides = OVERRIDES_EVERY;
                fields.push(format!("Ov:{},100,100", self.feed_override_percent));
                if self.is_hal() {
                    fields.push("A:".to_owned());
                }
            } else {
                reports.until_overrides -= 1;
            }
        }
        if self.is_hal() && self.homed {
            fields.push("H:1".to_owned());
        }
        say(out, &format!("<{}>", fields.join("|")));
    }
}
