//! The robot behind a Marlin firmware.

use std::time::Duration;

use async_trait::async_trait;

use super::config::MarlinConfig;
use super::connection::Connection;
use crate::device::Device;
use crate::error::RigError;
use crate::link::{ByteLink, Wire};
use crate::motion::Advice;
use crate::motion::g_code::{HomeLine, MOVE_SLACK, straight_to};
use crate::motion::limits::STOPPED_WITHIN;
use crate::space::{Feed, RobotPosition};
use crate::travel::Envelope;
use crate::{Emergency, Motion};

/// How long the firmware may take to put one command into its queue.
const TAKEN_WITHIN: Duration = Duration::from_secs(20);

/// Stops whatever moves, unnumbered and behind a line that may have been broken off.
const STOP: &[u8] = b"\nM410\n";

/// Waits for all motion, as `M400` does. One inverted bit makes that `M410`, which the emergency parser obeys before the
/// checksum is looked at.
const FINISH_MOVES: &str = "G4 P0";

/// Idle motors would switch off after two minutes in most builds.
const KEEP_MOTORS_ON: &str = "M84 S0";

/// Sent once at the start. A build may lack some of these commands.
///
/// Motors stay on (an overnight scan must not lose its position), the firmware says that it is busy, lengths are
/// millimetres, coordinates absolute.
const SETTINGS: [&str; 4] = [KEEP_MOTORS_ON, "M113 S2", "G21", "G90"];

/// A robot behind a Marlin firmware.
///
/// It moves as commanded: homing, travel and keep-out boxes are checked by
/// [`Guarded`](crate::motion::guarded::Guarded), through which alone a rig gives access to it.
#[derive(Debug)]
pub struct Marlin<L: ByteLink> {
    connection: Connection<L>,
    firmware: String,
    home: Vec<HomeLine>,
    home_within: Duration,
    advice: Vec<Advice>,
    at: Option<RobotPosition>,
}

impl MarlinConfig {
    pub(crate) async fn open(
        &self,
        _: Envelope,
        _: Feed,
        port: Option<&str>,
    ) -> Result<Box<dyn Motion>, RigError> {
        let wire = self.firmware.open_port(port)?;
        Ok(Box::new(Marlin::begin(wire, self).await?))
    }
}

impl<L: ByteLink> Marlin<L> {
    /// Begins a session with the firmware at the other end of `wire`. Nothing moves.
    ///
    /// # Errors
    /// That nothing answers, or not as Marlin does.
    pub async fn begin(wire: Wire<L>, config: &MarlinConfig) -> Result<Self, RigError> {
        let mut robot = Self {
            connection: Connection::new(wire),
            firmware: String::new(),
            home: config.firmware.home.clone(),
            home_within: config.firmware.home_within(),
            advice: Vec::new(),
            at: None,
        };
        robot.set_up().await?;
        Ok(robot)
    }

    async fn set_up(&mut self) -> Result<(), RigError> {
        self.connection.line.wire.attempting("opening a session with the firmware");
        self.connection.begin().await?;
        let answer = self.connection.command("M115", TAKEN_WITHIN).await?;
        self.firmware = firmware_name(&answer.lines);
        self.advice.clear();
        for setting in SETTINGS {
            let Some(reply) = self.connection.command(setting, TAKEN_WITHIN).await?.unknown else {
                continue;
            };
            tracing::debug!(device = %self.connection.line.wire.device(), "firmware does not know {setting}: {reply}");
            if setting == KEEP_MOTORS_ON {
                self.advice.push(Advice {
                    problem: "the motors switch off when idle, and the firmware does not know `M84 S0`".to_owned(),
                    remedy: "build the firmware so that the motors stay on: an axis that sags during a pause loses its position",
                });
            }
        }
        Ok(())
    }

    /// Waits until the robot stands still and asks where.
    async fn arrive(&mut self, within: Duration) -> Result<RobotPosition, RigError> {
        self.connection.required(FINISH_MOVES, within).await?;
        let position = self.connection.position(within).await?;
        self.at = Some(position);
        Ok(position)
    }

    fn longest_for(&self, target: RobotPosition, feed: Feed) -> Duration {
        MOVE_SLACK.longest(self.at.map(|at| at.distance_m(target) / feed.m_s()))
    }
}

#[async_trait]
impl<L: ByteLink> Motion for Marlin<L> {
    fn device(&self) -> &Device {
        self.connection.line.wire.device()
    }

    fn firmware(&self) -> &str {
        &self.firmware
    }

    fn advice(&self) -> &[Advice] {
        &self.advice
    }

    async fn home(&mut self) -> Result<RobotPosition, RigError> {
        self.at = None;
        if !self.connection.in_step() {
            self.set_up().await?;
        }
        self.connection.line.wire.attempting("homing");
        for line in self.home.clone() {
            self.connection.required(line.as_str(), self.home_within).await?;
        }
        self.arrive(self.home_within).await
    }

    async fn move_to(
        &mut self,
        target: RobotPosition,
        feed: Feed,
    ) -> Result<RobotPosition, RigError> {
        self.connection.line.wire.attempting(format!("moving to {target}"));
        let within = self.longest_for(target, feed);
        self.at = None;
        self.connection.required(&straight_to(target, feed), TAKEN_WITHIN).await?;
        self.arrive(within).await
    }

    async fn position(&mut self) -> Result<RobotPosition, RigError> {
        self.connection.line.wire.attempting("reading the position");
        self.connection.position(TAKEN_WITHIN).await
    }

    async fn stop(&mut self) -> Result<(), RigError> {
        self.at = None;
        self.connection.line.wire.attempting("stopping");
        self.connection.quick_stop(STOPPED_WITHIN).await
    }

    fn emergency(&self) -> Option<Emergency> {
        self.connection.line.wire.emergency(STOP)
    }
}

impl<L: ByteLink> Drop for Marlin<L> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.connection.line.wire.send_without_waiting(STOP);
        }
    }
}

/// The name in `FIRMWARE_NAME:Marlin 2.1.2.1 (…) SOURCE_CODE_URL:… …`, or the first line of the answer.
fn firmware_name(lines: &[String]) -> String {
    let Some(named) = lines.iter().find_map(|line| line.strip_prefix("FIRMWARE_NAME:")) else {
        return lines.first().cloned().unwrap_or_else(|| "unnamed firmware".to_owned());
    };
    let is_next_key = |word: &&str| {
        word.split_once(':').is_some_and(|(key, _)| {
            !key.is_empty() && key.chars().all(|c| c.is_ascii_uppercase() || c == '_')
        })
    };
    let words: Vec<&str> = named.split(' ').take_while(|word| !is_next_key(word)).collect();
    words.join(" ")
}

#[cfg(test)]
mod name_tests {
    use super::firmware_name;

    #[test]
    fn the_name_ends_where_the_next_key_begins() {
        let line = "FIRMWARE_NAME:Marlin 2.1.2.1 (May 1 2023 12:00:00) SOURCE_CODE_URL:x PROTOCOL_VERSION:1.0";
        assert_eq!(firmware_name(&[line.to_owned()]), "Marlin 2.1.2.1 (May 1 2023 12:00:00)");
        assert_eq!(firmware_name(&[]), "unnamed firmware");
    }
}
