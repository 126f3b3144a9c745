//! Commands that begin with `$`.

use nalgebra::Vector3;

use super::gcode;
use super::settings::Dialect;
use super::{GrblFirmware, MM_PER_INCH, Mode, Then, WRITING_S, say};

impl GrblFirmware {
    /// Executes `$…`. Returns whether it is done, so that `ok` is due, or waits.
    pub(super) fn command(
        &mut self,
        command: &str,
        now_s: f64,
        out: &mut Vec<u8>,
    ) -> Result<bool, u32> {
        if self.mode == Mode::Critical
            && matches!(command.chars().next(), Some('X' | 'H' | 'J' | 'C'))
        {
            return Err(79);
        }
        let is_idle = self.mode == Mode::Ready && !self.machine.is_busy();
        let rests = is_idle
            && self.machine.held_from_s().is_none()
            && self.machine.jogs_until_s().is_none();
        let quiet = if rests || self.mode == Mode::Alarm { Ok(()) } else { Err(8_u32) };
        match command {
            "" => {
                say(out, "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]")
            }
            "$" => {
                quiet?;
                out.extend_from_slice(self.stored.dump().as_bytes());
            }
            "I" => {
                quiet?;
                self.report_build(out);
            }
            "G" => self.report_modes(out),
            "#" => {
                quiet?;
                let [x, y, z]: [f64; 3] = self.work_offset_mm.into();
                say(out, "[G54:0.000,0.000,0.000]");
                say(out, &format!("[G92:{x:.3},{y:.3},{z:.3}]"));
                say(out, "[TLO:0.000]");
            }
            "C" if self.mode == Mode::Check => {
                say(out, "[MSG:Disabled]");
                self.intake.clear();
                self.reset_requested = true;
            }
            "C" => {
                if !rests {
                    return Err(8);
                }
                self.mode = Mode::Check;
                say(out, "[MSG:Enabled]");
            }
            "X" => {
                if self.mode == Mode::Alarm {
                    self.mode = Mode::Ready;
                    say(out, "[MSG:Caution: Unlocked]");
                }
            }
            "SLP" if self.dialect == Dialect::Grbl => {
                quiet?;
                self.mode = Mode::Sleep;
                self.machine.release(now_s);
                say(out, "[MSG:Sleeping]");
            }
            "H" => {
                quiet?;
                return self.home([true; 3], now_s, out);
            }
            // An option of builds that this one does not have.
            "HX" | "HY" | "HZ" => return Err(if self.is_hal() { 5 } else { 3 }),
            _ => match command.strip_prefix("J=") {
                Some(jog) => return self.jog(jog, rests, now_s),
                None => {
                    quiet?;
                    self.stored.store(command)?;
                    self.machine.heed(&self.stored);
                    // Until it is written nothing is received.
                    self.deaf_until_s = now_s + WRITING_S;
                    self.wait(Some(self.deaf_until_s), Then::Acknowledge);
                    return Ok(false);
                }
            },
        }
        Ok(true)
    }

    fn home(&mut self, axes: [bool; 3], now_s: f64, out: &mut Vec<u8>) -> Result<bool, u32> {
        if !self.stored.flag(22) {
            return Err(5);
        }
        self.mode = Mode::Homing;
        if self.is_hal() {
            self.report(now_s, out);
        }
        let until_s = self.machine.plan_homing(axes, now_s);
        self.wait(Some(until_s), Then::Homed(axes));
        Ok(false)
    }

    fn jog(&mut self, jog: &str, rests: bool, now_s: f64) -> Result<bool, u32> {
        if !rests && self.machine.jogs_until_s().is_none() {
            return Err(8);
        }
        let block = gcode::parse(jog, self.dialect)?;
        if block.rapid.is_some() || block.dwell_s.is_some() || block.renames {
            return Err(16);
        }
        let unit_mm = if block.inches == Some(true) { MM_PER_INCH } else { 1.0 };
        let feed_mm_s = block.feed.ok_or(22_u32)? * unit_mm / 60.0;
        let planned_mm = self.machine.planned_mm();
        let absolute = block.absolute.unwrap_or(self.modal.absolute);
        let to_mm = Vector3::from_fn(|axis, _| match block.coordinates[axis] {
            None => planned_mm[axis],
            Some(value) if absolute && block.machine_frame => value * unit_mm,
            Some(value) if absolute => value * unit_mm + self.work_offset_mm[axis],
            Some(value) => planned_mm[axis] + value * unit_mm,
        });
        if self.leaves_travel(to_mm) {
            return Err(15);
        }
        self.machine.jog(to_mm, feed_mm_s, now_s);
        Ok(true)
    }

    fn report_build(&self, out: &mut Vec<u8>) {
        let blocks = self.settings.planner_moves(self.dialect);
        let bytes = self.settings.receive_buffer(self.dialect);
        match self.dialect {
            Dialect::Grbl => {
                let letters = if self.settings.origin_at_switches { "VZ" } else { "V" };
                say(out, "[VER:1.1h.20190830:]");
                say(out, &format!("[OPT:{letters},{blocks},{bytes}]"));
            }
            Dialect::GrblHal => {
                say(out, "[VER:1.1f.20260817:]");
                say(out, &format!("[OPT:VNML+,{blocks},{bytes},3,0]"));
                say(out, "[AXS:3:XYZ]");
                say(out, "[FIRMWARE:grblHAL]");
                say(out, "[DRIVER:fieldgap virtual rig]");
            }
        }
    }

    fn report_modes(&self, out: &mut Vec<u8>) {
        let motion = if self.modal.rapid { "G0" } else { "G1" };
        let units = if self.modal.inches { "G20" } else { "G21" };
        let distance = if self.modal.absolute { "G90" } else { "G91" };
        let feed = self.modal.feed_mm_min;
        say(out, &format!("[GC:{motion} G54 G17 {units} {distance} G94 M5 M9 T0 F{feed:.0} S0]"));
    }
}
