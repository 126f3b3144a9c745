//! The virtual array controller's firmware.
//!
//! Protocol, version 1. The host sends `<seq> <command> [args]*<crc>`, CRC-32 in eight lower-case hex digits over all
//! before the `*`; the reply is `<seq> ok [args]*<crc>` or `<seq> error <code> <text>*<crc>`. A line with a bad
//! checksum is answered `- error 1 checksum`. Delays are counted in steps of the controller's clock.

use std::collections::VecDeque;
use std::sync::Arc;

use super::drive::Drive;
use super::firmware::{Firmware, Wake};
use super::world::World;

/// Steps of the controller's clock in one period of the carrier.
pub const PERIOD_STEPS: u32 = 256;

/// Longer lines are refused as damaged; enough for the delays of a thousand elements.
const LINE_LENGTH: usize = 8192;

const ERROR_CHECKSUM: u32 = 1;
const ERROR_COMMAND: u32 = 2;
const ERROR_ARGUMENTS: u32 = 3;

/// The firmware's state. It powers up silent.
pub struct ArrayFirmware {
    elements: usize,
    clock_hz: f64,
    world: Arc<World>,
    line: Vec<u8>,
    lines: VecDeque<(Vec<u8>, f64)>,
    drive: Drive,
}

impl ArrayFirmware {
    /// Firmware that drives the elements of `world` at a nominal carrier frequency.
    pub fn new(elements: usize, frequency_hz: f64, world: Arc<World>) -> Self {
        Self {
            elements,
            clock_hz: frequency_hz * f64::from(PERIOD_STEPS),
            world,
            line: Vec::new(),
            lines: VecDeque::new(),
            drive: Drive::silent(elements),
        }
    }

    fn answer(&mut self, line: &[u8], now_s: f64) -> String {
        let Some((seq, command, args)) = self.checked(line) else {
            return format!("- error {ERROR_CHECKSUM} checksum");
        };
        match self.execute(&command, &args, now_s) {
            Ok(reply) if reply.is_empty() => format!("{seq} ok"),
            Ok(reply) => format!("{seq} ok {reply}"),
            Err((code, why)) => format!("{seq} error {code} {why}"),
        }
    }

    /// Sequence number, command and arguments of a line that arrived whole.
    fn checked(&self, line: &[u8]) -> Option<(u16, String, Vec<String>)> {
        let text = std::str::from_utf8(line).ok()?.trim_end_matches('\r');
        let (body, crc) = text.rsplit_once('*')?;
        if crc != format!("{:08x}", crc32fast::hash(body.as_bytes())) {
            return None;
        }
        let mut words = body.split_ascii_whitespace().map(str::to_owned);
        let seq = words.next()?.parse().ok()?;
        Some((seq, words.next().unwrap_or_default(), words.collect()))
    }

    fn execute(
        &mut self,
        command: &str,
        args: &[String],
        now_s: f64,
    ) -> Result<String, (u32, String)> {
        let wrong = |why: String| (ERROR_ARGUMENTS, why);
        match (command, args) {
            ("hello", []) => {
                return Ok(format!(
                    "thesis-array 1 elements={} clock_hz={} period_steps={PERIOD_STEPS}",
                    self.elements, self.clock_hz
                ));
            }
            ("state", []) => {
                return Ok(if self.drive.emitting { "on" } else { "off" }.to_owned());
            }
            ("off", []) => self.drive.emitting = false,
            ("on", []) => self.drive.emitting = true,
            ("delays", delays) => {
                if delays.len() != self.elements {
                    let (count, elements) = (delays.len(), self.elements);
                    return Err(wrong(format!("{count} delays for {elements} elements")));
                }
                self.drive.delays_s = delays
                    .iter()
                    .map(|word| self.delay_s(word))
                    .collect::<Option<_>>()
                    .ok_or_else(|| wrong(format!("a delay is 0 to {} or -", PERIOD_STEPS - 1)))?;
            }
            ("modulate", [hz, duty]) => {
                let number = |word: &str| word.parse::<f64>().ok().filter(|v| v.is_finite());
                match (number(hz), number(duty)) {
                    (Some(hz), Some(duty)) if hz >= 0.0 && (0.0..=100.0).contains(&duty) => {
                        self.drive.duty = if hz == 0.0 { 1.0 } else { duty / 100.0 };
                    }
                    _ => return Err(wrong("modulate takes hertz and a percentage".to_owned())),
                }
            }
            ("hello" | "state" | "off" | "on" | "modulate", _) => {
                return Err(wrong(format!("wrong number of arguments for {command}")));
            }
            _ => return Err((ERROR_COMMAND, "unknown command".to_owned())),
        }
        self.world.drive(now_s, self.drive.clone());
        Ok(String::new())
    }

    fn delay_s(&self, word: &str) -> Option<Option<f64>> {
        if word == "-" {
            return Some(None);
        }
        let steps = word.parse::<u32>().ok().filter(|&steps| steps < PERIOD_STEPS)?;
        Some(Some(f64::from(steps) / self.clock_hz))
    }
}

impl Firmware for ArrayFirmware {
    fn power_up(&mut self, now_s: f64, _out: &mut Vec<u8>) {
        self.line.clear();
        self.lines.clear();
        self.drive = Drive::silent(self.elements);
        self.world.drive(now_s, self.drive.clone());
    }

    fn receive(&mut self, byte: u8, now_s: f64) {
        if byte == b'\n' {
            self.lines.push_back((std::mem::take(&mut self.line), now_s));
        } else if self.line.len() < LINE_LENGTH {
            self.line.push(byte);
        }
    }

    fn step(&mut self, _now_s: f64, out: &mut Vec<u8>) {
        while let Some((line, at_s)) = self.lines.pop_front() {
            let answer = self.answer(&line, at_s);
            let crc = crc32fast::hash(answer.as_bytes());
            out.extend_from_slice(format!("{answer}*{crc:08x}\n").as_bytes());
        }
    }

    fn wake(&self) -> Option<Wake> {
        None
    }
}

#[cfg(test)]
mod tests;
