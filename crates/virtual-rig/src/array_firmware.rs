//! The virtual array controller's firmware.
//!
//! It implements the protocol of [`fieldgap_rig::focus_array::protocol`]. Frames and samples share the driver's types; lines and
//! commands are parsed independently.

use std::collections::VecDeque;
use std::sync::Arc;

use super::converter::Converter;
use super::drive::{Drive, Played};
use super::firmware::{Firmware, Wake};
use super::world::World;
use fieldgap_rig::focus_array::{
    ArrayIdentity, DriveFrame, DriveProgram, Envelope, Sensed, THESIS_NAME,
};

/// Longer lines are refused as damaged; enough for a frame of a thousand elements.
const LINE_LENGTH: usize = 16_384;

/// The converter of the elements used as receivers: its full scale, V, and its bits.
const SENSING: (f64, u32) = (1.0, 12);

/// Backlog of samples beyond which they are dropped.
const MOST_BEHIND: u64 = 2000;

/// Highest sampling rate, Hz. The smoothing removes anything faster.
const FASTEST_HZ: f64 = 1000.0;

const ERROR_CHECKSUM: u32 = 1;
const ERROR_COMMAND: u32 = 2;
const ERROR_ARGUMENTS: u32 = 3;
const ERROR_PLAYING: u32 = 4;

/// The firmware's state. It powers up silent.
pub struct ArrayFirmware {
    identity: ArrayIdentity,
    world: Arc<World>,
    line: Vec<u8>,
    lines: VecDeque<(Vec<u8>, f64)>,
    drive: Drive,
    frames: Vec<Option<DriveFrame>>,
    levels: Vec<u8>,
    lease: Lease,
    listening: Option<ListeningRun>,
    powered_up_s: f64,
}

/// How long a display plays without a message from the host.
#[derive(Debug, Clone, Copy)]
struct Lease {
    lasts_s: f64,
    renewed_s: f64,
}

/// Samples taken since listening began.
#[derive(Debug, Clone, Copy)]
struct ListeningRun {
    since_s: f64,
    rate_hz: f64,
    taken: u64,
}

impl ListeningRun {
    fn ready_s(&self) -> f64 {
        self.since_s + (self.taken + 1) as f64 / self.rate_hz
    }
}

impl ArrayFirmware {
    /// Firmware that drives the elements of `world` at a nominal carrier frequency.
    pub fn new(elements: usize, frequency_hz: f64, world: Arc<World>) -> Self {
        Self {
            identity: ArrayIdentity::of_thesis(elements, frequency_hz),
            world,
            line: Vec::new(),
            lines: VecDeque::new(),
            drive: Drive::silent(elements),
            frames: Vec::new(),
            levels: Vec::new(),
            lease: Lease { lasts_s: 0.0, renewed_s: 0.0 },
            listening: None,
            powered_up_s: 0.0,
        }
    }

    /// The same with another division of the carrier's period.
    pub fn with_period_steps(mut self, period_steps: u32) -> Self {
        let carrier_hz = self.identity.carrier_hz();
        self.identity.clock_hz = carrier_hz * f64::from(period_steps);
        self.identity.period_steps = period_steps;
        self
    }

    fn answer(&mut self, line: &[u8], now_s: f64) -> String {
        let Some((seq, command, args)) = self.checked(line) else {
            return format!("- error {ERROR_CHECKSUM} checksum");
        };
        self.lease.renewed_s = now_s;
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
        match command {
            "hello" | "state" if args.is_empty() => return Ok(self.answer_to(command)),
            "off" | "on" if args.is_empty() => {
                self.drive.display = None;
                self.drive.emitting = command == "on";
            }
            "delays" => {
                self.drive.delays_s = self.delays_s(args).map_err(wrong)?;
                self.drive.display = None;
            }
            "modulate" => self.drive.duty = modulation_duty(args).map_err(wrong)?,
            "frame" | "envelope" if self.drive.display.is_some() => {
                return Err((ERROR_PLAYING, "a display plays".to_owned()));
            }
            "frame" => self.take_frame(args).map_err(wrong)?,
            "envelope" => self.take_levels(args).map_err(wrong)?,
            "play" => self.play(args, now_s).map_err(wrong)?,
            "sense" => self.listen(args, now_s).map_err(wrong)?,
            "hello" | "state" | "off" | "on" => {
                return Err(wrong(format!("wrong number of arguments for {command}")));
            }
            _ => return Err((ERROR_COMMAND, "unknown command".to_owned())),
        }
        self.world.drive(now_s, self.drive.clone());
        Ok(String::new())
    }

    fn answer_to(&self, command: &str) -> String {
        let ArrayIdentity { elements, clock_hz, period_steps, .. } = self.identity;
        let ArrayIdentity { most_frames, most_levels, most_sensors, .. } = self.identity;
        match (command, &self.drive.display, self.drive.emitting) {
            ("hello", ..) => format!(
                "{THESIS_NAME} elements={elements} clock_hz={clock_hz} period_steps={period_steps} \
                 frames={most_frames} levels={most_levels} sensors={most_sensors}"
            ),
            (_, Some(_), _) => "playing".to_owned(),
            (_, None, true) => "on".to_owned(),
            (_, None, false) => "off".to_owned(),
        }
    }

    fn delays_s(&self, words: &[String]) -> Result<Vec<Option<f64>>, String> {
        let ArrayIdentity { elements, clock_hz, period_steps, .. } = self.identity;
        if words.len() != elements {
            return Err(format!("{} delays for {elements} elements", words.len()));
        }
        let delay_s = |word: &String| {
            if word == "-" {
                return Ok(None);
            }
            let steps = word.parse::<u32>().ok().filter(|&steps| steps < period_steps);
            let steps =
                steps.ok_or_else(|| format!("a delay is 0 to {} or -", period_steps - 1))?;
            Ok(Some(f64::from(steps) / clock_hz))
        };
        words.iter().map(delay_s).collect()
    }

    fn take_frame(&mut self, words: &[String]) -> Result<(), String> {
        let ArrayIdentity { elements, period_steps, most_frames, .. } = self.identity;
        let number = place(words.first(), most_frames)?;
        let words = words.iter().skip(1).map(String::as_str);
        let frame = DriveFrame::decode(words, elements, period_steps).map_err(|f| f.to_string())?;
        if self.frames.len() <= number {
            self.frames.resize(number + 1, None);
        }
        self.frames[number] = Some(frame);
        Ok(())
    }

    fn take_levels(&mut self, words: &[String]) -> Result<(), String> {
        let most = self.identity.most_levels;
        let first = place(words.first(), most)?;
        let level =
            |word: &String| word.parse().map_err(|_| format!("a level is 0 to 255, not {word}"));
        let levels = words.iter().skip(1).map(level).collect::<Result<Vec<u8>, _>>()?;
        let end = first + levels.len();
        if end > most {
            return Err(format!("{end} levels where {most} have room"));
        }
        if self.levels.len() < end {
            self.levels.resize(end, 0);
        }
        self.levels[first..end].copy_from_slice(&levels);
        Ok(())
    }

    fn play(&mut self, words: &[String], now_s: f64) -> Result<(), String> {
        let [frames, levels, hold, loops, lease_ms] = words else {
            return Err("play takes frames, levels, hold, loops and lease_ms".to_owned());
        };
        let number =
            |word: &String| word.parse::<u32>().map_err(|_| format!("{word} is no number"));
        let (frames, levels) = (number(frames)? as usize, number(levels)? as usize);
        let lacking = || "frames or levels are missing".to_owned();
        let frames = self.frames.get(..frames).ok_or_else(lacking)?;
        let frames = frames.iter().cloned().collect::<Option<Vec<_>>>().ok_or_else(lacking)?;
        let levels = self.levels.get(..levels).ok_or_else(lacking)?.to_vec();
        let hold = std::num::NonZeroU32::new(number(hold)?).ok_or("a hold is above 0")?;
        let envelope = Envelope::new(levels, hold).map_err(|fault| fault.to_string())?;
        let program = DriveProgram::new(frames, envelope).map_err(|fault| fault.to_string())?;
        let loops = u64::from(number(loops)?);
        let lasts_s = f64::from(number(lease_ms)?) * 1e-3;
        self.lease = Lease { lasts_s, renewed_s: now_s };
        self.drive.display = Some(Played::new(Arc::new(program), &self.identity, now_s, loops));
        self.drive.emitting = true;
        Ok(())
    }

    fn listen(&mut self, words: &[String], now_s: f64) -> Result<(), String> {
        let rate = words.first().and_then(|word| word.parse::<f64>().ok());
        let Some(rate_hz) = rate.filter(|hz| (0.0..=FASTEST_HZ).contains(hz)) else {
            return Err(format!("sense takes a rate of 0 to {FASTEST_HZ} Hz and elements"));
        };
        let most = self.identity.most_sensors;
        let elements = self.identity.elements;
        let listening = words
            .iter()
            .skip(1)
            .map(|word| place(Some(word), elements))
            .collect::<Result<Vec<usize>, _>>()?;
        if listening.len() > most || (listening.is_empty() && rate_hz > 0.0) {
            return Err(format!("it listens with 1 to {most} elements"));
        }
        self.drive.listening = if rate_hz > 0.0 { listening } else { Vec::new() };
        self.listening =
            (rate_hz > 0.0).then_some(ListeningRun { since_s: now_s, rate_hz, taken: 0 });
        Ok(())
    }

    /// When the current display ends without the host, s.
    fn falls_silent_s(&self) -> Option<f64> {
        let played = self.drive.display.as_ref()?;
        let lease_s = self.lease.renewed_s + self.lease.lasts_s;
        Some(played.ends_s().map_or(lease_s, |ends_s| ends_s.min(lease_s)))
    }

    /// Ends a display that is over at this time.
    fn end_display(&mut self, now_s: f64) {
        if let Some(ends_s) = self.falls_silent_s().filter(|&ends_s| ends_s <= now_s) {
            self.drive.display = None;
            self.drive.emitting = false;
            self.world.drive(ends_s, self.drive.clone());
        }
    }

    /// Sends all samples that are ready at `until_s`.
    fn sense(&mut self, until_s: f64, out: &mut Vec<u8>) {
        let Some(run) = &mut self.listening else { return };
        let due = ((until_s - run.since_s) * run.rate_hz).max(0.0) as u64;
        if due > run.taken + MOST_BEHIND {
            run.taken = due - 1;
        }
        let (full_scale_v, bits) = SENSING;
        let converter = Converter::new(full_scale_v, bits);
        while run.ready_s() <= until_s {
            let ready_s = run.ready_s();
            let volts = self.world.sensed_v(ready_s, run.taken);
            let sensed = Sensed {
                number: run.taken as u32,
                t_us: ((ready_s - self.powered_up_s) * 1e6).round() as u64,
                volts: volts.into_iter().map(|volts| converter.convert(volts).0).collect(),
            };
            out.extend_from_slice(sensed.encode().as_bytes());
            run.taken += 1;
        }
    }
}

fn wrong(why: String) -> (u32, String) {
    (ERROR_ARGUMENTS, why)
}

/// An index below `most`.
fn place(word: Option<&String>, most: usize) -> Result<usize, String> {
    let number = word.and_then(|word| word.parse::<usize>().ok()).filter(|&number| number < most);
    number.ok_or_else(|| format!("a number of 0 to {} is missing", most.saturating_sub(1)))
}

/// The duty cycle that `modulate` sets.
fn modulation_duty(words: &[String]) -> Result<f64, String> {
    let number = |word: &String| word.parse::<f64>().ok().filter(|value| value.is_finite());
    match words.iter().map(number).collect::<Vec<_>>()[..] {
        [Some(hz), Some(duty)] if hz >= 0.0 && (0.0..=100.0).contains(&duty) => {
            Ok(if hz == 0.0 { 1.0 } else { duty / 100.0 })
        }
        _ => Err("modulate takes hertz and a percentage".to_owned()),
    }
}

impl Firmware for ArrayFirmware {
    fn power_up(&mut self, now_s: f64, _out: &mut Vec<u8>) {
        self.line.clear();
        self.lines.clear();
        self.drive = Drive::silent(self.identity.elements);
        self.frames.clear();
        self.levels.clear();
        self.listening = None;
        self.powered_up_s = now_s;
        self.world.drive(now_s, self.drive.clone());
    }

    fn receive(&mut self, byte: u8, now_s: f64) {
        if byte == b'\n' {
            self.lines.push_back((std::mem::take(&mut self.line), now_s));
        } else if self.line.len() < LINE_LENGTH {
            self.line.push(byte);
        }
    }

    fn step(&mut self, now_s: f64, out: &mut Vec<u8>) {
        while let Some((line, at_s)) = self.lines.pop_front() {
            self.end_display(at_s);
            self.sense(at_s, out);
            let answer = self.answer(&line, at_s);
            let crc = crc32fast::hash(answer.as_bytes());
            out.extend_from_slice(format!("{answer}*{crc:08x}\n").as_bytes());
        }
        self.end_display(now_s);
        self.sense(now_s, out);
    }

    fn wake(&self) -> Option<Wake> {
        let sample_s = self.listening.map(|run| run.ready_s());
        let at_s = [self.falls_silent_s(), sample_s].into_iter().flatten().reduce(f64::min)?;
        Some(Wake { at_s, answer_needs_it: false })
    }
}

#[cfg(test)]
mod tests;
