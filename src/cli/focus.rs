//! `fieldgap focus`: a display on a rig.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};

use super::output::{print, print_json};
use super::simulate::positive;
use super::stop::StopRequests;
use super::watchdog::guard_array;
use crate::rig_file::RigFile;
use fieldgap_acquisition::RigSetup;
use fieldgap_display::{Composed, DisplayFile, Ended, SoundingArray, compose, play};
use fieldgap_input::Positive;
use fieldgap_rig::{ArrayIdentity, open_array};
use fieldgap_virtual_rig::VirtualRig;

/// The `focus` command.
#[derive(Debug, Args)]
pub(super) struct Focus {
    /// The display file
    display: PathBuf,
    /// The rig file; without it the one that the display names
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// How long it plays; without it as the display says, or until it is stopped
    #[arg(long, value_name = "S", value_parser = positive)]
    seconds: Option<Positive>,
    /// Print what was played as JSON
    #[arg(long)]
    json: bool,
}

impl Focus {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let display = DisplayFile::read(&self.display)?;
        let rig_file =
            RigFile::read(&self.rig.clone().unwrap_or_else(|| display.rig_path()))?.on_wall_clock();
        let rig_setup = &rig_file.setup;
        let firmware = rig_file.open_virtual()?;
        let ports = firmware.as_ref().map(VirtualRig::ports).unwrap_or_default();
        let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
        let seconds = self.seconds.or(display.seconds).map(Positive::get);
        runtime.block_on(async {
            let stop = StopRequests::listen().into_diagnostic()?;
            let mut array = open_array(&rig_setup.rig, &ports).await?;
            let _watchdog = guard_array(&*array, firmware.is_some())?;
            let identity = array.identity().clone();
            let believed = rig_setup.nominal_array().len();
            if believed != identity.elements {
                return Err(miette!(
                    help = "make [array] in the rig file the array that is connected",
                    "{} drives {} elements, and the rig file has {believed}",
                    array.device(),
                    identity.elements
                ));
            }
            let composed = compose(&display, &sounding(rig_setup, &display), &identity)?;
            if !self.json {
                let length = match seconds {
                    Some(seconds) => format!("for {seconds} s"),
                    None => "until it is stopped (Ctrl-C)".to_owned(),
                };
                print(&format!(
                    "{}\nplays on {} {length}\n",
                    summary(&composed, &identity),
                    array.device()
                ))?;
            }
            let ended = play(array.as_mut(), &composed.program, seconds, stop.first()).await?;
            let how = match ended {
                Ended::Played => "played",
                Ended::Stopped(who) => who,
            };
            if self.json {
                print_json(&serde_json::json!({
                    "display": display.name,
                    "frames": composed.program.frames().len(),
                    "loop_s": composed.program.loop_periods() as f64 / identity.carrier_hz(),
                    "modulation_hz": composed.modulation_hz,
                    "ended": how,
                    "silent": true,
                }))?;
            } else {
                print(&format!("{how}; the array is silent\n"))?;
            }
            Ok(ExitCode::SUCCESS)
        })
    }
}

/// The array of a rig file, radiating as a display file says.
pub(super) fn sounding<'a>(rig_setup: &'a RigSetup, display: &DisplayFile) -> SoundingArray<'a> {
    SoundingArray {
        array: rig_setup.nominal_array(),
        medium: rig_setup.nominal_medium(),
        frequency_hz: rig_setup.array.frequency_hz(),
        transducer: display.output.simulator.transducer(rig_setup.nominal_array()),
    }
}

/// What is sent, in a few words.
pub(super) fn summary(composed: &Composed, controller: &ArrayIdentity) -> String {
    let program = &composed.program;
    let loop_ms = program.loop_periods() as f64 / controller.carrier_hz() * 1e3;
    let frames = match program.frames().len() {
        1 => "1 frame".to_owned(),
        count => {
            format!("{count} frames in a loop of {loop_ms:.3} ms ({:.3} a second)", 1e3 / loop_ms)
        }
    };
    let modulation = match composed.modulation_hz {
        Some(hz) if program.envelope().levels().len() > 1 => format!(
            "modulated at {hz:.4} Hz by {} levels of {} periods",
            program.envelope().levels().len(),
            program.envelope().hold_periods()
        ),
        Some(hz) => format!("moved at {hz:.4} Hz"),
        None => "not modulated".to_owned(),
    };
    let steps = controller.period_steps;
    format!("{frames}, {modulation}; delays in {steps} steps of the carrier's period")
}
