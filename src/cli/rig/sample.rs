//! `fieldgap rig sample`: show the receiver's level live.

use std::io::{ErrorKind, IsTerminal, Write};
use std::num::NonZeroU32;
use std::process::ExitCode;
use std::slice;
use std::time::Duration;

use clap::Args;
use miette::IntoDiagnostic;
use serde_json::json;

use tokio::time::Instant;

use super::RigArg;
use super::focus::above_the_array;
use super::hands_on::{Ended, UNTIL_STOPPED, hands_on};
use crate::cli::exposure::Foreseen;
use crate::cli::permission::{Act, Permission};
use crate::cli::simulate::{millimetres, positive};
use crate::cli::sounding::Sounds;
use crate::rig_file::RigFile;
use crate::terminal::level::level_line;
use fieldgap_acoustics::Vec3;
use fieldgap_acquisition::element_delays;
use fieldgap_input::Positive;
use fieldgap_input::{visible_json, visible_line};
use fieldgap_rig::{DeviceSelection, Reading, ReceiverIdentity};

/// Cells of the bar.
const BAR: usize = 32;

/// Shortest time between two displayed levels.
const SHOWN_EVERY: Duration = Duration::from_millis(100);

/// The `rig sample` command.
#[derive(Debug, Args)]
pub(super) struct SampleLevel {
    #[command(flatten)]
    file: RigArg,
    /// Focus the array on this point in its frame, mm [default: the array is not used]
    #[arg(long, value_name = "X,Y,Z", value_parser = millimetres, allow_hyphen_values = true)]
    focus_mm: Option<Vec3>,
    /// Samples averaged per level [default: as in the rig file]
    #[arg(long, value_name = "N")]
    samples: Option<NonZeroU32>,
    /// Number of levels to show [default: until Ctrl-C]
    #[arg(long, value_name = "N")]
    count: Option<NonZeroU32>,
    /// Duration [default: until Ctrl-C]
    #[arg(long, value_name = "S", value_parser = positive)]
    seconds: Option<Positive>,
    #[command(flatten)]
    permission: Permission,
    /// Print each level as a line of JSON
    #[arg(long)]
    json: bool,
}

impl SampleLevel {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let rig_file = RigFile::read(&self.file.rig)?.on_wall_clock();
        let rig_setup = &rig_file.setup;
        let focus = self.focus_mm.map(above_the_array).transpose()?;
        if let Some(focus) = &focus {
            let seconds = self.seconds.map(Positive::get);
            let foreseen = Foreseen::of_drives(rig_setup, slice::from_ref(focus), seconds)?;
            self.permission.within_limits(foreseen.as_ref(), rig_setup)?;
            self.permission.to(Act::Emit, rig_setup)?;
        }
        let wanted = DeviceSelection { receiver: true, array: focus.is_some(), robot: false };
        let readings = self.samples.map_or(rig_setup.rig.receiver.count(), |n| n.get() as usize);
        hands_on(&rig_file, wanted, UNTIL_STOPPED, async |rig| {
            let _sounds = focus.as_ref().map(|_| Sounds::begin(rig_setup, "rig sample"));
            if let Some(focus) = &focus {
                rig.array().continuous_wave().await?;
                rig.array().set_delays(&element_delays(rig_setup, focus)).await?;
                rig.array().emit().await?;
            }
            let identity = rig.receiver().identity().clone();
            let mut shown = LevelDisplay::new(identity, self.json);
            let begun = Instant::now();
            let over = |shown: u32| {
                self.count.is_some_and(|count| shown >= count.get())
                    || self.seconds.is_some_and(|s| begun.elapsed().as_secs_f64() >= s.get())
            };
            let mut next = begun;
            let mut levels = 0;
            while !over(levels) {
                let reading = rig.receiver().read_point(Duration::ZERO, readings).await?;
                if Instant::now() < next {
                    continue;
                }
                next = Instant::now() + SHOWN_EVERY;
                levels += 1;
                if !shown.show(&reading)? {
                    break;
                }
            }
            Ok(Ended::Enough)
        })
    }
}

/// Shows levels: on a terminal in one line that is overwritten, elsewhere in one line each.
struct LevelDisplay {
    identity: ReceiverIdentity,
    json: bool,
    in_place: bool,
    highest: f64,
}

impl LevelDisplay {
    fn new(identity: ReceiverIdentity, json: bool) -> Self {
        let in_place = !json && std::io::stdout().is_terminal();
        Self { identity, json, in_place, highest: 0.0 }
    }

    /// Shows a level; false if the reader has gone.
    fn show(&mut self, reading: &Reading) -> miette::Result<bool> {
        self.highest = self.highest.max(reading.mean);
        let line = if self.json {
            let unit = &self.identity.unit;
            let level = json!({ "reading": reading, "unit": unit, "highest": self.highest });
            visible_json(&level.to_string()).into_owned() + "\n"
        } else {
            let line = level_line(reading, &self.identity, BAR);
            let line = visible_line(&line);
            let highest = format!("{:.5}", self.highest);
            match self.in_place {
                true => format!("\r\x1b[K{line}  highest {highest}"),
                false => format!("{line}\n"),
            }
        };
        self.write(&line)
    }

    fn write(&self, text: &str) -> miette::Result<bool> {
        let mut out = std::io::stdout().lock();
        match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
            Err(error) => Err(error).into_diagnostic(),
        }
    }
}

impl Drop for LevelDisplay {
    fn drop(&mut self) {
        if self.in_place {
            let _ = self.write("\n");
        }
    }
}
