//! The virtual receiver's firmware, which samples on request or continuously.
//!
//! Protocol, version 1. The host sends lines: `?` (who are you), `E text` or `E binary`, `S <n>` (sample `n`
//! readings from this instant; 0: until `X`), `X` (stop), `T` (your clock). Samples are followed by an end mark.
//! A text sample is `<seq> <t_us> <value>` with ` !` if the converter clipped, an end mark
//! `end <next seq> <t_us>`. A binary frame has 24 bytes, little endian: A5 5A, kind (1 sample, 2 end), flags
//! (bit 0 clipped), seq u32, t_us u64, value f32, CRC-32 over bytes 2 to 19. After `E iq` a sample is kind 3, with two f32 in place of the
//! value, in phase and in quadrature with the clock of the drives.

use std::collections::VecDeque;
use std::sync::Arc;

use serde::Deserialize;

use super::converter::Converter;
use super::firmware::{Firmware, Wake};
use super::pin_firmware::PinFirmware;
use super::scope_firmware::ScopeFirmware;
use super::world::World;
use fieldgap_input::{Positive, Rate, literal};

/// Longer lines are refused.
const LINE_LENGTH: usize = 64;

/// Backlog of samples beyond which a free-running receiver drops them.
const MOST_BEHIND: u64 = 200;

/// The virtual receiver, `[virtual.receiver]` in a rig file. Every key has a default.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReceiverSettings {
    /// Readings per second.
    pub rate_hz: Rate,
    /// The reading at which the converter clips.
    pub full_scale_v: Positive,
    /// Bits of the converter, 1 to 24.
    pub resolution_bits: Bits,
    /// Whether it samples on request or continuously.
    pub mode: Mode,
}

impl Default for ReceiverSettings {
    fn default() -> Self {
        Self {
            rate_hz: literal(1000.0),
            full_scale_v: Positive::new(5.0).expect("a literal above zero"),
            resolution_bits: Bits(14),
            mode: Mode::Stream,
        }
    }
}

/// A converter's resolution, 1 to 24 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "u32")]
pub struct Bits(u32);

impl Bits {
    /// The number of bits.
    pub fn get(self) -> u32 {
        self.0
    }
}

impl TryFrom<u32> for Bits {
    type Error = String;
    fn try_from(bits: u32) -> Result<Self, String> {
        match bits {
            1..=24 => Ok(Self(bits)),
            _ => Err(format!("a converter has 1 to 24 bits, not {bits}")),
        }
    }
}

/// What makes the receiver sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// The commands of the protocol.
    Stream,
    /// Continuous: it sends text lines `<t_us> <value>` and takes no commands.
    ///
    /// Not in lockstep, where time stands still without requests.
    FreeRunning,
    /// Continuous: it sends lines of the value alone, as plain loggers do.
    Numbers,
    /// An oscilloscope's commands ([`super::scope_firmware`]), over a network socket.
    Scpi,
    /// Marlin's query of an analog pin ([`super::pin_firmware`]).
    MarlinPin,
}

impl Mode {
    /// Whether it samples continuously.
    pub fn runs_freely(self) -> bool {
        matches!(self, Self::FreeRunning | Self::Numbers)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Text,
    Binary,
    Iq,
}

/// A run of samples: sample `i` of it is ready at `start_s + (i + 1) / rate`.
#[derive(Debug, Clone, Copy)]
struct Run {
    start_s: f64,
    taken: u64,
    /// `None`: until it is stopped.
    count: Option<u64>,
}

/// The firmware of the settings.
pub(super) fn of(settings: ReceiverSettings, world: Arc<World>) -> Box<dyn Firmware> {
    let full_scale_v = settings.full_scale_v.get();
    match settings.mode {
        Mode::Stream | Mode::FreeRunning | Mode::Numbers => {
            Box::new(ReceiverFirmware::new(settings, world))
        }
        Mode::Scpi => Box::new(ScopeFirmware::new(full_scale_v, world)),
        Mode::MarlinPin => {
            Box::new(PinFirmware::new(full_scale_v, settings.rate_hz.get().recip(), world))
        }
    }
}

/// The firmware's state.
pub struct ReceiverFirmware {
    settings: ReceiverSettings,
    converter: Converter,
    world: Arc<World>,
    line: Vec<u8>,
    commands: VecDeque<(String, f64)>,
    encoding: Encoding,
    seq: u32,
    samples: u64,
    run: Option<Run>,
    powered_up_s: f64,
}

impl ReceiverFirmware {
    /// Firmware that samples the field of `world`.
    pub fn new(settings: ReceiverSettings, world: Arc<World>) -> Self {
        Self {
            settings,
            converter: world.converter(settings.full_scale_v.get(), settings.resolution_bits.get()),
            world,
            line: Vec::new(),
            commands: VecDeque::new(),
            encoding: Encoding::Text,
            seq: 0,
            samples: 0,
            run: None,
            powered_up_s: 0.0,
        }
    }

    fn ready_s(&self, run: &Run) -> f64 {
        run.start_s + (run.taken + 1) as f64 / self.settings.rate_hz.get()
    }

    fn t_us(&self, time_s: f64) -> u64 {
        ((time_s - self.powered_up_s) * 1e6).round() as u64
    }

    /// Sends all samples that are ready at `until_s`.
    fn sample(&mut self, until_s: f64, out: &mut Vec<u8>) {
        let Some(mut run) = self.run.take() else { return };
        while run.count.is_none_or(|count| run.taken < count) {
            let ready_s = self.ready_s(&run);
            if ready_s > until_s {
                self.run = Some(run);
                return;
            }
            let carrier_v = match self.encoding {
                Encoding::Iq => self.world.synchronous_v(ready_s, self.samples),
                Encoding::Text | Encoding::Binary => {
                    self.world.reading_v(ready_s, self.samples).into()
                }
            };
            let (value, clipped) = self.converter.convert_signed(carrier_v.re);
            match (self.settings.mode, self.encoding) {
                (Mode::FreeRunning, _) => {
                    say(out, &format!("{} {value:.6}", self.t_us(ready_s)));
                }
                (Mode::Numbers, _) => say(out, &format!("{value:.6}")),
                (_, Encoding::Text) => {
                    let mark = if clipped { " !" } else { "" };
                    say(out, &format!("{} {} {value:.6}{mark}", self.seq, self.t_us(ready_s)));
                }
                (_, Encoding::Binary) => {
                    frame(out, 1, clipped, self.seq, self.t_us(ready_s), &[value as f32]);
                }
                (_, Encoding::Iq) => {
                    let (quadrature, also) = self.converter.convert_signed(carrier_v.im);
                    let parts = [value as f32, quadrature as f32];
                    frame(out, 3, clipped || also, self.seq, self.t_us(ready_s), &parts);
                }
            }
            self.seq = self.seq.wrapping_add(1);
            self.samples += 1;
            run.taken += 1;
        }
        self.end_run(run.start_s + run.taken as f64 / self.settings.rate_hz.get(), out);
    }

    fn end_run(&mut self, time_s: f64, out: &mut Vec<u8>) {
        self.run = None;
        let t_us = self.t_us(time_s);
        match self.encoding {
            Encoding::Text => say(out, &format!("end {} {t_us}", self.seq)),
            Encoding::Binary | Encoding::Iq => frame(out, 2, false, self.seq, t_us, &[0.0]),
        }
    }

    fn execute(&mut self, command: &str, now_s: f64, out: &mut Vec<u8>) {
        match command.split_whitespace().collect::<Vec<_>>()[..] {
            [] => {}
            ["?"] => say(
                out,
                &format!(
                    "receiver 1 rate_hz={} full_scale={:.6} unit=V",
                    self.settings.rate_hz.get(),
                    self.converter.full_scale_v()
                ),
            ),
            ["E", encoding @ ("text" | "binary" | "iq")] => {
                self.encoding = match encoding {
                    "text" => Encoding::Text,
                    "binary" => Encoding::Binary,
                    _ => Encoding::Iq,
                };
                say(out, "ok");
            }
            ["S", count] => match count.parse::<u32>() {
                Ok(count) => {
                    let count = (count > 0).then_some(u64::from(count));
                    self.run = Some(Run { start_s: now_s, taken: 0, count });
                }
                Err(_) => say(out, "error S takes a number of samples"),
            },
            ["X"] => self.end_run(now_s, out),
            ["T"] => say(out, &format!("time {}", self.t_us(now_s))),
            _ => say(out, "error unknown command"),
        }
    }
}

impl Firmware for ReceiverFirmware {
    fn power_up(&mut self, now_s: f64, _out: &mut Vec<u8>) {
        self.line.clear();
        self.commands.clear();
        self.encoding = Encoding::Text;
        self.seq = 0;
        self.powered_up_s = now_s;
        let run = Run { start_s: now_s, taken: 0, count: None };
        self.run = self.settings.mode.runs_freely().then_some(run);
    }

    fn receive(&mut self, byte: u8, now_s: f64) {
        match byte {
            _ if self.settings.mode.runs_freely() => {}
            b'\n' => {
                let line = std::mem::take(&mut self.line);
                self.commands.push_back((String::from_utf8_lossy(&line).into_owned(), now_s));
            }
            // One byte more than is allowed marks the line as too long; no command has that length.
            _ if self.line.len() <= LINE_LENGTH => self.line.push(byte),
            _ => {}
        }
    }

    fn step(&mut self, now_s: f64, out: &mut Vec<u8>) {
        while let Some((command, at_s)) = self.commands.pop_front() {
            self.sample(at_s, out);
            self.execute(&command, at_s, out);
        }
        if self.settings.mode.runs_freely()
            && let Some(run) = &mut self.run
        {
            let due = ((now_s - run.start_s) * self.settings.rate_hz.get()) as u64;
            if due > run.taken + MOST_BEHIND {
                run.taken = due - 1;
            }
        }
        self.sample(now_s, out);
    }

    fn wake(&self) -> Option<Wake> {
        let run = self.run.as_ref()?;
        Some(match run.count {
            // In lockstep the whole run is due at once; otherwise samples go out as they are ready.
            Some(count) if self.world.is_lockstep() => Wake {
                at_s: run.start_s + count as f64 / self.settings.rate_hz.get(),
                answer_needs_it: true,
            },
            count => Wake { at_s: self.ready_s(run), answer_needs_it: count.is_some() },
        })
    }
}

fn say(out: &mut Vec<u8>, line: &str) {
    out.extend_from_slice(line.as_bytes());
    out.push(b'\n');
}

fn frame(out: &mut Vec<u8>, kind: u8, clipped: bool, seq: u32, t_us: u64, values: &[f32]) {
    let start = out.len();
    out.extend_from_slice(&[0xa5, 0x5a, kind, u8::from(clipped)]);
    out.extend_from_slice(&seq.to_le_bytes());
    out.extend_from_slice(&t_us.to_le_bytes());
    values.iter().for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
    let crc = crc32fast::hash(&out[start + 2..]);
    out.extend_from_slice(&crc.to_le_bytes());
}

#[cfg(test)]
mod tests;
