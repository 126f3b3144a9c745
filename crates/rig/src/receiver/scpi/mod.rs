//! An oscilloscope that speaks SCPI, over a network socket or a serial port: the receiver's raw signal, and the carrier's
//! amplitude out of each record; with the clock of the drives on a second channel, its phase too.

mod block;
mod dialect;
mod lock_in;

use std::time::Duration;

use async_trait::async_trait;
use serde::Deserialize;
use tokio::time::{Instant, sleep};

use super::reading::{Reading, ReadingBuilder, ReceiverIdentity};
use crate::Receiver;
use crate::device::{Device, Role};
use crate::error::{Cause, RecordFault, RigError};
use crate::link::{ByteLink, Wire, open_serial, open_tcp};
use block::{Block, read_block};
use dialect::{Commands, Dialect, Preset, Scale, ScaleQueries};
use fieldgap_input::{Frequency, Time};
use lock_in::{Carrier, lock_in};
use num_complex::Complex64;

/// Silence after which a message without a stated length has ended.
const QUIET: Duration = Duration::from_millis(200);

/// Errors that an instrument keeps, at most, before it is taken not to understand the question for them.
const MOST_ERRORS: usize = 30;

/// Pause between two questions whether a record was taken.
const ASK_AGAIN: Duration = Duration::from_millis(5);

/// How long an instrument may go on reporting the end of its previous record after it was told to take one. Some report it
/// until they are armed; an assumption, since none was at hand.
const ARMED_WITHIN: Duration = Duration::from_millis(50);

/// How often a record that equals the one before it byte by byte is taken again.
const MOST_EQUAL: u32 = 3;

/// `[receiver.scpi]`: where the instrument is reached, and which command set it uses.
#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "Keys")]
pub struct ScpiConfig(Keys);

/// The keys as they stand in the file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Its network address, `192.168.1.20:5555`.
    address: Option<String>,
    /// Or its serial port; both are absent where a virtual rig gives one.
    port: Option<String>,
    /// Speed of the serial port, bits a second.
    #[serde(default = "default_baud")]
    baud: u32,
    /// The command set.
    #[serde(default)]
    dialect: Preset,
    /// The channel that the receiver hangs on.
    #[serde(default = "first_channel")]
    channel: u8,
    /// The channel that the clock of the drives hangs on, another than `channel`; with it readings have a phase.
    sync_channel: Option<u8>,
    /// The carrier, Hz.
    #[serde(default = "forty_kilohertz")]
    carrier_hz: Frequency,
    /// Said after the dialect's own set-up, for instance time base and volts a division.
    #[serde(default)]
    setup: Vec<String>,
    /// How long one answer, or one record, may take, s.
    #[serde(default = "five_seconds")]
    answer_within_s: Time,
    /// Commands that replace those of the dialect.
    #[serde(default)]
    commands: Commands,
}

impl TryFrom<Keys> for ScpiConfig {
    type Error = String;

    fn try_from(keys: Keys) -> Result<Self, String> {
        match keys.sync_channel == Some(keys.channel) {
            true => Err(format!(
                "`sync_channel` is {}, the channel of the receiver; the clock of the drives needs one of its own",
                keys.channel
            )),
            false => Ok(Self(keys)),
        }
    }
}

fn default_baud() -> u32 {
    115_200
}

fn first_channel() -> u8 {
    1
}

fn forty_kilohertz() -> Frequency {
    Frequency::new(40e3).expect("a literal above zero")
}

fn five_seconds() -> Time {
    Time::new(5.0).expect("a literal above zero")
}

impl ScpiConfig {
    pub(crate) async fn open(&self, port: Option<&str>) -> Result<Box<dyn Receiver>, RigError> {
        let keys = &self.0;
        let address = match port {
            Some(chosen) => is_address(chosen).then_some(chosen),
            None => keys.address.as_deref(),
        };
        Ok(match address {
            Some(address) => {
                let wire = open_tcp(Role::Receiver, address).await?;
                Box::new(ScpiReceiver::begin(wire, self).await?)
            }
            None => {
                let wire = open_serial(Role::Receiver, port, keys.port.as_deref(), keys.baud)?;
                Box::new(ScpiReceiver::begin(wire, self).await?)
            }
        })
    }
}

/// Whether this is a network address and no port's path.
fn is_address(port: &str) -> bool {
    let number = port.rsplit_once(':').map(|(_, number)| number);
    !port.starts_with('/') && number.is_some_and(|number| number.parse::<u16>().is_ok())
}

/// An oscilloscope on a line.
#[derive(Debug)]
pub struct ScpiReceiver<L> {
    wire: Wire<L>,
    identity: ReceiverIdentity,
    name: String,
    dialect: Dialect,
    /// The commands for the channel of the sync.
    sync: Option<Dialect>,
    carrier_hz: f64,
    within: Duration,
    began: Instant,
    /// False while a late answer to an earlier query may still arrive.
    in_step: bool,
    /// The samples of the record before.
    before: Vec<u8>,
}

/// The samples of one channel.
#[derive(Debug, Clone)]
struct Trace {
    samples: Vec<u8>,
    scale: Scale,
}

/// One record.
#[derive(Debug, Clone, Copy)]
struct Shot {
    /// Peak amplitude, V, with its phase against the sync where there is one.
    amplitude_v: Complex64,
    clipped: bool,
    full_scale_v: f64,
    taken_s: f64,
}

impl<L: ByteLink> ScpiReceiver<L> {
    /// Asks the instrument what it is, sets it up, and takes a first record.
    ///
    /// # Errors
    /// That it does not answer, refuses a command, or takes records that cannot show the carrier.
    pub async fn begin(wire: Wire<L>, ScpiConfig(config): &ScpiConfig) -> Result<Self, RigError> {
        let all: Vec<u8> =
            [Some(config.channel), config.sync_channel].into_iter().flatten().collect();
        let of_channel =
            |channel: u8| Dialect::new(config.dialect, channel, &all, &config.commands);
        let mut dialect = of_channel(config.channel);
        dialect.setup.extend(config.setup.iter().cloned());
        let within = Duration::try_from_secs_f64(config.answer_within_s.get());
        let mut receiver = Self {
            wire,
            identity: ReceiverIdentity {
                rate_hz: 1.0,
                full_scale: 1.0,
                unit: "V".to_owned(),
                own_clock: false,
                phase: config.sync_channel.is_some(),
            },
            name: String::new(),
            dialect,
            sync: config.sync_channel.map(of_channel),
            carrier_hz: config.carrier_hz.get(),
            within: within.unwrap_or(Duration::MAX),
            began: Instant::now(),
            in_step: false,
            before: Vec::new(),
        };
        receiver.wire.attempting("identifying the instrument");
        receiver.drain().await?;
        receiver.name = receiver.ask("*IDN?").await?;
        receiver.in_step = true;
        tracing::info!(instrument = %receiver.name);
        receiver.send("*CLS").await?;
        for command in receiver.dialect.setup.clone() {
            receiver.wire.attempting(format!("setting up the instrument with `{command}`"));
            receiver.send(&command).await?;
            receiver.refuse_errors().await?;
        }
        receiver.wire.attempting("taking the first record");
        let started = Instant::now();
        let shot = receiver.shot().await?;
        receiver.refuse_errors().await?;
        receiver.identity.full_scale = shot.full_scale_v;
        receiver.identity.rate_hz = 1.0 / started.elapsed().as_secs_f64().max(1e-3);
        Ok(receiver)
    }

    async fn send(&mut self, command: &str) -> Result<(), RigError> {
        self.wire.send(format!("{command}\n").as_bytes()).await
    }

    /// The answer to a query; without one, the error that the instrument reports.
    async fn ask(&mut self, question: &str) -> Result<String, RigError> {
        self.send(question).await?;
        match self.wire.line(Instant::now() + self.within).await? {
            Some(line) => Ok(line),
            None => Err(self.complaint().await),
        }
    }

    /// Why an answer did not come: the error that the instrument reports, or else its silence.
    async fn complaint(&mut self) -> RigError {
        self.in_step = false;
        let silent = self.wire.error(Cause::Silent { waited: self.within });
        let question = self.dialect.error.clone();
        if self.send(&question).await.is_err() {
            return silent;
        }
        match self.wire.line(Instant::now() + self.within.min(Duration::from_secs(1))).await {
            Ok(Some(reply)) if !is_no_error(&reply) => self.wire.error(Cause::Refused { reply }),
            _ => silent,
        }
    }

    /// Reads the instrument's errors until there is none; the first is the one that counts.
    async fn refuse_errors(&mut self) -> Result<(), RigError> {
        let question = self.dialect.error.clone();
        if question.is_empty() {
            return Ok(());
        }
        let mut first = None;
        for _ in 0..MOST_ERRORS {
            let reply = self.ask(&question).await?;
            if is_no_error(&reply) {
                break;
            }
            first.get_or_insert(reply);
        }
        match first {
            Some(reply) => Err(self.wire.error(Cause::Refused { reply })),
            None => Ok(()),
        }
    }

    /// Throws away what has come.
    async fn drain(&mut self) -> Result<(), RigError> {
        let until = Instant::now() + self.within;
        while Instant::now() < until && !self.wire.bytes(Instant::now() + QUIET).await?.is_empty() {
        }
        Ok(())
    }

    /// After a call that ended in its middle: what was still on its way is let pass, and a known answer asked for.
    async fn get_in_step(&mut self) -> Result<(), RigError> {
        if self.in_step {
            return Ok(());
        }
        for _ in 0..2 {
            self.drain().await?;
            if self.ask("*IDN?").await? == self.name {
                self.in_step = true;
                return Ok(());
            }
        }
        let seen = "answers that belong to earlier queries".to_owned();
        Err(self.wire.error(Cause::Unreadable { seen }))
    }

    /// Takes one record from now on, and finds the carrier in it.
    async fn shot(&mut self) -> Result<Shot, RigError> {
        self.get_in_step().await?;
        self.in_step = false;
        for _ in 0..MOST_EQUAL {
            for command in self.dialect.arm.clone() {
                self.send(&command).await?;
            }
            let was_armed = self.wait_until_taken().await?;
            let taken_s = self.began.elapsed().as_secs_f64();
            let trace = self.trace(&self.dialect.clone()).await?;
            // Two records differ by their noise and by their phase. An instrument that was never seen to wait or to take one
            // may still hand out the last.
            let is_new = was_armed || trace.samples != self.before;
            self.before.clone_from(&trace.samples);
            if is_new {
                // Both channels stand still until they are armed again.
                let sync = match self.sync.clone() {
                    Some(dialect) => Some(self.trace(&dialect).await?),
                    None => None,
                };
                self.in_step = true;
                return self.evaluate(&trace, sync.as_ref(), taken_s);
            }
        }
        let seen = format!("the same record {MOST_EQUAL} times: the instrument takes no new one");
        Err(self.wire.error(Cause::Unreadable { seen }))
    }

    /// Reads one channel of the record that was taken.
    async fn trace(&mut self, of: &Dialect) -> Result<Trace, RigError> {
        if !of.select.is_empty() {
            self.send(&of.select).await?;
        }
        let scale = self.scale(&of.scale).await?;
        self.send(&of.data).await?;
        Ok(Trace { samples: self.block().await?, scale })
    }

    fn evaluate(
        &self,
        trace: &Trace,
        sync: Option<&Trace>,
        taken_s: f64,
    ) -> Result<Shot, RigError> {
        let fault = |fault| self.wire.error(Cause::Record(fault));
        let (carrier, clipped) = self.carrier(trace).map_err(fault)?;
        let amplitude_v = match sync {
            None => carrier.amplitude,
            Some(sync) => {
                let samples = [trace, sync].map(|trace| trace.samples.len());
                let interval_s = [trace, sync].map(|trace| trace.scale.interval_s);
                if samples[0] != samples[1] || interval_s[0] != interval_s[1] {
                    return Err(fault(RecordFault::Unequal { samples, interval_s }));
                }
                // A clipped clock is as good as a square wave.
                let (clock, _) = self.carrier(sync).map_err(fault)?;
                carrier.against(clock, sync.scale.step_v()).map_err(fault)?
            }
        };
        let full_scale_v = trace.scale.full_scale_v(self.dialect.code);
        Ok(Shot { amplitude_v, clipped, full_scale_v, taken_s })
    }

    /// The carrier in a trace, and whether the trace is clipped.
    fn carrier(&self, Trace { samples, scale }: &Trace) -> Result<(Carrier, bool), RecordFault> {
        let code = self.dialect.code;
        let taken: Option<Vec<(f64, bool)>> =
            samples.iter().map(|&byte| scale.volts(byte, code)).collect();
        let volts = taken.ok_or(RecordFault::Hole)?;
        let values: Vec<f64> = volts.iter().map(|(volts, _)| *volts).collect();
        let carrier = lock_in(&values, scale.interval_s, self.carrier_hz)?;
        Ok((carrier, volts.iter().any(|(_, clipped)| *clipped)))
    }

    /// Waits for the end of the record. Returns whether the instrument was seen to wait for it or to take it, so that the end is
    /// not that of the record before. Where the instrument answers only at the end (`*OPC?`), it is always its own.
    async fn wait_until_taken(&mut self) -> Result<bool, RigError> {
        let (question, force) = (self.dialect.state.clone(), self.dialect.force.clone());
        let begun = Instant::now();
        let until = begun + self.within;
        let mut was_armed = force.is_empty();
        loop {
            let state = self.ask(&question).await?;
            // Some repeat the question before the answer.
            let answer = state.split_ascii_whitespace().last().unwrap_or_default();
            let is_taken =
                self.dialect.taken.iter().any(|taken| taken.eq_ignore_ascii_case(answer));
            if is_taken && (was_armed || begun.elapsed() >= ARMED_WITHIN) {
                return Ok(was_armed);
            }
            was_armed |= !is_taken;
            if Instant::now() >= until {
                return Err(self.complaint().await);
            }
            if was_armed && !force.is_empty() {
                self.send(&force).await?;
            }
            sleep(ASK_AGAIN).await;
        }
    }

    async fn scale(&mut self, queries: &ScaleQueries) -> Result<Scale, RigError> {
        let (scale, seen) = match queries {
            ScaleQueries::Preamble { query, origin } => {
                let answer = self.ask(query).await?;
                (Scale::of_preamble(&answer, *origin), answer)
            }
            ScaleQueries::Settings { volts, offset, rate } => {
                let (volts, offset) = (self.ask(volts).await?, self.ask(offset).await?);
                let rate = self.ask(rate).await?;
                (Scale::of_settings(&volts, &offset, &rate), format!("{volts}, {offset}, {rate}"))
            }
        };
        scale.ok_or_else(|| self.wire.error(Cause::Unreadable { seen }))
    }

    async fn block(&mut self) -> Result<Vec<u8>, RigError> {
        let until = Instant::now() + self.within;
        let mut message = Vec::new();
        loop {
            let may_have_ended = matches!(read_block(&message), Block::Indefinite { .. });
            let wait = if may_have_ended { until.min(Instant::now() + QUIET) } else { until };
            let more = self.wire.bytes(wait).await?;
            let nothing_more = more.is_empty();
            message.extend(more);
            match read_block(&message) {
                Block::Definite { data, rest } => {
                    let data = data.to_vec();
                    self.wire.put_back(rest.to_vec());
                    return Ok(data);
                }
                Block::Indefinite { data } if nothing_more => return Ok(data.to_vec()),
                Block::Damaged => {
                    let start = &message[..message.len().min(40)];
                    let seen = String::from_utf8_lossy(start).escape_debug().to_string();
                    return Err(self.wire.error(Cause::Unreadable { seen }));
                }
                _ if nothing_more || Instant::now() >= until => {
                    return Err(self.complaint().await);
                }
                Block::Partial | Block::Indefinite { .. } => {}
            }
        }
    }
}

/// Whether the answer to an error query reports no error: its first number is zero.
fn is_no_error(reply: &str) -> bool {
    let code = reply.split(',').next().unwrap_or_default().split_ascii_whitespace().last();
    code.is_some_and(|code| code.parse::<f64>() == Ok(0.0))
}

#[async_trait]
impl<L: ByteLink> Receiver for ScpiReceiver<L> {
    fn device(&self) -> &Device {
        self.wire.device()
    }

    fn identity(&self) -> &ReceiverIdentity {
        &self.identity
    }

    /// An instrument has no clock to be asked: `settle` is this machine's, and each record is armed after it.
    async fn read_point(&mut self, settle: Duration, count: usize) -> Result<Reading, RigError> {
        self.wire.attempting("reading a point");
        sleep(settle).await;
        let mut tally = ReadingBuilder::default();
        for _ in 0..count {
            let shot = self.shot().await?;
            let (t_us, amplitude_v) = ((shot.taken_s * 1e6).round() as u64, shot.amplitude_v);
            match self.sync {
                Some(_) => {
                    let parts = [amplitude_v.re, amplitude_v.im];
                    tally.add_with_phase(t_us, parts, shot.clipped);
                }
                None => tally.add(t_us, amplitude_v.norm(), shot.clipped),
            }
        }
        tally.finish(0).ok_or_else(|| self.wire.error(Cause::NoReadings { asked: count }))
    }
}

#[cfg(test)]
mod tests;
