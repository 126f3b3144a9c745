//! The virtual counterpart of [`fieldgap_rig::receiver::MarlinPinReceiver`]: a board with Marlin's firmware, which
//! reports the counts of an analog pin on `M43 P<pin>`.

use std::collections::VecDeque;
use std::sync::Arc;

use super::converter::Converter;
use super::firmware::{Firmware, Wake};
use super::world::World;

/// Longer lines are cut, as Marlin cuts them.
const LINE_LENGTH: usize = 96;

/// The pin's converter: ten bits.
const BITS: u32 = 10;

/// The firmware's state.
pub struct PinFirmware {
    world: Arc<World>,
    converter: Converter,
    period_s: f64,
    line: Vec<u8>,
    lines: VecDeque<String>,
    /// The line that is being answered, and when its answer is due.
    answering: Option<(String, f64)>,
    readings: u64,
}

impl PinFirmware {
    /// Firmware that samples the field of `world` and needs this time for an answer.
    pub fn new(full_scale_v: f64, period_s: f64, world: Arc<World>) -> Self {
        Self {
            converter: world.converter(full_scale_v, BITS),
            world,
            period_s,
            line: Vec::new(),
            lines: VecDeque::new(),
            answering: None,
            readings: 0,
        }
    }

    fn answer(&mut self, line: &str, at_s: f64) -> String {
        let pin = line.strip_prefix("M43 P").and_then(|pin| pin.trim().parse::<u16>().ok());
        let Some(pin) = pin else {
            return format!("echo:Unknown command: \"{line}\"\nok\n");
        };
        let (volts, _) = self.converter.convert(self.world.reading_v(at_s, self.readings));
        self.readings += 1;
        let most = f64::from((1u32 << BITS) - 1);
        let counts = (volts / self.converter.full_scale_v() * most).round();
        format!("PIN: {pin:03}   Port: F3   A3   Analog in = {counts:5}   Input  = 1\nok\n")
    }
}

impl Firmware for PinFirmware {
    fn power_up(&mut self, _now_s: f64, out: &mut Vec<u8>) {
        self.line.clear();
        self.lines.clear();
        self.answering = None;
        out.extend_from_slice(b"start\necho:Marlin\n");
    }

    fn receive(&mut self, byte: u8, now_s: f64) {
        match byte {
            b'\n' => {
                let line = std::mem::take(&mut self.line);
                let line = String::from_utf8_lossy(&line).trim().to_owned();
                if !line.is_empty() {
                    self.lines.push_back(line);
                    self.begin(now_s);
                }
            }
            _ if self.line.len() < LINE_LENGTH => self.line.push(byte),
            _ => {}
        }
    }

    fn step(&mut self, now_s: f64, out: &mut Vec<u8>) {
        while let Some((line, due_s)) = self.answering.take() {
            if due_s > now_s {
                self.answering = Some((line, due_s));
                return;
            }
            out.extend_from_slice(self.answer(&line, due_s).as_bytes());
            self.begin(due_s);
        }
    }

    fn wake(&self) -> Option<Wake> {
        let (_, at_s) = self.answering.as_ref()?;
        Some(Wake { at_s: *at_s, answer_needs_it: true })
    }
}

impl PinFirmware {
    fn begin(&mut self, now_s: f64) {
        if self.answering.is_none() {
            self.answering = self.lines.pop_front().map(|line| (line, now_s + self.period_s));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::clock::Pace;
    use super::super::drive::Drive;
    use super::super::testing::world;
    use super::*;

    #[test]
    fn counts_are_the_level_at_the_instant_of_the_answer() {
        let (world, _) = world("[microphone]\nsensitivity_v_pa = 0.001\n", Pace::Lockstep);
        world.drive(0.0, Drive { emitting: true, ..Drive::silent(36) });
        let level_v = world.reading_v(1.01, 0);
        let mut pin = PinFirmware::new(5.0, 0.01, world);
        let mut out = Vec::new();
        b"M43 P57\nM999\n".iter().for_each(|&byte| pin.receive(byte, 1.0));
        pin.step(1.005, &mut out);
        assert!(out.is_empty());
        pin.step(1.02, &mut out);
        let output = String::from_utf8(out).expect("text");
        let (_, after) = output.split_once("Analog in =").expect("a value");
        let counts: f64 =
            after.split_whitespace().next().expect("a number").parse().expect("a number");
        assert!(level_v > 0.1 && (counts * 5.0 / 1023.0 - level_v).abs() < 2.5 / 1023.0 + 1e-9);
        assert!(output.ends_with("Unknown command: \"M999\"\nok\n"), "{output}");
    }
}
