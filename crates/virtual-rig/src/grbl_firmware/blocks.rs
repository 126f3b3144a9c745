//! What blocks of G-code do.

use nalgebra::Vector3;

use super::gcode::{self, Block};
use super::{GrblFirmware, MM_PER_INCH, Mode, Then};

impl GrblFirmware {
    /// Executes G-code. Returns whether it is done, so that `ok` is due, or waits.
    pub(super) fn gcode(&mut self, line: &str, now_s: f64) -> Result<bool, u32> {
        let locked = matches!(self.mode, Mode::Alarm | Mode::Critical | Mode::Sleep);
        if locked || self.machine.jogs_until_s().is_some() {
            return Err(9);
        }
        if let Some(code) = self.sticky {
            return Err(code);
        }
        let answer = gcode::parse(line, self.dialect).and_then(|block| self.block(&block, now_s));
        if self.is_hal() {
            self.sticky = answer.err();
        }
        answer
    }

    fn block(&mut self, block: &Block, now_s: f64) -> Result<bool, u32> {
        let mut modal = self.modal;
        modal.inches = block.inches.unwrap_or(modal.inches);
        modal.absolute = block.absolute.unwrap_or(modal.absolute);
        modal.rapid = block.rapid.unwrap_or(modal.rapid);
        let unit_mm = if modal.inches { MM_PER_INCH } else { 1.0 };
        modal.feed_mm_min = block.feed.map_or(modal.feed_mm_min, |feed| feed * unit_mm);
        let moves = !block.renames && block.coordinates != [None; 3];
        if moves && !modal.rapid && modal.feed_mm_min <= 0.0 {
            return Err(22);
        }
        self.modal = modal;
        if block.unrenames {
            self.work_offset_mm = Vector3::zeros();
        }
        let planned_mm = self.machine.planned_mm();
        if block.renames {
            for axis in 0..3 {
                if let Some(value) = block.coordinates[axis] {
                    self.work_offset_mm[axis] = planned_mm[axis] - value * unit_mm;
                }
            }
            self.reports.offset_changed();
        }
        if self.mode == Mode::Check {
            return Ok(true);
        }
        if let Some(dwell_s) = block.dwell_s {
            self.wait(None, Then::Dwell { dwell_s });
            return Ok(false);
        }
        if !moves {
            return Ok(true);
        }
        let to_mm =
            Vector3::from_fn(|axis, _| match block.coordinates[axis].map(|v| v * unit_mm) {
                None => planned_mm[axis],
                Some(mm) if !modal.absolute => planned_mm[axis] + mm,
                Some(mm) if block.machine_frame => mm,
                Some(mm) => mm + self.work_offset_mm[axis],
            });
        if self.leaves_travel(to_mm) {
            self.machine.hold(now_s);
            self.wait(None, Then::SoftLimit);
            return Ok(false);
        }
        let feed_mm_min = if modal.rapid { f64::INFINITY } else { modal.feed_mm_min };
        let feed_mm_s = feed_mm_min / 60.0 * f64::from(self.feed_override_percent) / 100.0;
        self.wait(None, Then::Plan { to_mm, feed_mm_s });
        Ok(false)
    }

    /// Whether soft limits forbid a place. grblHAL does not hold to them before it is homed.
    pub(super) fn leaves_travel(&self, to_mm: Vector3<f64>) -> bool {
        let enforced = self.stored.flag(20) && (self.homed || !self.is_hal());
        enforced
            && (0..3).any(|axis| {
                let travel_mm = self.stored.value(130 + axis as u32);
                let (low_mm, high_mm) = match self.settings.origin_at_switches {
                    true => (0.0, travel_mm),
                    false => (-travel_mm, 0.0),
                };
                !(low_mm..=high_mm).contains(&to_mm[axis])
            })
    }
}
