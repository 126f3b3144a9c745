//! `fieldgap rig`: check and operate a rig by hand.

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
    /// Test each device, measure latency and noise, and suggest remedies; nothing moves
    Check(check::Check),
    /// Home the robot to its end switches
    Home(motion::Home),
    /// Print the robot's position; nothing moves
    Where(motion::Where),
    /// Move the robot to a position
    Go(motion::Go),
    /// Move the robot with the keyboard, with a live level
    Jog(jog::Jog),
    /// Focus the array on a point until stopped
    Focus(focus::Focus),
    /// Silence the array
    Silence(focus::Silence),
    /// Show the receiver's level live
    Sample(sample::SampleLevel),
    /// Find the beam axis with scanned crosses, and print the origin for the rig file
    FindAxis(find_axis::FindAxis),
    /// Silence the array and stop the robot, even if another fieldgap process uses them
    Stop(stop::Stop),
}

/// The rig file argument of all subcommands.
#[derive(Debug, Args)]
struct RigArg {
    /// Rig file
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
