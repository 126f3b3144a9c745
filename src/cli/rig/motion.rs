//! `fieldgap rig home`, `where`, `go`: move the robot by hand.

use std::process::ExitCode;

use clap::Args;
use miette::miette;
use serde_json::json;

use super::RigArg;
use super::hands_on::{A_TASK, Ended, hands_on};
use crate::cli::output::{print, print_json};
use crate::cli::permission::{Act, Permission};
use crate::cli::simulate::{millimetres, positive};
use crate::rig_file::RigFile;
use fieldgap_acoustics::Vec3;
use fieldgap_acquisition::RigSetup;
use fieldgap_input::Positive;
use fieldgap_rig::motion::route::route;
use fieldgap_rig::{DeviceSelection, Feed, Frame, PathFault, RobotPosition};

const ROBOT: DeviceSelection = DeviceSelection { robot: true, array: false, receiver: false };

/// The `rig home` command.
#[derive(Debug, Args)]
pub(super) struct Home {
    #[command(flatten)]
    file: RigArg,
    #[command(flatten)]
    permission: Permission,
    /// Print the final position as JSON
    #[arg(long)]
    json: bool,
}

/// The `rig where` command.
#[derive(Debug, Args)]
pub(super) struct Where {
    #[command(flatten)]
    file: RigArg,
    /// Print the position as JSON
    #[arg(long)]
    json: bool,
}

/// The `rig go` command.
#[derive(Debug, Args)]
pub(super) struct Go {
    #[command(flatten)]
    file: RigArg,
    /// Target in the array frame, mm
    #[arg(long, value_name = "X,Y,Z", value_parser = millimetres, allow_hyphen_values = true)]
    to_mm: Vec3,
    /// The target is given in the robot's axes
    #[arg(long)]
    robot_axes: bool,
    /// Speed, mm/s [default: as in the rig file]
    #[arg(long, value_name = "MM/S", value_parser = positive)]
    feed_mm_s: Option<Positive>,
    #[command(flatten)]
    permission: Permission,
    /// Print the final position as JSON
    #[arg(long)]
    json: bool,
}

impl Home {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let rig_file = RigFile::read(&self.file.rig)?;
        let rig_setup = &rig_file.setup;
        self.permission.to(Act::Move, rig_setup)?;
        hands_on(&rig_file, ROBOT, A_TASK, async |rig| {
            let at = rig.robot().home().await?;
            print_position(rig_setup, at, true, self.json)?;
            Ok(Ended::Done)
        })
    }
}

impl Where {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let rig_file = RigFile::read(&self.file.rig)?;
        let rig_setup = &rig_file.setup;
        hands_on(&rig_file, ROBOT, A_TASK, async |rig| {
            let at = rig.robot().position().await?;
            print_position(rig_setup, at, false, self.json)?;
            Ok(Ended::Done)
        })
    }
}

impl Go {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let rig_file = RigFile::read(&self.file.rig)?;
        let rig_setup = &rig_file.setup;
        let motion = &rig_setup.rig.motion;
        let target = match self.robot_axes {
            true => RobotPosition::from_axes_mm(self.to_mm.into()),
            false => motion.frame().to_robot(self.to_mm * 1e-3),
        };
        let envelope = motion.envelope();
        envelope.check_target(target).map_err(not_allowed)?;
        self.permission.to(Act::Move, rig_setup)?;
        let feed = self.feed_mm_s.map_or(motion.feed(), Feed::from_mm_s);
        hands_on(&rig_file, ROBOT, A_TASK, async |rig| {
            let mut at = rig.robot().home().await?;
            for place in route(&envelope, at, target).map_err(not_allowed)? {
                at = rig.robot().move_to(place, feed).await?;
            }
            print_position(rig_setup, at, true, self.json)?;
            Ok(Ended::Done)
        })
    }
}

fn not_allowed(fault: PathFault) -> miette::Report {
    miette!(
        help = "the limits are `travel_mm` and `[[motion.keep_out]]` in the rig file",
        "{fault}"
    )
}

/// Prints the robot's position in both frames.
fn print_position(
    rig_setup: &RigSetup,
    at: RobotPosition,
    homed: bool,
    as_json: bool,
) -> miette::Result<()> {
    let frame = rig_setup.rig.motion.frame();
    let robot_mm = at.axes_mm();
    let array_mm: [f64; 3] = (frame.to_array(at) * 1e3).into();
    if as_json {
        return print_json(&json!({ "robot_mm": robot_mm, "array_mm": array_mm, "homed": homed }));
    }
    let doubt = if homed {
        ""
    } else {
        "opening the port made homing necessary; until then this position may be wrong\n"
    };
    print(&format!("{}\n{doubt}", in_both_frames(at, &frame)))
}

/// A position in the robot's axes and in the array frame.
pub(super) fn in_both_frames(at: RobotPosition, frame: &Frame) -> String {
    let [x, y, z]: [f64; 3] = (frame.to_array(at) * 1e3).into();
    format!("robot axes {at}, array frame ({x:.2}, {y:.2}, {z:.2}) mm")
}
