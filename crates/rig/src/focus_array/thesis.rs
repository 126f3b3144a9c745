//! The thesis's controller: programmable logic that counts each element's delay in steps of its clock.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::time::Duration;

use async_trait::async_trait;
use tokio::time::Instant;

use super::config::ThesisConfig;
use super::protocol::{CODE_CHECKSUM, Reply, decode, encode, parse_identity};
use super::{ArrayIdentity, DriveProgram, ElementDelay, Sensed};
use crate::device::{Device, Role};
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire, open_serial};
use crate::{Emergency, FocusArray};

/// How long one answer may take before the line is sent again.
const ANSWER_WITHIN: Duration = Duration::from_secs(1);

/// How long the confirmation of silence may take before it is asked for again: several times within the half second in
/// which a rig is made safe.
const SILENT_WITHIN: Duration = Duration::from_millis(150);

/// How often silence is asked for in all.
const TRIES_AT_SILENCE: u32 = 10;

/// How often a line is sent in all.
const TRIES: u32 = 3;

/// How often at the start, when the controller may still be loading its logic.
const TRIES_AT_START: u32 = 10;

/// Levels of an envelope in one line.
const LEVELS_A_LINE: usize = 256;

/// Samples that wait to be read; beyond this the oldest are dropped.
const KEPT_SAMPLES: usize = 65_536;

/// How the carrier is modulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modulation {
    /// Hz; 0 = a continuous wave.
    pub frequency_hz: f64,
    /// Share of each period that is emitted, percent.
    pub duty_percent: f64,
}

impl Modulation {
    /// A continuous wave.
    pub const NONE: Self = Self { frequency_hz: 0.0, duty_percent: 100.0 };
}

/// An array behind the protocol of [`super::protocol`].
///
/// Silenced when it is opened and when this is dropped, however that happens.
#[derive(Debug)]
pub struct ThesisArray<L: ByteLink> {
    wire: Wire<L>,
    identity: ArrayIdentity,
    seq: u16,
    sensed: VecDeque<Sensed>,
    /// The modulation and the delays that were sent last.
    modulate: String,
    delays: Option<String>,
}

impl ThesisConfig {
    pub(crate) async fn open(
        &self,
        modulation: Modulation,
        port: Option<&str>,
    ) -> Result<Box<dyn FocusArray>, RigError> {
        let wire = open_serial(Role::FocusArray, port, self.port.as_deref(), self.baud)?;
        Ok(Box::new(ThesisArray::begin(wire, modulation).await?))
    }
}

impl<L: ByteLink> ThesisArray<L> {
    /// Silences the array before anything else, asks what it is, and sets its modulation.
    ///
    /// # Errors
    /// That nothing answers, or not by this protocol.
    pub async fn begin(wire: Wire<L>, modulation: Modulation) -> Result<Self, RigError> {
        let unknown = ArrayIdentity {
            name: String::new(),
            elements: 0,
            clock_hz: 0.0,
            period_steps: 1,
            most_frames: 0,
            most_levels: 0,
            most_sensors: 0,
            acknowledges: true,
        };
        let seq = wire.opening();
        let Modulation { frequency_hz, duty_percent } = modulation;
        let modulate = format!("modulate {frequency_hz} {duty_percent}");
        let sensed = VecDeque::new();
        let mut array = Self { wire, identity: unknown, seq, sensed, modulate, delays: None };
        array.wire.attempting("silencing the array on opening");
        array.command("off", TRIES_AT_START).await?;
        array.wire.attempting("identifying the controller");
        let hello = array.command("hello", TRIES).await?;
        array.identity = parse_identity(&hello)
            .ok_or_else(|| array.wire.error(Cause::Unreadable { seen: hello }))?;
        array.wire.attempting("setting the modulation");
        array.command(&array.modulate.clone(), TRIES).await?;
        Ok(array)
    }

    /// Sends a command until it is acknowledged, which is safe since every command may come twice.
    async fn command(&mut self, command: &str, tries: u32) -> Result<String, RigError> {
        self.command_answered(command, tries, ANSWER_WITHIN).await
    }

    async fn command_answered(
        &mut self,
        command: &str,
        tries: u32,
        within: Duration,
    ) -> Result<String, RigError> {
        self.seq = self.seq.wrapping_add(1);
        let line = encode(self.seq, command);
        let mut garbled = 0;
        for _ in 0..tries {
            self.wire.send(line.as_bytes()).await?;
            match self.answer(within).await? {
                Some(Reply::Ok { args, .. }) => return Ok(args),
                Some(Reply::Error { code: CODE_CHECKSUM, .. }) => garbled += 1,
                Some(Reply::Error { text, code, .. }) => {
                    return Err(self
                        .wire
                        .error(Cause::Refused { reply: format!("error {code} {text}") }));
                }
                None => {}
            }
        }
        Err(self.wire.error(if garbled > 0 {
            Cause::RepeatedlyDamaged { times: tries }
        } else {
            Cause::Silent { waited: within * tries }
        }))
    }

    /// The answer to the present line, or `None` if none came whole in time. Answers to earlier lines, that remain from
    /// a cancelled call, are passed over.
    async fn answer(&mut self, within: Duration) -> Result<Option<Reply>, RigError> {
        let until = Instant::now() + within;
        while let Some(line) = self.wire.line(until).await? {
            if Sensed::is_sample(&line) {
                self.keep(&line);
                continue;
            }
            match decode(&line) {
                Some(Reply::Ok { seq, args }) if seq == self.seq => {
                    return Ok(Some(Reply::Ok { seq, args }));
                }
                Some(Reply::Error { seq, code, text }) if seq.is_none_or(|seq| seq == self.seq) => {
                    return Ok(Some(Reply::Error { seq, code, text }));
                }
                Some(_) => {}
                // Damaged on its way: it may have been the answer.
                None => return Ok(None),
            }
        }
        Ok(None)
    }

    /// Keeps a sample that came whole.
    fn keep(&mut self, line: &str) {
        if let Some(sample) = Sensed::decode(line) {
            if self.sensed.len() == KEPT_SAMPLES {
                self.sensed.pop_front();
            }
            self.sensed.push_back(sample);
        }
    }
}

#[async_trait]
impl<L: ByteLink> FocusArray for ThesisArray<L> {
    fn device(&self) -> &Device {
        self.wire.device()
    }

    fn identity(&self) -> &ArrayIdentity {
        &self.identity
    }

    async fn silence(&mut self) -> Result<(), RigError> {
        self.wire.attempting("silencing the array");
        self.command_answered("off", TRIES_AT_SILENCE, SILENT_WITHIN).await.map(drop)
    }

    fn emergency(&self) -> Option<Emergency> {
        // Behind a line that may have been broken off.
        self.wire.emergency(format!("\n{}", encode(0, "off")))
    }

    async fn set_delays(&mut self, delays: &[ElementDelay]) -> Result<(), RigError> {
        self.wire.attempting("setting the delays");
        let command =
            delays_command(&self.identity, delays).map_err(|cause| self.wire.error(cause))?;
        self.command(&command, TRIES).await?;
        self.delays = Some(command);
        Ok(())
    }

    async fn continuous_wave(&mut self) -> Result<(), RigError> {
        self.wire.attempting("ending the modulation");
        self.modulate = "modulate 0 100".to_owned();
        self.command(&self.modulate.clone(), TRIES).await.map(drop)
    }

    async fn emit(&mut self) -> Result<(), RigError> {
        self.wire.attempting("starting emission");
        self.command("on", TRIES).await?;
        // Again, now that it emits: a controller that restarted before this had forgotten them, and one that restarts from
        // now on is found silent.
        if let Some(delays) = self.delays.clone() {
            self.command(&self.modulate.clone(), TRIES).await?;
            self.command(&delays, TRIES).await?;
        }
        Ok(())
    }

    async fn confirm(&mut self, emits: bool) -> Result<(), RigError> {
        self.wire.attempting("checking that the array is still in the commanded state");
        let state = self.command("state", TRIES).await?;
        if state == if emits { "on" } else { "off" } {
            Ok(())
        } else {
            Err(self.wire.error(Cause::Reset))
        }
    }

    async fn load(&mut self, display: &DriveProgram) -> Result<(), RigError> {
        self.wire.attempting("loading a display");
        display.fits(&self.identity).map_err(|fault| self.wire.error(Cause::Display(fault)))?;
        // What plays cannot be overwritten.
        self.command("off", TRIES).await?;
        for (number, frame) in display.frames().iter().enumerate() {
            self.command(&format!("frame {number} {}", frame.encode()), TRIES).await?;
        }
        let levels = display.envelope().levels();
        for (number, part) in levels.chunks(LEVELS_A_LINE).enumerate() {
            let mut command = format!("envelope {}", number * LEVELS_A_LINE);
            for level in part {
                write!(command, " {level}").expect("a string takes all");
            }
            self.command(&command, TRIES).await?;
        }
        Ok(())
    }

    async fn play(
        &mut self,
        display: &DriveProgram,
        loops: u32,
        lease: Duration,
    ) -> Result<(), RigError> {
        self.wire.attempting("starting a display");
        let envelope = display.envelope();
        let command = format!(
            "play {} {} {} {loops} {}",
            display.frames().len(),
            envelope.levels().len(),
            envelope.hold_periods(),
            lease.as_millis()
        );
        self.command(&command, TRIES).await.map(drop)
    }

    async fn is_playing(&mut self) -> Result<bool, RigError> {
        self.wire.attempting("checking whether the display is playing");
        Ok(self.command("state", TRIES).await? == "playing")
    }

    async fn listen(&mut self, elements: &[usize], rate_hz: f64) -> Result<(), RigError> {
        self.wire.attempting("starting to receive");
        let (most, asked) = (self.identity.most_sensors, elements.len());
        if asked > most {
            return Err(self.wire.error(Cause::TooManySensors { most, asked }));
        }
        let mut command = format!("sense {rate_hz}");
        for element in elements {
            write!(command, " {element}").expect("a string takes all");
        }
        self.sensed.clear();
        self.command(&command, TRIES).await.map(drop)
    }

    async fn next_sample(&mut self, until: Instant) -> Result<Option<Sensed>, RigError> {
        self.wire.attempting("receiving");
        while self.sensed.is_empty() {
            match self.wire.line(until).await? {
                Some(line) if Sensed::is_sample(&line) => self.keep(&line),
                Some(_) => {}
                None => return Ok(None),
            }
        }
        Ok(self.sensed.pop_front())
    }
}

impl<L: ByteLink> Drop for ThesisArray<L> {
    fn drop(&mut self) {
        let line = encode(self.seq.wrapping_add(1), "off");
        self.wire.send_without_waiting(line.as_bytes());
    }
}

/// `delays …`, each to the nearest clock step within the carrier's period.
fn delays_command(identity: &ArrayIdentity, delays: &[ElementDelay]) -> Result<String, Cause> {
    let mut command = "delays".to_owned();
    for delay_s in ElementDelay::checked_s(delays, identity.elements)? {
        match delay_s {
            None => command.push_str(" -"),
            Some(delay_s) => {
                let steps =
                    (delay_s * identity.clock_hz).round() % f64::from(identity.period_steps);
                write!(command, " {steps}").expect("a string takes all");
            }
        }
    }
    Ok(command)
}
