//! `fieldgap rig`: a rig used by hand and looked after.

mod check;
mod find_axis;
mod focus;
mod hands_on;
mod jog;
mod motion;
mod sample;
mod stop;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};

/// The `rig` command.
#[derive(Debug, Args)]
pub(super) struct Rig {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Talk to each device, measure latency and noise, and say what to mend; nothing moves
    Check(check::Check),
    /// Find the robot's origin by its end switches
    Home(motion::Home),
    /// Say where the robot is; nothing moves
    Where(motion::Where),
    /// Go to a place
    Go(motion::Go),
    /// Move the robot by keys, with the level beside
    Jog(jog::Jog),
    /// Let the array focus on a place until it is stopped
    Focus(focus::Focus),
    /// Silence the array
    Silence(focus::Silence),
    /// Show the receiver's level as it is now
    Sample(sample::Sample),
    /// Find the beam's axis by crosses scanned through it, and say what origin to put into the rig file
    FindAxis(find_axis::FindAxis),
    /// Silence the array and stop the robot, also when another fieldgap has them
    Stop(stop::Stop),
}

/// The rig file, the same for all.
#[derive(Debug, Args)]
struct RigArg {
    /// The rig file
    rig: PathBuf,
}

impl Rig {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        match self.task {
            Task::Check(task) => task.run(),
            Task::Home(task) => task.run(),
            Task::Where(task) => task.run(),
            Task::Go(task) => task.run(),
            Task::Jog(task) => task.run(),
            Task::Focus(task) => task.run(),
            Task::Silence(task) => task.run(),
            Task::Sample(task) => task.run(),
            Task::FindAxis(task) => task.run(),
            Task::Stop(task) => task.run(),
        }
    }
}
