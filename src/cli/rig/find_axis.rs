//! `fieldgap rig find-axis`: find the beam axis with scanned crosses.

use std::process::ExitCode;

use clap::Args;

use super::RigArg;
use super::hands_on::{A_TASK, Ended, hands_on};
use crate::cli::exposure::Foreseen;
use crate::cli::output::{print, print_json, say};
use crate::cli::permission::{Act, Permission};
use crate::cli::simulate::positive;
use crate::cli::sounding::Sounds;
use crate::rig_file::RigFile;
use fieldgap_acquisition::beam_axis::{AxisReport, AxisSearch, find_axis, in_words};
use fieldgap_input::Positive;
use fieldgap_rig::DeviceSelection;

/// The `rig find-axis` command.
#[derive(Debug, Args)]
pub(super) struct FindAxis {
    #[command(flatten)]
    file: RigArg,
    /// Heights of the crosses above the array face, mm
    #[arg(long, value_name = "Z,...", value_delimiter = ',', value_parser = positive, default_value = "60,100,140")]
    heights_mm: Vec<Positive>,
    /// Half width of the search range, mm
    #[arg(long, value_name = "MM", value_parser = positive, default_value = "20")]
    reach_mm: Positive,
    #[command(flatten)]
    permission: Permission,
    /// Print the axis as JSON
    #[arg(long)]
    json: bool,
}

impl FindAxis {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let rig_file = RigFile::read(&self.file.rig)?;
        let rig_setup = &rig_file.setup;
        let mut heights_m: Vec<f64> = self.heights_mm.iter().map(|mm| mm.get() * 1e-3).collect();
        heights_m.sort_by(f64::total_cmp);
        heights_m.dedup();
        let search = AxisSearch { heights_m, reach_m: self.reach_mm.get() * 1e-3 };
        let foreseen = Foreseen::of_drives(rig_setup, &search.drives(), None)?;
        self.permission.within_limits(foreseen.as_ref(), rig_setup)?;
        self.permission.to(Act::Scan, rig_setup)?;
        let all = DeviceSelection { array: true, robot: true, receiver: true };
        hands_on(&rig_file, all, A_TASK, async |rig| {
            rig.robot().home().await?;
            say("homed; searching for the beam");
            let _sounds = Sounds::begin(rig_setup, "rig find-axis");
            let axis = find_axis(rig, rig_setup, &search, |cross| {
                say(format!(
                    "z = {:.1} mm: x {:+.3} mm, y {:+.3} mm",
                    cross.z_m * 1e3,
                    cross.x_m.value * 1e3,
                    cross.y_m.value * 1e3
                ));
            })
            .await?;
            let report = AxisReport::new(axis, rig_setup.rig.motion.frame());
            if self.json {
                print_json(&report)?;
            } else {
                let unit = rig.receiver().identity().unit.clone();
                print(&in_words(&report, &unit))?;
            }
            Ok(Ended::Done)
        })
    }
}
