//! `fieldgap sense`: detect hand swipes.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};

use super::exposure::Foreseen;
use super::output::{json_line, print};
use super::permission::LimitPermission;
use super::simulate::positive;
use super::sounding::Sounds;
use super::stop::StopRequests;
use super::watchdog::{followed, guard_array};
use crate::rig_file::RigFile;
use fieldgap_acoustics::Excitation;
use fieldgap_input::Positive;
use fieldgap_rig::open_array;
use fieldgap_sensing::{Swipe, SwipeListener};
use fieldgap_virtual_rig::VirtualRig;

/// The `sense` command.
#[derive(Debug, Args)]
pub(super) struct Sense {
    /// Rig file with a [sensing] section, such as rigs/swipe.toml
    rig: PathBuf,
    /// Duration on the controller's clock [default: until Ctrl-C]
    #[arg(long, value_name = "S", value_parser = positive)]
    seconds: Option<Positive>,
    #[command(flatten)]
    limits: LimitPermission,
    /// Print each swipe as a line of JSON
    #[arg(long)]
    json: bool,
}

impl Sense {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        // The virtual hand moves by itself.
        let rig_file = RigFile::read(&self.rig)?.on_wall_clock();
        let rig_setup = &rig_file.setup;
        let section = rig_setup.sensing.ok_or_else(|| {
            miette!(
                help = "add a [sensing] section with the elements `left` and `right`, as in rigs/swipe.toml",
                "{} has no section [sensing]",
                self.rig.display()
            )
        })?;
        let seconds = self.seconds.map(Positive::get);
        // A listener drives all elements in phase.
        let foreseen = Foreseen::of_drives(rig_setup, &[Excitation::Uniform], seconds)?;
        self.limits.within_limits(foreseen.as_ref(), rig_setup)?;
        let firmware = rig_file.open_virtual()?;
        let ports = firmware.as_ref().map(VirtualRig::ports).unwrap_or_default();
        let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
        runtime.block_on(async {
            let stop = StopRequests::listen().into_diagnostic()?.first();
            tokio::pin!(stop);
            let mut array = open_array(&rig_setup.rig, &ports).await?;
            let watchdog = guard_array(&*array, rig_setup)?;
            let [a, b, c, d] = section.elements();
            if !self.json {
                print(&format!(
                    "receiving on {} at {} Hz: elements {a} and {b} on the left, {c} and {d} on the right\n",
                    array.device(),
                    section.rate_hz()
                ))?;
            }
            let sounds = Sounds::begin(rig_setup, "sense");
            let mut session = SwipeListener::begin(array.as_mut(), section).await?;
            let listening = async {
                let mut begun_s = None;
                loop {
                    let heard = tokio::select! {
                        _ = &mut stop => return Ok::<_, miette::Report>(()),
                        heard = session.next() => heard?,
                    };
                    if let Some(swipe) = heard.swipe {
                        print(&self.line(&swipe)?)?;
                    }
                    let begun_s = *begun_s.get_or_insert(heard.time_s);
                    if self.seconds.is_some_and(|seconds| heard.time_s - begun_s >= seconds.get()) {
                        return Ok(());
                    }
                }
            };
            followed(watchdog.as_ref(), listening).await?;
            let (samples, lost) = session.tally();
            session.end().await?;
            drop(sounds);
            if !self.json {
                let lost = if lost > 0 { format!(", {lost} lost") } else { String::new() };
                print(&format!("{samples} samples received{lost}; the array is silent\n"))?;
            }
            Ok(ExitCode::SUCCESS)
        })
    }

    fn line(&self, swipe: &Swipe) -> miette::Result<String> {
        if self.json {
            return json_line(swipe).into_diagnostic();
        }
        Ok(format!(
            "{:>9.2} s  {:<5}  present for {:.2} s, {:.0} ms between the two sides\n",
            swipe.went_s,
            swipe.direction.to_string(),
            swipe.went_s - swipe.came_s,
            swipe.lag_s * 1e3
        ))
    }
}
