//! `fieldgap focus`: play a tactile display on a rig.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};

use super::exposure::Foreseen;
use super::output::{print, print_json};
use super::permission::LimitPermission;
use super::simulate::positive;
use super::sounding::Sounds;
use super::stop::StopRequests;
use super::watchdog::{followed, guard_array};
use crate::rig_file::RigFile;
use fieldgap_acquisition::RigSetup;
use fieldgap_display::{ComposedDisplay, DisplayFile, PlaybackEnd, RadiatingArray, compose, play};
use fieldgap_input::Positive;
use fieldgap_rig::{ArrayIdentity, open_array};
use fieldgap_virtual_rig::VirtualRig;

/// The `focus` command.
#[derive(Debug, Args)]
pub(super) struct Focus {
    /// Display file (examples: scans/display-*.toml)
    display: PathBuf,
    /// Rig file [default: the one named in the display file]
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Duration [default: as in the display file, or until Ctrl-C]
    #[arg(long, value_name = "S", value_parser = positive)]
    seconds: Option<Positive>,
    #[command(flatten)]
    limits: LimitPermission,
    /// Print a summary as JSON
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
        let seconds = self.seconds.or(display.seconds.map(Positive::from)).map(Positive::get);
        runtime.block_on(async {
            let mut array = open_array(&rig_setup.rig, &ports).await?;
            let watchdog = guard_array(&*array, rig_setup)?;
            let identity = array.identity().clone();
            let believed = rig_setup.nominal_array().len();
            if believed != identity.elements {
                return Err(miette!(
                    help =
                        "correct [array] in the rig file, or connect the array that it describes",
                    "{} drives {} elements, but the rig file describes {believed}",
                    array.device(),
                    identity.elements
                ));
            }
            let composed = compose(&display, &radiating(rig_setup, &display), &identity)?;
            let foreseen = Foreseen::of_drives(rig_setup, &composed.drives(&identity), seconds)?;
            self.limits.within_limits(foreseen.as_ref(), rig_setup)?;
            let stop = StopRequests::listen().into_diagnostic()?;
            if !self.json {
                let length = match seconds {
                    Some(seconds) => format!("for {seconds} s"),
                    None => "until Ctrl-C".to_owned(),
                };
                print(&format!(
                    "{}\nplaying on {} {length}\n",
                    summary(&composed, &identity),
                    array.device()
                ))?;
            }
            let playing = play(array.as_mut(), &composed.program, seconds, stop.first());
            let sounds = Sounds::begin(rig_setup, "focus");
            let ended = followed(watchdog.as_ref(), playing).await?;
            drop(sounds);
            let how = match ended {
                PlaybackEnd::Played => "played",
                PlaybackEnd::Stopped(who) => who,
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

/// The array of a rig file, with the transducer model of a display file.
pub(super) fn radiating<'a>(rig_setup: &'a RigSetup, display: &DisplayFile) -> RadiatingArray<'a> {
    RadiatingArray {
        array: rig_setup.nominal_array(),
        medium: rig_setup.nominal_medium(),
        frequency_hz: rig_setup.array.frequency_hz(),
        transducer: display.output.simulator.transducer(rig_setup.nominal_array()),
    }
}

/// Summary of a drive program.
pub(super) fn summary(composed: &ComposedDisplay, controller: &ArrayIdentity) -> String {
    let program = &composed.program;
    let loop_ms = program.loop_periods() as f64 / controller.carrier_hz() * 1e3;
    let frames = match program.frames().len() {
        1 => "1 frame".to_owned(),
        count => {
            format!(
                "{count} frames in a loop of {loop_ms:.3} ms ({:.3} loops per second)",
                1e3 / loop_ms
            )
        }
    };
    let modulation = match composed.modulation_hz {
        Some(hz) if program.envelope().levels().len() > 1 => format!(
            "modulated at {hz:.4} Hz with {} levels of {} periods",
            program.envelope().levels().len(),
            program.envelope().hold_periods()
        ),
        Some(hz) => format!("moving at {hz:.4} Hz"),
        None => "not modulated".to_owned(),
    };
    let steps = controller.period_steps;
    format!("{frames}, {modulation}; delays in steps of 1/{steps} of the carrier period")
}
