//! `fieldgap rig jog`: move the robot with the keyboard.

use std::process::ExitCode;
use std::slice;
use std::time::Duration;

use clap::Args;
use miette::{IntoDiagnostic, miette};

use super::RigArg;
use super::focus::above_the_array;
use super::hands_on::{Ended, UNTIL_STOPPED, hands_on};
use super::motion::in_both_frames;
use crate::cli::exposure::Foreseen;
use crate::cli::output::say;
use crate::cli::permission::LimitPermission;
use crate::cli::simulate::millimetres;
use crate::cli::sounding::Sounds;
use crate::rig_file::RigFile;
use crate::terminal::jog::{Act, Doing, Jog as View, draw};
use crate::terminal::{KeyPresses, Press, Screen};
use fieldgap_acoustics::Vec3;
use fieldgap_acquisition::{RigSetup, element_delays};
use fieldgap_rig::{DeviceSelection, ManualRig, RigError};

/// Samples averaged per level.
const READINGS: usize = 16;

/// Time between two levels.
const BETWEEN: Duration = Duration::from_millis(80);

/// The `rig jog` command.
#[derive(Debug, Args)]
pub(super) struct Jog {
    #[command(flatten)]
    file: RigArg,
    /// Focus of the array in its frame, mm; the key f switches it on and off [default: the array is not used]
    #[arg(long, value_name = "X,Y,Z", value_parser = millimetres, allow_hyphen_values = true)]
    focus_mm: Option<Vec3>,
    /// Do not use the receiver
    #[arg(long)]
    no_receiver: bool,
    #[command(flatten)]
    limits: LimitPermission,
}

/// What interrupted a wait.
enum Next {
    Key(Option<Act>),
    Heard,
}

impl Jog {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        if !Screen::is_possible() {
            return Err(miette!(
                help = "run it in a terminal, or use `fieldgap rig go`, which needs none",
                "jogging reads keys from a terminal, and there is none"
            ));
        }
        let rig_file = RigFile::read(&self.file.rig)?.on_wall_clock();
        let rig_setup = &rig_file.setup;
        let focus = self.focus_mm.map(above_the_array).transpose()?;
        if let Some(focus) = &focus {
            let foreseen = Foreseen::of_drives(rig_setup, slice::from_ref(focus), None)?;
            self.limits.within_limits(foreseen.as_ref(), rig_setup)?;
        }
        let wanted =
            DeviceSelection { robot: true, array: focus.is_some(), receiver: !self.no_receiver };
        let mut left_at = None;
        let ended = hands_on(&rig_file, wanted, UNTIL_STOPPED, async |rig| {
            if let Some(focus) = &focus {
                rig.array().continuous_wave().await?;
                rig.array().set_delays(&element_delays(rig_setup, focus)).await?;
            }
            let receiver = wanted.receiver.then(|| rig.receiver().identity().clone());
            let (envelope, frame) = (rig_setup.rig.motion.envelope(), rig_setup.rig.motion.frame());
            let title = self.file.rig.display().to_string();
            let view = View::new(title, envelope, frame, receiver, focus.is_some());
            let mut jogging = Jogging {
                rig_setup,
                view,
                screen: Screen::open().into_diagnostic()?,
                keys: KeyPresses::listen(),
                sounds: None,
            };
            let ended = jogging.until_quit(rig).await;
            if let Doing::Standing(at) = jogging.view.doing() {
                left_at = Some(at);
            }
            ended.map(|()| Ended::Enough)
        });
        if let Some(at) = left_at {
            say(format!("robot left at {}", in_both_frames(at, &rig_setup.rig.motion.frame())));
        }
        ended
    }
}

struct Jogging<'l> {
    rig_setup: &'l RigSetup,
    view: View,
    screen: Screen,
    keys: KeyPresses,
    sounds: Option<Sounds>,
}

impl Jogging<'_> {
    async fn until_quit(&mut self, rig: &mut ManualRig) -> miette::Result<()> {
        loop {
            self.show()?;
            let act = match self.key_or_level(rig).await {
                Next::Key(Some(act)) => act,
                Next::Key(None) | Next::Heard => continue,
            };
            match act {
                Act::Quit => return Ok(()),
                Act::Stop => self.stop(rig).await?,
                Act::Emit(true) => {
                    self.sounds = Some(Sounds::begin(self.rig_setup, "rig jog"));
                    rig.array().emit().await?;
                    self.view.emits(true);
                }
                Act::Emit(false) => {
                    rig.array().silence().await?;
                    self.sounds = None;
                    self.view.emits(false);
                }
                Act::Home | Act::Move(_) => {
                    if self.under_way(rig, act).await? == Some(Act::Quit) {
                        return Ok(());
                    }
                }
            }
        }
    }

    /// Waits for a key, and reads the level meanwhile.
    async fn key_or_level(&mut self, rig: &mut ManualRig) -> Next {
        let (_, receiver) = rig.robot_and_receiver();
        let level = async {
            match receiver {
                Some(receiver) => {
                    tokio::time::sleep(BETWEEN).await;
                    receiver.read_point(Duration::ZERO, READINGS).await
                }
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            biased;
            press = self.keys.next() => Next::Key(self.view_takes(press)),
            heard = level => {
                self.view.heard(heard.map_err(|error| error.to_string()));
                Next::Heard
            }
        }
    }

    /// Homes or moves, and reads the level meanwhile. Stop or quit interrupts the move and is returned.
    async fn under_way(&mut self, rig: &mut ManualRig, act: Act) -> miette::Result<Option<Act>> {
        let feed = self.rig_setup.rig.motion.feed();
        let interrupted = {
            let (robot, mut receiver) = rig.robot_and_receiver();
            let moving = async {
                match act {
                    Act::Move(to) => robot.move_to(to, feed).await,
                    _ => robot.home().await,
                }
            };
            tokio::pin!(moving);
            loop {
                self.show()?;
                let level = async {
                    tokio::time::sleep(BETWEEN).await;
                    match &mut receiver {
                        Some(receiver) => receiver.read_point(Duration::ZERO, READINGS).await,
                        None => std::future::pending().await,
                    }
                };
                tokio::select! {
                    biased;
                    press = self.keys.next() => match self.view_takes(press) {
                        Some(act @ (Act::Stop | Act::Quit)) => break Some(act),
                        _ => continue,
                    },
                    arrived = &mut moving => {
                        match arrived {
                            Ok(at) => self.view.arrived(at),
                            Err(error) => self.view.lost(with_remedy(&error)),
                        }
                        break None;
                    }
                    heard = level => self.view.heard(heard.map_err(|error| error.to_string())),
                }
            }
        };
        if interrupted == Some(Act::Stop) {
            self.stop(rig).await?;
        }
        Ok(interrupted)
    }

    /// Stops everything: the array first, then the robot.
    async fn stop(&mut self, rig: &mut ManualRig) -> miette::Result<()> {
        let made = rig.make_safe("stopped").await;
        if made.array.is_some() {
            self.sounds = None;
            self.view.emits(false);
        }
        self.view.lost(made.to_string());
        Ok(())
    }

    fn view_takes(&mut self, press: Press) -> Option<Act> {
        match press {
            Press::Key(key) => self.view.key(key),
            Press::Resized => None,
        }
    }

    fn show(&mut self) -> miette::Result<()> {
        self.screen.draw(|frame| draw(&self.view, frame)).into_diagnostic()
    }
}

fn with_remedy(error: &RigError) -> String {
    format!("{error}. {}", error.remedy())
}
