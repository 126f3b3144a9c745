//! A robot that refuses what it must not do.

use std::time::Duration;

use async_trait::async_trait;

use super::Advice;
use crate::device::Device;
use crate::error::{Cause, RigError};
use crate::space::{Feed, RobotPosition};
use crate::travel::Envelope;
use crate::{Emergency, Motion};

/// Two reports of one place differ by less, m: the finest resolution of a report is coarser.
const SAME_PLACE_M: f64 = 1e-6;

/// Reports asked for until two in a row agree. One of them is damaged only where the line is noisy.
const MOST_REPORTS: u32 = 6;

/// Any robot, held to homing, travel, keep-out boxes and to arriving where it was sent.
///
/// A rig gives access to its robot through this alone, so that no driver can forget a check. A failed or cancelled
/// move leaves the position unknown, and nothing moves again before homing.
pub struct Guarded {
    robot: Box<dyn Motion>,
    envelope: Envelope,
    tolerance_m: f64,
    at: Option<RobotPosition>,
}

impl Guarded {
    /// Guards `robot`: it stays within `envelope` and arrives within `tolerance_m` along each axis.
    pub fn new(robot: Box<dyn Motion>, envelope: Envelope, tolerance_m: f64) -> Self {
        Self { robot, envelope, tolerance_m, at: None }
    }

    /// Where the robot stands, given one report that may be damaged: what two reports in a row say, or one that `is_expected`.
    async fn confirmed(
        &mut self,
        first: RobotPosition,
        attempt: String,
        is_expected: impl Fn(RobotPosition) -> bool + Send,
    ) -> Result<RobotPosition, RigError> {
        let mut before = first;
        for _ in 1..MOST_REPORTS {
            let reported = self.robot.position().await?;
            if is_expected(reported) || reported.is_within(SAME_PLACE_M, before) {
                return Ok(reported);
            }
            before = reported;
        }
        Err(self.error(attempt, Cause::RepeatedlyDamaged { times: MOST_REPORTS }))
    }

    /// Checks that the robot stands where it should; where it reported that it stands.
    async fn stands(
        &mut self,
        expected: RobotPosition,
        mut reported: RobotPosition,
        attempt: String,
    ) -> Result<RobotPosition, RigError> {
        let tolerance_m = self.tolerance_m;
        let has_arrived = |reported: RobotPosition| reported.is_within(tolerance_m, expected);
        if !has_arrived(reported) {
            // A digit may have been damaged on its way; a robot at another position reports it twice.
            reported = self.confirmed(reported, attempt.clone(), has_arrived).await?;
        }
        if !has_arrived(reported) {
            let cause = Cause::WrongPosition { commanded: expected, reported, tolerance_m };
            return Err(self.error(attempt, cause));
        }
        self.at = Some(reported);
        Ok(reported)
    }

    fn error(&self, attempt: String, cause: Cause) -> RigError {
        RigError::new(self.robot.device().clone(), attempt, cause, None)
    }
}

#[async_trait]
impl Motion for Guarded {
    fn device(&self) -> &Device {
        self.robot.device()
    }

    fn firmware(&self) -> &str {
        self.robot.firmware()
    }

    fn advice(&self) -> &[Advice] {
        self.robot.advice()
    }

    async fn home(&mut self) -> Result<RobotPosition, RigError> {
        self.at = None;
        let reported = self.robot.home().await?;
        // The paths of all moves begin here, so one report is not enough.
        let position = self.confirmed(reported, "homing".to_owned(), |_| false).await?;
        self.at = Some(position);
        Ok(position)
    }

    async fn move_to(
        &mut self,
        target: RobotPosition,
        feed: Feed,
    ) -> Result<RobotPosition, RigError> {
        let attempt = || format!("moving to {target}");
        let from = self.at.ok_or_else(|| self.error(attempt(), Cause::NotHomed))?;
        self.envelope
            .check_path(from, target)
            .map_err(|fault| self.error(attempt(), Cause::Forbidden(fault)))?;
        self.at = None;
        let reported = self.robot.move_to(target, feed).await?;
        self.stands(target, reported, attempt()).await
    }

    async fn confirm_place(&mut self) -> Result<RobotPosition, RigError> {
        let attempt = || "confirming its place".to_owned();
        let expected = self.at.take().ok_or_else(|| self.error(attempt(), Cause::NotHomed))?;
        let reported = self.robot.position().await?;
        self.stands(expected, reported, attempt()).await
    }

    async fn position(&mut self) -> Result<RobotPosition, RigError> {
        self.robot.position().await
    }

    fn query_pause(&self) -> Duration {
        self.robot.query_pause()
    }

    async fn stop(&mut self) -> Result<(), RigError> {
        self.at = None;
        self.robot.stop().await
    }

    fn emergency(&self) -> Option<Emergency> {
        self.robot.emergency()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::device::Role;
    use crate::travel::{AxisBox, KeepOut};
    use fieldgap_input::Positive;

    /// A robot that goes where it is sent, reports `misreports` first, and records every move.
    struct Notebook {
        device: Device,
        at: RobotPosition,
        moves: Arc<Mutex<Vec<RobotPosition>>>,
        misreports: VecDeque<RobotPosition>,
    }

    #[async_trait]
    impl Motion for Notebook {
        fn device(&self) -> &Device {
            &self.device
        }
        fn firmware(&self) -> &str {
            "notebook"
        }
        async fn home(&mut self) -> Result<RobotPosition, RigError> {
            self.at = mm(0.0, 0.0, 0.0);
            Ok(self.at)
        }
        async fn move_to(
            &mut self,
            target: RobotPosition,
            _: Feed,
        ) -> Result<RobotPosition, RigError> {
            self.moves.lock().expect("not poisoned").push(target);
            self.at = target;
            self.position().await
        }
        async fn position(&mut self) -> Result<RobotPosition, RigError> {
            Ok(self.misreports.pop_front().unwrap_or(self.at))
        }
        async fn stop(&mut self) -> Result<(), RigError> {
            Ok(())
        }
        fn emergency(&self) -> Option<Emergency> {
            None
        }
    }

    fn mm(x: f64, y: f64, z: f64) -> RobotPosition {
        RobotPosition::from_axes_mm([x, y, z])
    }

    fn feed() -> Feed {
        Feed::from_mm_s(Positive::new(80.0).expect("positive"))
    }

    fn guarded(misreports: &[RobotPosition]) -> (Guarded, Arc<Mutex<Vec<RobotPosition>>>) {
        let moves = Arc::default();
        let robot = Notebook {
            device: Device::new(Role::Robot, "memory"),
            at: mm(0.0, 0.0, 0.0),
            moves: Arc::clone(&moves),
            misreports: misreports.iter().copied().collect(),
        };
        let envelope = Envelope {
            travel: AxisBox { least_m: [0.0; 3], largest_m: [0.3; 3] },
            keep_out: vec![KeepOut {
                name: "array".into(),
                space: AxisBox { least_m: [0.1, 0.1, 0.0], largest_m: [0.2, 0.2, 0.1] },
            }],
        };
        (Guarded::new(Box::new(robot), envelope, 0.05e-3), moves)
    }

    #[tokio::test]
    async fn nothing_moves_before_homing_nor_after_a_stop() {
        let (mut robot, moves) = guarded(&[]);
        let refused = robot.move_to(mm(10.0, 0.0, 0.0), feed()).await.expect_err("not homed");
        assert!(matches!(refused.cause(), Cause::NotHomed));
        robot.home().await.expect("homes");
        robot.move_to(mm(10.0, 0.0, 0.0), feed()).await.expect("moves");
        robot.stop().await.expect("stops");
        assert!(robot.move_to(mm(20.0, 0.0, 0.0), feed()).await.is_err());
        assert_eq!(moves.lock().expect("not poisoned").len(), 1);
    }

    #[tokio::test]
    async fn a_forbidden_move_is_not_sent_and_the_robot_may_go_on() {
        let (mut robot, moves) = guarded(&[]);
        robot.home().await.expect("homes");
        for forbidden in [mm(301.0, 0.0, 0.0), mm(250.0, 250.0, 50.0), mm(f64::NAN, 0.0, 0.0)] {
            let refused = robot.move_to(forbidden, feed()).await.expect_err("forbidden");
            assert!(matches!(refused.cause(), Cause::Forbidden(_)), "{refused}");
        }
        assert!(moves.lock().expect("not poisoned").is_empty());
        robot.move_to(mm(0.0, 0.0, 200.0), feed()).await.expect("free");
        robot.move_to(mm(250.0, 250.0, 200.0), feed()).await.expect("free, over the box");
    }

    #[tokio::test]
    async fn a_robot_at_another_position_is_detected() {
        let clamped = mm(9.94, 0.0, 0.0);
        let (mut robot, _) = guarded(&[mm(0.0, 0.0, 0.0), clamped, clamped]);
        robot.home().await.expect("homes");
        let error = robot.move_to(mm(10.0, 0.0, 0.0), feed()).await.expect_err("elsewhere");
        assert!(error.to_string().contains("0.060 mm off, where 0.050 mm is allowed"), "{error}");
        let error = robot.move_to(mm(10.0, 0.0, 0.0), feed()).await.expect_err("lost");
        assert!(matches!(error.cause(), Cause::NotHomed));
    }

    #[tokio::test]
    async fn a_robot_that_was_moved_since_does_not_confirm_its_place() {
        let moved = mm(10.0, 3.0, 0.0);
        let (mut robot, _) = guarded(&[]);
        assert!(matches!(
            robot.confirm_place().await.expect_err("not homed").cause(),
            Cause::NotHomed
        ));
        robot.home().await.expect("homes");
        robot.move_to(mm(10.0, 0.0, 0.0), feed()).await.expect("arrives");
        assert_eq!(robot.confirm_place().await.expect("it stands"), mm(10.0, 0.0, 0.0));
        let (mut robot, _) =
            guarded(&[mm(0.0, 0.0, 0.0), mm(0.0, 0.0, 0.0), mm(10.0, 0.0, 0.0), moved, moved]);
        robot.home().await.expect("homes");
        robot.move_to(mm(10.0, 0.0, 0.0), feed()).await.expect("arrives");
        let error = robot.confirm_place().await.expect_err("elsewhere");
        assert!(matches!(error.cause(), Cause::WrongPosition { .. }), "{error}");
        let error = robot.move_to(mm(10.0, 0.0, 0.0), feed()).await.expect_err("lost");
        assert!(matches!(error.cause(), Cause::NotHomed));
    }

    #[tokio::test]
    async fn damaged_reports_are_asked_for_again() {
        let damaged =
            [mm(0.0, 0.0, 0.0), mm(100.0, 0.0, 0.0), mm(18.0, 0.0, 0.0), mm(10.0, 4.0, 0.0)];
        let (mut robot, _) = guarded(&damaged);
        robot.home().await.expect("homes");
        let reported = robot.move_to(mm(10.0, 0.0, 0.0), feed()).await.expect("arrives");
        assert_eq!(reported, mm(10.0, 0.0, 0.0));
    }

    #[tokio::test]
    async fn the_place_after_homing_is_what_two_reports_say() {
        let (mut robot, _) = guarded(&[mm(40.0, 0.0, 0.0), mm(0.0, 8.0, 0.0)]);
        assert_eq!(robot.home().await.expect("homes"), mm(0.0, 0.0, 0.0));
        let never_alike: Vec<_> = (1..9).map(|x| mm(f64::from(x), 0.0, 0.0)).collect();
        let (mut robot, _) = guarded(&never_alike);
        let error = robot.home().await.expect_err("no two agree");
        assert!(matches!(error.cause(), Cause::RepeatedlyDamaged { .. }), "{error}");
        assert!(robot.move_to(mm(10.0, 0.0, 0.0), feed()).await.is_err(), "the place is not known");
    }
}
