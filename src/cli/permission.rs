//! Permission of the person at the rig, before a robot moves or an array emits.

use clap::Args;

use super::exposure::Foreseen;
use super::question::agree;
use super::sounding::is_heard;
use crate::cli::output::say;
use fieldgap_acquisition::RigSetup;
use fieldgap_rig::Role;

/// The argument that gives permission in advance.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct Permission {
    /// Do not ask before the robot moves or the array emits
    #[arg(long)]
    yes: bool,
    #[command(flatten)]
    limits: LimitPermission,
}

/// The argument that allows a level above the limits of exposure.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct LimitPermission {
    /// Start although a limit of exposure in the rig file is exceeded, or not shown to be kept; --yes does not answer this
    #[arg(long)]
    above_limits: bool,
}

/// What a command is about to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Act {
    /// The robot homes and moves.
    Move,
    /// The array emits.
    Emit,
    /// Both.
    Scan,
}

impl Act {
    /// The devices that act.
    fn of(self) -> &'static [Role] {
        match self {
            Self::Move => &[Role::Robot],
            Self::Emit => &[Role::FocusArray],
            Self::Scan => &[Role::Robot, Role::FocusArray],
        }
    }

    fn announcement(self) -> &'static str {
        match self {
            Self::Move => {
                "The robot homes first, because its position is unknown after its port was opened. The firmware chooses the \
                 path; keep-out boxes are not checked while homing."
            }
            Self::Emit => "The array is about to emit ultrasound.",
            Self::Scan => {
                "The array is about to emit ultrasound, and the robot homes first, because its position is unknown after its \
                 port was opened. The firmware chooses the path; keep-out boxes are not checked while homing."
            }
        }
    }

    fn question(self) -> &'static str {
        match self {
            Self::Move => "Is the path free?",
            Self::Emit => "Is everybody out of the way?",
            Self::Scan => "Is the path free, and everybody out of the way?",
        }
    }
}

impl LimitPermission {
    /// Says what speaks against the exposure of people, and asks whether the array may be driven all the same. A virtual array may always.
    /// The result is the permission for what follows: whoever agreed is told of more, and not asked again.
    ///
    /// # Errors
    /// It was refused, or nobody can be asked.
    pub(super) fn within_limits(
        self,
        foreseen: Option<&Foreseen>,
        rig_setup: &RigSetup,
    ) -> miette::Result<Self> {
        let concerns = foreseen.map(Foreseen::concerns).unwrap_or_default();
        if concerns.is_empty() {
            return Ok(self);
        }
        let warning = format!("exposure: {}", concerns.join("\nexposure: "));
        if !is_heard(rig_setup) {
            say(format!("{warning}\nThe array is virtual: nobody hears it."));
            return Ok(self);
        }
        if self.above_limits {
            say(warning);
            return Ok(self);
        }
        agree(
            &warning,
            "Is everybody away from there or protected, and is the array to be driven all the same?",
            "lower the drive, move people, or give --above-limits where that was decided; `fieldgap exposure` shows the levels",
        )?;
        Ok(Self { above_limits: true })
    }
}

impl Permission {
    /// As [`LimitPermission::within_limits`].
    ///
    /// # Errors
    /// It was refused, or nobody can be asked.
    pub(super) fn within_limits(
        self,
        foreseen: Option<&Foreseen>,
        rig_setup: &RigSetup,
    ) -> miette::Result<LimitPermission> {
        self.limits.within_limits(foreseen, rig_setup)
    }

    /// Announces what a real rig is about to do, and asks whether it may. Virtual devices may always.
    ///
    /// # Errors
    /// Permission was refused, or nobody can be asked.
    pub(super) fn to(self, act: Act, rig_setup: &RigSetup) -> miette::Result<()> {
        if !rig_setup.real_devices().iter().any(|role| act.of().contains(role)) {
            return Ok(());
        }
        let announcement = act.announcement();
        if self.yes {
            say(announcement);
            return Ok(());
        }
        agree(announcement, act.question(), "answer y, or give --yes, where it is safe to go ahead")
    }
}
