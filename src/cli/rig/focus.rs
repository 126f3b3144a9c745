//! `fieldgap rig focus`, `silence`: drive the array by hand.

use std::process::ExitCode;
use std::slice;
use std::time::Duration;

use clap::Args;
use miette::miette;

use super::RigArg;
use super::hands_on::{A_TASK, Ended, UNTIL_STOPPED, hands_on};
use crate::cli::exposure::Foreseen;
use crate::cli::output::print;
use crate::cli::permission::{Act, Permission};
use crate::cli::simulate::{millimetres, positive};
use crate::cli::sounding::Sounds;
use crate::rig_file::RigFile;
use fieldgap_acoustics::{Excitation, Vec3};
use fieldgap_acquisition::element_delays;
use fieldgap_input::Positive;
use fieldgap_rig::DeviceSelection;

const ARRAY: DeviceSelection = DeviceSelection { array: true, robot: false, receiver: false };

/// The `rig focus` command.
#[derive(Debug, Args)]
pub(super) struct Focus {
    #[command(flatten)]
    file: RigArg,
    /// Focus in the array frame, mm
    #[arg(long, value_name = "X,Y,Z", value_parser = millimetres, allow_hyphen_values = true)]
    at_mm: Vec3,
    /// Emit a continuous wave, for a receiver [default: modulated as in the rig file, for touch]
    #[arg(long)]
    continuous: bool,
    /// Duration [default: until Ctrl-C]
    #[arg(long, value_name = "S", value_parser = positive)]
    seconds: Option<Positive>,
    #[command(flatten)]
    permission: Permission,
}

/// The `rig silence` command.
#[derive(Debug, Args)]
pub(super) struct Silence {
    #[command(flatten)]
    file: RigArg,
}

impl Focus {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let rig_file = RigFile::read(&self.file.rig)?.on_wall_clock();
        let rig_setup = &rig_file.setup;
        let focus = above_the_array(self.at_mm)?;
        let seconds = self.seconds.map(Positive::get);
        let foreseen = Foreseen::of_drives(rig_setup, slice::from_ref(&focus), seconds)?;
        self.permission.within_limits(foreseen.as_ref(), rig_setup)?;
        self.permission.to(Act::Emit, rig_setup)?;
        hands_on(&rig_file, ARRAY, UNTIL_STOPPED, async |rig| {
            if self.continuous {
                rig.array().continuous_wave().await?;
            }
            rig.array().set_delays(&element_delays(rig_setup, &focus)).await?;
            let _sounds = Sounds::begin(rig_setup, "rig focus");
            rig.array().emit().await?;
            let [x, y, z]: [f64; 3] = self.at_mm.into();
            let how = if self.continuous { "continuous wave" } else { "modulated" };
            let until = match self.seconds {
                Some(seconds) => format!("for {} s", seconds.get()),
                None => "until Ctrl-C".to_owned(),
            };
            print(&format!("focus at ({x}, {y}, {z}) mm, {how}, {until}\n"))?;
            match self.seconds {
                Some(seconds) => {
                    let length = Duration::try_from_secs_f64(seconds.get());
                    tokio::time::sleep(length.unwrap_or(Duration::MAX)).await;
                }
                None => std::future::pending().await,
            }
            Ok(Ended::Enough)
        })
    }
}

/// A focus at a point in the array frame, mm.
///
/// # Errors
/// The point does not lie above the array.
pub(super) fn above_the_array(at_mm: Vec3) -> miette::Result<Excitation> {
    if at_mm.z > 0.0 {
        Ok(Excitation::Focus(at_mm * 1e-3))
    } else {
        Err(miette!(
            help = "z is the height above the array face; it must be positive",
            "a focus at z = {} mm does not lie above the array",
            at_mm.z
        ))
    }
}

impl Silence {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let rig_file = RigFile::read(&self.file.rig)?;
        hands_on(&rig_file, ARRAY, A_TASK, async |rig| {
            rig.array().silence().await?;
            print(&format!("the array is silent, confirmed by {}\n", rig.array().device()))?;
            Ok(Ended::Done)
        })
    }
}
