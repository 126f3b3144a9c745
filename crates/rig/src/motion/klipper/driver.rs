//! The robot behind Klipper.

use std::time::Duration;

use async_trait::async_trait;

use super::config::KlipperConfig;
use super::connection::{Connection, SHUT_DOWN};
use crate::device::Device;
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire};
use crate::motion::Advice;
use crate::motion::g_code::{HomeLine, MOVE_SLACK, straight_to};
use crate::motion::limits::STOPPED_WITHIN;
use crate::space::{Feed, RobotPosition};
use crate::travel::Envelope;
use crate::{Emergency, Motion};

/// How long the host software may take to plan one command: it holds moves back while a second of motion is planned.
const TAKEN_WITHIN: Duration = Duration::from_secs(20);

/// Reports asked for where the line with the position is lost.
const MOST_REPORTS: u32 = 5;

/// How often a move whose line was lost is sent again.
const MOST_REPEATS: u32 = 5;

/// Reports of one place differ by less, m: they have six decimals of a millimetre, of a place in whole steps.
const SAME_PLACE_M: f64 = 1e-6;

/// Lengths are millimetres, coordinates absolute.
const SETTINGS: [&str; 2] = ["G21", "G90"];

/// Motors stay on for a week: an overnight scan must not lose its position.
const KEEP_MOTORS_ON: &str = "SET_IDLE_TIMEOUT TIMEOUT=604800";

/// A robot behind Klipper's host software.
///
/// It moves as commanded: homing, travel and keep-out boxes are checked by
/// [`Guarded`](crate::motion::guarded::Guarded), through which alone a rig gives access to it.
#[derive(Debug)]
pub struct Klipper<L: ByteLink> {
    connection: Connection<L>,
    firmware: String,
    home: Vec<HomeLine>,
    home_within: Duration,
    advice: Vec<Advice>,
    envelope: Envelope,
    at: Option<RobotPosition>,
    /// From the sending of a move until its end was confirmed.
    moving: bool,
    /// Whether Klipper was shut down by a stop of this program.
    shut_down: bool,
}

impl KlipperConfig {
    pub(crate) async fn open(
        &self,
        envelope: Envelope,
        _: Feed,
        port: Option<&str>,
    ) -> Result<Box<dyn Motion>, RigError> {
        let wire = self.firmware.open_port(port)?;
        Ok(Box::new(Klipper::begin(wire, self, envelope).await?))
    }
}

impl<L: ByteLink> Klipper<L> {
    /// Begins a session with the host software at the other end of `wire`. Nothing moves.
    ///
    /// `envelope` is where a damaged line may have sent the robot without harm.
    ///
    /// # Errors
    /// That nothing answers, or not as Klipper does, or that it has shut down.
    pub async fn begin(
        wire: Wire<L>,
        config: &KlipperConfig,
        envelope: Envelope,
    ) -> Result<Self, RigError> {
        let mut robot = Self {
            connection: Connection::new(wire),
            firmware: String::new(),
            home: config.firmware.home.clone(),
            home_within: config.firmware.home_within(),
            advice: Vec::new(),
            envelope,
            at: None,
            moving: false,
            shut_down: false,
        };
        robot.connection.wire.attempting("opening a session with Klipper");
        robot.connection.begin().await?;
        robot.set_up().await?;
        Ok(robot)
    }

    async fn set_up(&mut self) -> Result<(), RigError> {
        let answer = self.connection.command("M115", TAKEN_WITHIN).await?;
        self.firmware = firmware_name(&answer.behind_ok);
        for setting in SETTINGS {
            self.connection.command(setting, TAKEN_WITHIN).await?;
        }
        self.advice = vec![Advice {
            problem: "Klipper can stop a move only by shutting down; `FIRMWARE_RESTART` and homing must follow".to_owned(),
            remedy: "use `pause`, which waits for the end of the move, unless something is in danger",
        }];
        if self.connection.command(KEEP_MOTORS_ON, TAKEN_WITHIN).await?.unknown {
            self.advice.push(Advice {
                problem: "the motors may switch off when idle: this Klipper does not know `SET_IDLE_TIMEOUT`".to_owned(),
                remedy: "set a long `timeout` in [idle_timeout] of printer.cfg: an axis that sags during a pause loses its position",
            });
        }
        Ok(())
    }

    /// Sends commands that move, waits until the robot stands still and asks where.
    async fn perform(
        &mut self,
        lines: &[String],
        within: Duration,
    ) -> Result<RobotPosition, RigError> {
        self.at = None;
        self.moving = true;
        for line in lines {
            self.connection.required(line, within).await?;
        }
        // The first `ok` may be that of another line while this one is lost. Behind a mark, and twice, that is not so.
        for _ in 0..2 {
            self.connection.required("M400", within).await?;
            self.connection.settle(within).await?;
        }
        self.moving = false;
        let position = self.reported().await?;
        self.at = Some(position);
        Ok(position)
    }

    /// Whether a move that ended at another place than its target may be sent again: where its line was lost, so that nothing
    /// moved, or where a damaged digit has sent the robot elsewhere by a free way, and the way from there is free.
    fn may_go_on(
        &self,
        at: RobotPosition,
        start: Option<RobotPosition>,
        target: RobotPosition,
    ) -> bool {
        start.is_some_and(|start| {
            at.is_within(SAME_PLACE_M, start)
                || (self.envelope.check_path(start, at).is_ok()
                    && self.envelope.check_path(at, target).is_ok())
        })
    }

    async fn reported(&mut self) -> Result<RobotPosition, RigError> {
        for _ in 0..MOST_REPORTS {
            let answer = self.connection.command("GET_POSITION", TAKEN_WITHIN).await?;
            if let Some(position) = answer.position {
                return Ok(position);
            }
        }
        let seen = "no line `kinematic` in the answer to GET_POSITION".to_owned();
        Err(self.connection.wire.error(Cause::Unreadable { seen }))
    }
}

#[async_trait]
impl<L: ByteLink> Motion for Klipper<L> {
    fn device(&self) -> &Device {
        self.connection.wire.device()
    }

    fn firmware(&self) -> &str {
        &self.firmware
    }

    fn advice(&self) -> &[Advice] {
        &self.advice
    }

    async fn home(&mut self) -> Result<RobotPosition, RigError> {
        self.connection.wire.attempting("homing");
        if std::mem::take(&mut self.shut_down) {
            self.connection.restart().await?;
            self.set_up().await?;
        }
        let lines: Vec<String> = self.home.iter().map(|line| line.as_str().to_owned()).collect();
        self.perform(&lines, self.home_within).await
    }

    async fn move_to(
        &mut self,
        target: RobotPosition,
        feed: Feed,
    ) -> Result<RobotPosition, RigError> {
        self.connection.wire.attempting(format!("moving to {target}"));
        let within = MOVE_SLACK.longest(self.at.map(|at| at.distance_m(target) / feed.m_s()));
        let mut start = self.at;
        for _ in 0..MOST_REPEATS {
            let mut at = self.perform(&[straight_to(target, feed)], within).await?;
            if at.is_within(SAME_PLACE_M, target) {
                return Ok(at);
            }
            // One report may be damaged.
            let again = self.reported().await?;
            if !again.is_within(SAME_PLACE_M, at) {
                at = self.reported().await?;
            }
            if !self.may_go_on(at, start, target) {
                return Ok(at);
            }
            start = Some(at);
        }
        Err(self.connection.wire.error(Cause::RepeatedlyDamaged { times: MOST_REPEATS }))
    }

    async fn position(&mut self) -> Result<RobotPosition, RigError> {
        self.connection.wire.attempting("reading the position");
        self.reported().await
    }

    async fn stop(&mut self) -> Result<(), RigError> {
        self.at = None;
        self.connection.wire.attempting("stopping");
        if !self.moving {
            // Nothing was sent since the last move was confirmed at its end.
            return Ok(());
        }
        self.shut_down = true;
        self.connection.shut_down(STOPPED_WITHIN).await?;
        self.moving = false;
        Ok(())
    }

    fn emergency(&self) -> Option<Emergency> {
        self.connection.wire.emergency(SHUT_DOWN)
    }
}

impl<L: ByteLink> Drop for Klipper<L> {
    fn drop(&mut self) {
        if std::thread::panicking() && self.moving {
            self.connection.wire.send_without_waiting(SHUT_DOWN);
        }
    }
}

/// `Klipper v0.12.0` of `FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.12.0`.
fn firmware_name(behind_ok: &str) -> String {
    let value = |key: &str| {
        behind_ok.split_ascii_whitespace().find_map(|word| word.strip_prefix(key)).unwrap_or("")
    };
    format!("{} {}", value("FIRMWARE_NAME:"), value("FIRMWARE_VERSION:")).trim().to_owned()
}
