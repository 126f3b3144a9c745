//! The robot behind a GRBL firmware.

use std::time::Duration;

use async_trait::async_trait;
use tokio::time::Instant;

use super::advice::advice;
use super::build_info::BuildInfo;
use super::config::{GrblConfig, HomingCommand};
use super::connection::{
    BETWEEN_QUERIES, Connection, LineOutcome, SHORTEST_HOMING, SHORTEST_HOMING_AGAIN, homing_is_off,
};
use super::error_code;
use super::line::{Line, SOFT_RESET, SYNC};
use super::settings::{Settings, SettingsReadings};
use super::status::State;
use crate::device::Device;
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire};
use crate::motion::Advice;
use crate::motion::limits::{STOPPED_WITHIN, Slack};
use crate::space::{Feed, RobotPosition};
use crate::travel::Envelope;
use crate::{Emergency, Motion};

/// Beyond what the firmware's settings make a move take.
const MOVE_SLACK: Slack = Slack { factor: 2.0, extra: Duration::from_secs(10) };

/// How often a move that was not executed is sent again.
const MOST_REPEATS: u32 = 8;

/// Readings of the settings until each was read twice alike: a damaged digit would be taken for a travel or a resolution.
const MOST_READINGS: u32 = 12;

/// How the firmware says that a line would have left its travel: it refuses such a line before any step.
const SOFT_LIMIT: &str = "ALARM:2";

/// So many refusals of one move by the soft limits, and its target is out of the travel: no digit was damaged so often.
const MOST_REFUSALS: u32 = 3;

/// So many reports of a standstill elsewhere, and that is where the robot stands.
const ELSEWHERE_REPORTS: u32 = 3;

/// A robot behind a GRBL firmware, 1.1 or grblHAL.
///
/// It moves as commanded: homing, travel and keep-out boxes are checked by
/// [`Guarded`](crate::motion::guarded::Guarded), through which alone a rig gives access to it.
#[derive(Debug)]
pub struct Grbl<L> {
    connection: Connection<L>,
    firmware: String,
    settings: Settings,
    advice: Vec<Advice>,
    home: Vec<HomingCommand>,
    home_within: Duration,
    hold_motors: bool,
    envelope: Envelope,
    feed: Feed,
    at: Option<RobotPosition>,
    /// Whether nothing was commanded since the session was set up, so that homing may begin at once.
    fresh: bool,
}

impl GrblConfig {
    pub(crate) async fn open(
        &self,
        envelope: Envelope,
        feed: Feed,
        port: Option<&str>,
    ) -> Result<Box<dyn Motion>, RigError> {
        let wire = self.firmware.open_port(port)?;
        Ok(Box::new(Grbl::begin(wire, self, envelope, feed).await?))
    }
}

impl<L: ByteLink> Grbl<L> {
    /// Begins a session with the firmware at the other end of `wire`. What moves is stopped.
    ///
    /// `envelope` is compared with the firmware's own soft limits, `feed` with its speeds.
    ///
    /// # Errors
    /// That nothing answers, or not as GRBL does, or that its soft limits are narrower than `envelope`.
    pub async fn begin(
        wire: Wire<L>,
        config: &GrblConfig,
        envelope: Envelope,
        feed: Feed,
    ) -> Result<Self, RigError> {
        let mut robot = Self {
            connection: Connection::new(wire),
            firmware: String::new(),
            settings: Settings::default(),
            advice: Vec::new(),
            home: config.firmware.home.clone(),
            home_within: config.firmware.home_within(),
            hold_motors: config.hold_motors,
            envelope,
            feed,
            at: None,
            fresh: false,
        };
        robot.set_up().await?;
        Ok(robot)
    }

    async fn set_up(&mut self) -> Result<(), RigError> {
        self.connection.wire.attempting("opening a session with the firmware");
        self.connection.begin().await?;
        match self.connection.state().await? {
            State::Idle | State::Alarm => {}
            state => return Err(self.connection.paused(state)),
        }
        let is_build = |answer: &[String]| answer.iter().any(|line| line.starts_with("[OPT:"));
        let build = BuildInfo::from_lines(&self.connection.ask("$I", is_build).await?);
        if let Some(bytes) = build.receive_buffer {
            self.connection.set_receive_buffer(bytes);
        }
        self.read_settings(build).await?;
        if self.hold_motors
            && let Some(idle_ms) = self.settings.motors_release_after_ms()
        {
            self.hold_motors(idle_ms, build).await?;
        }
        self.firmware = self.connection.name().to_owned();
        self.advice = advice(&self.settings, self.feed);
        for Advice { problem, .. } in &self.advice {
            tracing::debug!(device = %self.connection.wire.device(), "{problem}");
        }
        self.settings
            .check_travel(&self.envelope)
            .map_err(|cause| self.connection.wire.error(cause))?;
        self.fresh = true;
        Ok(())
    }

    /// Reads the settings until each was read twice alike.
    async fn read_settings(&mut self, build: BuildInfo) -> Result<(), RigError> {
        let flavour = self.connection.flavour();
        let mut readings = SettingsReadings::default();
        for _ in 0..MOST_READINGS {
            readings.add(&self.connection.ask("$$", |_| true).await?);
            if let Some(settings) = readings.settings(build, flavour) {
                self.connection.set_reports_inches(settings.reports_inches());
                self.settings = settings;
                return Ok(());
            }
        }
        Err(self.connection.wire.error(Cause::RepeatedlyDamaged { times: MOST_READINGS }))
    }

    /// Keeps the motors on. A damaged line may have written another setting, so all are read again.
    async fn hold_motors(&mut self, idle_ms: f64, build: BuildInfo) -> Result<(), RigError> {
        let before = self.settings.clone();
        for _ in 0..MOST_REPEATS {
            self.connection.ask("$1=255", |_| true).await?;
            self.read_settings(build).await?;
            if let Some(cause) = self.settings.changed_beside_the_motors(&before) {
                return Err(self.connection.wire.error(cause));
            }
            if self.settings.motors_release_after_ms().is_none() {
                tracing::warn!(device = %self.connection.wire.device(), "the motors switched off {idle_ms} ms after each move; `$1=255` was set, so that they hold");
                return Ok(());
            }
        }
        Err(self.connection.wire.error(Cause::RepeatedlyDamaged { times: MOST_REPEATS }))
    }

    /// Homes by one command, and takes it for done where that shows.
    ///
    /// A machine that was never homed may be idle as well, so that neither that nor a stray `ok` is enough: the
    /// machine must have taken its time, or have come to the place where homing ends. One that stood there before may have been
    /// moved by hand or by its weight while its motors were off.
    async fn home_by(&mut self, command: &str, within: Duration) -> Result<(), RigError> {
        let stood_there = self.stands_where_homing_ends(command, within).await?;
        let mut shortest = SHORTEST_HOMING;
        if stood_there {
            // No `ok` to an earlier line comes behind a reset.
            self.connection.begin().await?;
            shortest = SHORTEST_HOMING_AGAIN;
        }
        for _ in 0..MOST_REPEATS {
            let took_its_time = self.connection.home(command, shortest, within).await?;
            if took_its_time
                || !stood_there && self.stands_where_homing_ends(command, within).await?
            {
                return Ok(());
            }
            // What is left of a damaged command goes with it.
            self.connection.begin().await?;
        }
        Err(self.connection.wire.error(Cause::RepeatedlyDamaged { times: MOST_REPEATS }))
    }

    async fn stands_where_homing_ends(
        &mut self,
        command: &str,
        within: Duration,
    ) -> Result<bool, RigError> {
        let seen = self.connection.status_after_homing(within).await?;
        let axes = match command {
            "$HX" => 0..1,
            "$HY" => 1..2,
            "$HZ" => 2..3,
            _ => 0..3,
        };
        let (at_mm, home_mm) = (seen.at.axes_mm(), self.settings.home_mm());
        let tolerance_mm = 2.0 * self.settings.resolution_mm();
        Ok(seen.state == State::Idle
            && axes.into_iter().all(|axis| (at_mm[axis] - home_mm[axis]).abs() <= tolerance_mm))
    }

    /// Sends a move and its end once; returns where the machine then stands.
    async fn try_move(
        &mut self,
        lines: &[Line],
        target: RobotPosition,
        expected: Option<Duration>,
    ) -> Result<RobotPosition, RigError> {
        let within = MOVE_SLACK.longest(expected.map(|expected| expected.as_secs_f64()));
        let deadline = Instant::now() + within;
        match self.connection.run(lines, expected.unwrap_or_default(), within).await? {
            LineOutcome::Taken => {}
            LineOutcome::Unanswered => self.connection.begin().await?,
            // Locked it is not: the connection has asked.
            LineOutcome::Refused(code)
                if code == error_code::LOCKED || error_code::may_be_damage(code) =>
            {
                self.connection.clear_error().await?;
            }
            LineOutcome::Refused(code) => return Err(self.connection.refused(code)),
        }
        self.stand_still(target, deadline).await
    }

    /// Goes on behind an error that a damaged line can cause without a step: a digit that became a reset, or a target out of
    /// the firmware's travel. The machine must report that it still stands at `start`.
    ///
    /// # Errors
    /// `error`, where something may have moved or the position may be lost.
    async fn resume_at(
        &mut self,
        start: Option<RobotPosition>,
        error: RigError,
    ) -> Result<(), RigError> {
        let locked = matches!(error.cause(), Cause::Alarm { reply, .. } if reply == SOFT_LIMIT);
        if !locked && !matches!(error.cause(), Cause::Reset) {
            return Err(error);
        }
        // A board whose power was off reports zero, and is locked or takes zero for its place.
        let power_up = RobotPosition::from_axes_mm([0.0; 3]);
        let Some(start) = start.filter(|&start| !self.is_at(start, power_up)) else {
            return Err(error);
        };
        self.connection.begin().await?;
        let expected = if locked { State::Alarm } else { State::Idle };
        for _ in 0..ELSEWHERE_REPORTS {
            let seen = self.connection.status().await?;
            if seen.state != expected {
                break;
            }
            if self.is_at(seen.at, start) {
                if locked {
                    self.connection.unlock().await?;
                    let unlocked = self.connection.status().await?;
                    if !self.is_at(unlocked.at, start) {
                        break;
                    }
                    if unlocked.state != State::Idle {
                        continue;
                    }
                }
                tracing::warn!(device = %self.connection.wire.device(), "{error}; the robot still stands at {start}, and the move is sent again");
                return Ok(());
            }
        }
        Err(error)
    }

    /// Waits until the machine stands still and returns its position: at `target` by two reports, or elsewhere by several.
    ///
    /// Called after the dwell was answered. The report is asked for behind it, so it is of the time after the move. It has no
    /// checksum: one inverted bit in the line that moves and the same in one report would show the target.
    async fn stand_still(
        &mut self,
        target: RobotPosition,
        deadline: Instant,
    ) -> Result<RobotPosition, RigError> {
        let (mut elsewhere, mut before) = (0, None);
        let mut seen = self.connection.status_at_rest().await?;
        loop {
            let as_before = before.is_some_and(|before| self.is_at(seen.at, before));
            let at_target = self.is_at(seen.at, target);
            match seen.state {
                State::Idle if as_before && (at_target || elsewhere > ELSEWHERE_REPORTS) => {
                    return Ok(seen.at);
                }
                State::Idle => {
                    before = Some(seen.at);
                    elsewhere += u32::from(!at_target);
                }
                State::Run | State::Jog | State::Home => (elsewhere, before) = (0, None),
                State::Alarm => return Err(self.connection.alarm_state()),
                state => return Err(self.connection.paused(state)),
            }
            if Instant::now() >= deadline && seen.state != State::Idle {
                return Err(self.connection.wire.error(Cause::StillMoving));
            }
            seen = if seen.state == State::Idle && at_target {
                self.connection.status_at_rest().await?
            } else {
                self.connection.status().await?
            };
        }
    }

    fn is_at(&self, at: RobotPosition, target: RobotPosition) -> bool {
        at.is_within(self.settings.resolution_mm() * 1e-3, target)
    }

    /// Whether a place is on the straight path from `start` to `target`, ends included.
    fn is_between(&self, at: RobotPosition, start: RobotPosition, target: RobotPosition) -> bool {
        let detour_m = start.distance_m(at) + at.distance_m(target) - start.distance_m(target);
        detour_m <= self.settings.resolution_mm() * 1e-3
    }

    /// Whether a move that ended at another place than its target may be sent again.
    ///
    /// Where it was not executed, or ended in its middle as where the firmware's steps ran out, what is left is on the way that
    /// was found free. Where a damaged digit has sent the machine elsewhere, the way there must have been free, and the way
    /// from there to the target.
    fn may_go_on(
        &self,
        at: RobotPosition,
        start: Option<RobotPosition>,
        target: RobotPosition,
    ) -> bool {
        let Some(start) = start else { return false };
        if self.is_between(at, start, target) {
            return true;
        }
        let free = self.envelope.check_path(start, at).is_ok()
            && self.envelope.check_path(at, target).is_ok();
        if free {
            tracing::warn!(device = %self.connection.wire.device(), "the robot went to {at} instead of {target}: a line was damaged on its way, and GRBL's lines have no checksum. The way was free, and the move is sent again");
        }
        free
    }

    /// The distance over the slowest speed, and the time to reach it and to stop, if they are known.
    fn expected_for(&self, target: RobotPosition, feed: Feed) -> Option<Duration> {
        let mm_s = self.settings.slowest_axis_mm_s()?.min(feed.m_s() * 1e3);
        let length_mm = self.at?.distance_m(target) * 1e3;
        let ramps_s = 2.0 * mm_s / self.settings.least_acceleration_mm_s2()?;
        Duration::try_from_secs_f64(length_mm / mm_s + ramps_s).ok()
    }
}

#[async_trait]
impl<L: ByteLink> Motion for Grbl<L> {
    fn device(&self) -> &Device {
        self.connection.wire.device()
    }

    fn firmware(&self) -> &str {
        &self.firmware
    }

    fn advice(&self) -> &[Advice] {
        &self.advice
    }

    /// Acts at once wherever it stands, and ends any motion; the position is lost.
    fn emergency(&self) -> Option<Emergency> {
        self.connection.wire.emergency(SOFT_RESET)
    }

    async fn home(&mut self) -> Result<RobotPosition, RigError> {
        self.at = None;
        // After whatever happened before: an alarm, a hold, a cancelled move are ended by a reset.
        if !self.fresh {
            self.set_up().await?;
        }
        self.fresh = false;
        self.connection.wire.attempting("homing");
        if !self.settings.homing_enabled() {
            return Err(self.connection.wire.error(homing_is_off()));
        }
        let within =
            self.settings.homing_within().unwrap_or(self.home_within).min(self.home_within);
        for command in self.home.clone() {
            self.home_by(command.as_str(), within).await?;
        }
        let seen = self.connection.status_after_homing(within).await?;
        match seen.state {
            State::Idle => {}
            State::Alarm => return Err(self.connection.alarm_state()),
            state => return Err(self.connection.paused(state)),
        }
        self.at = Some(seen.at);
        Ok(seen.at)
    }

    async fn move_to(
        &mut self,
        target: RobotPosition,
        feed: Feed,
    ) -> Result<RobotPosition, RigError> {
        self.connection.wire.attempting(format!("moving to {target}"));
        let expected = self.expected_for(target, feed);
        let mut start = self.at.take();
        let lines = [Line::straight_to(target, feed), Line::new(SYNC)]
            .into_iter()
            .collect::<Result<Vec<_>, _>>()
            .map_err(|cause| self.connection.wire.error(cause))?;
        let mut refusals = 0;
        for _ in 0..MOST_REPEATS {
            let at = match self.try_move(&lines, target, expected).await {
                Ok(at) => at,
                Err(error) => {
                    refusals += u32::from(matches!(error.cause(), Cause::Alarm { .. }));
                    if refusals == MOST_REFUSALS {
                        return Err(error);
                    }
                    self.resume_at(start, error).await?;
                    continue;
                }
            };
            if self.is_at(at, target) || !self.may_go_on(at, start, target) {
                self.at = Some(at);
                return Ok(at);
            }
            start = Some(at);
        }
        Err(self.connection.wire.error(Cause::RepeatedlyDamaged { times: MOST_REPEATS }))
    }

    async fn position(&mut self) -> Result<RobotPosition, RigError> {
        self.connection.wire.attempting("reading the position");
        Ok(self.connection.status().await?.at)
    }

    fn query_pause(&self) -> Duration {
        BETWEEN_QUERIES
    }

    async fn stop(&mut self) -> Result<(), RigError> {
        self.at = None;
        self.fresh = false;
        self.connection.wire.attempting("stopping");
        self.connection.stop(STOPPED_WITHIN).await
    }
}
