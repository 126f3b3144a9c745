//! A robot whose calls are told to somebody else as they happen.

use async_trait::async_trait;

use super::Advice;
use crate::device::Device;
use crate::error::RigError;
use crate::space::{Feed, RobotPosition};
use crate::{Emergency, Motion};

/// Follows a robot: what it was told to do, and where it reports to be.
pub trait RobotObserver: Send {
    /// It was told to go straight to `target`.
    fn sets_out(&mut self, target: RobotPosition, feed: Feed);

    /// It reports that it stands there.
    fn stands(&mut self, position: RobotPosition);
}

/// Any robot, with an observer.
pub(crate) struct Observed {
    robot: Box<dyn Motion>,
    observer: Box<dyn RobotObserver>,
}

impl Observed {
    pub(crate) fn new(robot: Box<dyn Motion>, observer: Box<dyn RobotObserver>) -> Self {
        Self { robot, observer }
    }

    /// Tells where it stands, if that is known.
    fn told(&mut self, at: Result<RobotPosition, RigError>) -> Result<RobotPosition, RigError> {
        if let Ok(position) = &at {
            self.observer.stands(*position);
        }
        at
    }
}

#[async_trait]
impl Motion for Observed {
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
        let at = self.robot.home().await;
        self.told(at)
    }

    async fn move_to(
        &mut self,
        target: RobotPosition,
        feed: Feed,
    ) -> Result<RobotPosition, RigError> {
        self.observer.sets_out(target, feed);
        let at = self.robot.move_to(target, feed).await;
        self.told(at)
    }

    async fn position(&mut self) -> Result<RobotPosition, RigError> {
        self.robot.position().await
    }

    async fn confirm_place(&mut self) -> Result<RobotPosition, RigError> {
        let at = self.robot.confirm_place().await;
        self.told(at)
    }

    async fn stop(&mut self) -> Result<(), RigError> {
        self.robot.stop().await?;
        // Where it stopped is for the next homing to find; the report is the best that is known.
        if let Ok(position) = self.robot.position().await {
            self.observer.stands(position);
        }
        Ok(())
    }

    fn emergency(&self) -> Option<Emergency> {
        self.robot.emergency()
    }
}
