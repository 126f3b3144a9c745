//! The virtual oscilloscope: samples of the receiver's signal, and on its second channel the clock of the drives, by the commands of Rigol's instruments.
//!
//! | command | |
//! |---|---|
//! | `*IDN?`, `*CLS`, `*OPC?`, `:SYST:ERR?` | as IEEE 488.2 and SCPI have them |
//! | `:CHAN1:SCAL <V>`, `:CHAN1:OFFS <V>` | volts per division (25 steps of its 8 bits); offset |
//! | `:TIM:MAIN:SCAL <s>` | seconds per division (12 divisions of 100 samples) |
//! | `:WAV:SOUR CHAN1`, `:WAV:SOUR CHAN2` | the channel whose record is read; the clock is a square wave of 2.5 V, with edges of 2 µs, at 1 V a division |
//! | `:WAV:MODE NORM`, `:WAV:FORM BYTE` | the only accepted values |
//! | `:SING`, `:TFOR`, `:TRIG:STAT?` | one record, triggered by `:TFOR` alone |
//! | `:WAV:PRE?`, `:WAV:DATA?` | scaling of the samples; the samples |

use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;

use super::firmware::{Firmware, Wake};
use super::world::World;

/// Longer lines are refused.
const LINE_LENGTH: usize = 256;

const SAMPLES: usize = 1200;
const DIVISIONS: f64 = 12.0;
const STEPS_A_DIVISION: f64 = 25.0;
const REFERENCE: f64 = 127.0;

/// Amplitude of the clock and volts of a step of its channel.
const CLOCK_V: f64 = 2.5;
const CLOCK_STEP_V: f64 = 1.0 / STEPS_A_DIVISION;

/// Slope of the clock's edges over that of a sine wave of its amplitude: 2 µs at 40 kHz, a few metres of cable on a logic output.
const CLOCK_EDGE: f64 = 4.0;

/// Errors that are kept.
const MOST_ERRORS: usize = 10;

/// Whether a record is being taken.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Trigger {
    Stopped,
    /// Waits for a trigger.
    Waiting,
    /// A record that began then.
    Taking {
        since_s: f64,
    },
}

/// The firmware's state.
pub struct ScopeFirmware {
    world: Arc<World>,
    line: Vec<u8>,
    lines: VecDeque<(String, f64)>,
    powered_up_volts: f64,
    volts_a_division: f64,
    offset_v: f64,
    seconds_a_division: f64,
    trigger: Trigger,
    /// Of the signal and of the clock.
    record: [Vec<u8>; 2],
    /// Which of them is read.
    source: usize,
    records: u64,
    errors: VecDeque<&'static str>,
}

impl ScopeFirmware {
    /// Firmware that samples the field of `world`. Its screen covers `full_scale_v` in either direction.
    pub fn new(full_scale_v: f64, world: Arc<World>) -> Self {
        // The largest step above the middle is 128.
        let volts_a_division = full_scale_v * STEPS_A_DIVISION / (255.0 - REFERENCE);
        Self {
            world,
            line: Vec::new(),
            lines: VecDeque::new(),
            powered_up_volts: volts_a_division,
            volts_a_division,
            offset_v: 0.0,
            seconds_a_division: 50e-6,
            trigger: Trigger::Stopped,
            record: [Vec::new(), Vec::new()],
            source: 0,
            records: 0,
            errors: VecDeque::new(),
        }
    }

    fn span_s(&self) -> f64 {
        self.seconds_a_division * DIVISIONS
    }

    fn step_v(&self) -> f64 {
        self.volts_a_division / STEPS_A_DIVISION
    }

    /// Finishes a record that is complete at this time.
    fn finish(&mut self, now_s: f64) {
        let Trigger::Taking { since_s } = self.trigger else { return };
        if now_s < since_s + self.span_s() {
            return;
        }
        self.trigger = Trigger::Stopped;
        // A record is so short that position and modulation are constant in it; its noise is that of one reading.
        let carrier: Complex64 = self.world.synchronous_v(since_s + self.span_s(), self.records);
        self.records += 1;
        let omega = TAU * self.world.carrier_hz();
        let record = |of: &dyn Fn(Complex64) -> f64| -> Vec<u8> {
            let steps = (0..SAMPLES).map(|sample| {
                let time_s = since_s + self.span_s() * sample as f64 / SAMPLES as f64;
                of(Complex64::from_polar(1.0, -omega * time_s)) + REFERENCE
            });
            steps.map(|steps| steps.round().clamp(0.0, 255.0) as u8).collect()
        };
        self.record = [
            record(&|turn| ((carrier * turn).re + self.offset_v) / self.step_v()),
            record(&|turn| CLOCK_V * (CLOCK_EDGE * turn.re).clamp(-1.0, 1.0) / CLOCK_STEP_V),
        ];
    }

    fn error(&mut self, error: &'static str) {
        if self.errors.len() < MOST_ERRORS {
            self.errors.push_back(error);
        }
    }

    fn execute(&mut self, line: &str, now_s: f64, out: &mut Vec<u8>) {
        let (command, argument) = line.split_once(' ').unwrap_or((line, ""));
        let mut say = |answer: String| out.extend_from_slice(format!("{answer}\n").as_bytes());
        match (command.to_ascii_uppercase().as_str(), argument.trim()) {
            ("", _) => {}
            ("*IDN?", _) => say("FIELDGAP,VIRTUAL-SCOPE,0,1".to_owned()),
            ("*OPC?", _) => say("1".to_owned()),
            ("*CLS", _) => self.errors.clear(),
            (":SYST:ERR?", _) => {
                say(self.errors.pop_front().unwrap_or("0,\"No error\"").to_owned());
            }
            (":SING", _) => self.trigger = Trigger::Waiting,
            (":TFOR", _) => {
                if self.trigger == Trigger::Waiting {
                    self.trigger = Trigger::Taking { since_s: now_s };
                }
            }
            (":TRIG:STAT?", _) => say(match self.trigger {
                Trigger::Stopped => "STOP".to_owned(),
                Trigger::Waiting => "WAIT".to_owned(),
                Trigger::Taking { .. } => "RUN".to_owned(),
            }),
            (":WAV:PRE?", _) => {
                let [step_v, offset_v] = match self.source {
                    0 => [self.step_v(), self.offset_v],
                    _ => [CLOCK_STEP_V, 0.0],
                };
                say(format!(
                    "0,0,{SAMPLES},1,{:.9e},0,0,{step_v:.9e},{:.9},{REFERENCE}",
                    self.span_s() / SAMPLES as f64,
                    offset_v / step_v,
                ));
            }
            (":WAV:DATA?", _) => {
                let record = &self.record[self.source];
                out.extend_from_slice(format!("#9{:09}", record.len()).as_bytes());
                out.extend_from_slice(record);
                out.push(b'\n');
            }
            (":WAV:SOUR", "CHAN1") => self.source = 0,
            (":WAV:SOUR", "CHAN2") => self.source = 1,
            (":WAV:MODE", "NORM") | (":WAV:FORM", "BYTE") => {}
            (":CHAN1:SCAL", volts) => self.set(volts, |scope, v| scope.volts_a_division = v),
            (":TIM:MAIN:SCAL", seconds) => {
                self.set(seconds, |scope, s| scope.seconds_a_division = s)
            }
            (":CHAN1:OFFS", volts) => match volts.parse::<f64>() {
                Ok(volts) if volts.is_finite() => self.offset_v = volts,
                _ => self.error("-104,\"Data type error\""),
            },
            (":WAV:SOUR" | ":WAV:MODE" | ":WAV:FORM", _) => {
                self.error("-224,\"Illegal parameter value\"");
            }
            _ => self.error("-113,\"Undefined header\""),
        }
    }

    fn set(&mut self, word: &str, put: impl Fn(&mut Self, f64)) {
        match word.parse::<f64>() {
            Ok(value) if value > 0.0 && value.is_finite() => put(self, value),
            _ => self.error("-222,\"Data out of range\""),
        }
    }
}

impl Firmware for ScopeFirmware {
    fn power_up(&mut self, _now_s: f64, _out: &mut Vec<u8>) {
        self.line.clear();
        self.lines.clear();
        self.volts_a_division = self.powered_up_volts;
        self.offset_v = 0.0;
        self.seconds_a_division = 50e-6;
        self.trigger = Trigger::Stopped;
        self.record = [Vec::new(), Vec::new()];
        self.source = 0;
        self.errors.clear();
    }

    fn receive(&mut self, byte: u8, now_s: f64) {
        if byte == b'\n' {
            let line = std::mem::take(&mut self.line);
            self.lines.push_back((String::from_utf8_lossy(&line).trim().to_owned(), now_s));
        } else if self.line.len() < LINE_LENGTH {
            self.line.push(byte);
        }
    }

    fn step(&mut self, now_s: f64, out: &mut Vec<u8>) {
        while let Some((line, at_s)) = self.lines.pop_front() {
            self.finish(at_s);
            self.execute(&line, at_s, out);
        }
        self.finish(now_s);
    }

    fn wake(&self) -> Option<Wake> {
        let Trigger::Taking { since_s } = self.trigger else { return None };
        Some(Wake { at_s: since_s + self.span_s(), answer_needs_it: true })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::clock::Pace;
    use super::super::drive::Drive;
    use super::super::testing::world;
    use super::*;

    fn scope(truth: &str) -> ScopeFirmware {
        let (world, _) = world(truth, Pace::Lockstep);
        world.drive(0.0, Drive { emitting: true, ..Drive::silent(36) });
        ScopeFirmware::new(5.0, world)
    }

    fn send(scope: &mut ScopeFirmware, lines: &str, now_s: f64) -> Vec<u8> {
        let mut out = Vec::new();
        lines.bytes().for_each(|byte| scope.receive(byte, now_s));
        scope.step(now_s, &mut out);
        out
    }

    #[test]
    fn a_record_is_the_fields_carrier_sampled() {
        let mut scope = scope("");
        send(&mut scope, ":SING\n:TFOR\n", 1.0);
        assert_eq!(send(&mut scope, ":TRIG:STAT?\n", 1.0), b"RUN\n");
        assert_eq!(scope.wake().map(|wake| wake.answer_needs_it), Some(true));
        assert_eq!(send(&mut scope, ":TRIG:STAT?\n", 1.0006), b"STOP\n");
        let data = send(&mut scope, ":WAV:DATA?\n", 1.0006);
        assert_eq!(data[..11], *b"#9000001200");
        let level_v = scope.world.phasor_v(1.0006, 0).norm();
        // 600 µs are 24 whole cycles: the sums over the record give the amplitude.
        let sum: Complex64 = data[11..1211]
            .iter()
            .enumerate()
            .map(|(n, &byte)| {
                let volts = (f64::from(byte) - REFERENCE) * scope.step_v();
                volts * Complex64::from_polar(1.0, TAU * 24.0 * n as f64 / 1200.0)
            })
            .sum();
        let amplitude_v = sum.norm() * 2.0 / 1200.0;
        // Every cycle is rounded alike.
        let rounding_v = 0.2 * scope.step_v();
        assert!(level_v > 0.1 && (amplitude_v - level_v).abs() < rounding_v, "{amplitude_v}");
    }

    /// The second channel shows when the drives' clock is at its crest, so that the two records tell the phase of the field.
    #[test]
    fn the_second_channel_is_the_clock_of_the_drives() {
        let mut scope = scope("");
        send(&mut scope, ":SING\n:TFOR\n", 1.00001);
        send(&mut scope, ":TRIG:STAT?\n", 1.00071);
        let mut carrier = |channel: &str, step_v: f64| -> Complex64 {
            let data = send(&mut scope, &format!(":WAV:SOUR {channel}\n:WAV:DATA?\n"), 1.001);
            let samples = data[11..1211].iter().enumerate();
            let turns = samples.map(|(n, &byte)| {
                let volts = (f64::from(byte) - REFERENCE) * step_v;
                volts * Complex64::from_polar(2.0 / 1200.0, TAU * 24.0 * n as f64 / 1200.0)
            });
            turns.sum()
        };
        let (signal, clock) = (carrier("CHAN1", 1.0), carrier("CHAN2", CLOCK_STEP_V));
        let truth = scope.world.synchronous_v(1.00061, 0);
        assert!((signal * clock.conj() * truth.conj()).arg().abs() < 0.01, "{signal} {clock}");
        // The fundamental of a square wave is 4/π of its amplitude; edges take a little of it.
        assert!((1.2 * CLOCK_V..1.28 * CLOCK_V).contains(&clock.norm()), "{clock}");
        let preamble = send(&mut scope, ":WAV:PRE?\n", 1.001);
        assert!(String::from_utf8(preamble).expect("text").contains(",4.0"), "0.04 V a step");
    }

    #[test]
    fn nothing_triggers_by_itself_and_what_it_does_not_know_is_an_error() {
        let mut scope = scope("");
        send(&mut scope, ":SING\n", 1.0);
        assert_eq!(send(&mut scope, ":TRIG:STAT?\n", 2.0), b"WAIT\n");
        send(&mut scope, ":WAV:FORM WORD\n:FOO\n:CHAN1:SCAL -1\n", 2.0);
        let errors = send(&mut scope, ":SYST:ERR?\n:SYST:ERR?\n:SYST:ERR?\n:SYST:ERR?\n", 2.0);
        let errors = String::from_utf8(errors).expect("text");
        let codes: Vec<&str> = errors.lines().filter_map(|line| line.split(',').next()).collect();
        assert_eq!(codes, ["-224", "-113", "-222", "0"]);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            let mut scope = scope("");
            bytes.iter().for_each(|&byte| scope.receive(byte, 1.0));
            scope.step(1.0, &mut Vec::new());
        }
    }
}
