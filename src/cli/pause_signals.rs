//! Pause and continue by signal: `kill -USR1` pauses a scan, `kill -USR2` lets it go on.

use tokio::signal::unix::{Signal, SignalKind, signal};

use fieldgap_acquisition::{Pause, PauseSwitch};

/// The two signals, which end the program as long as nobody listens.
pub(super) struct PauseSignals {
    pause: Signal,
    go_on: Signal,
}

impl PauseSignals {
    /// Listens from now on.
    pub(super) fn listen() -> std::io::Result<Self> {
        Ok(Self {
            pause: signal(SignalKind::user_defined1())?,
            go_on: signal(SignalKind::user_defined2())?,
        })
    }

    /// The pause that the signals switch, for as long as the runtime lives.
    pub(super) fn follow(self) -> Pause {
        let (switch, pause) = PauseSwitch::new();
        let Self { pause: mut paused, go_on: mut continued } = self;
        tokio::spawn(async move {
            loop {
                let pause = tokio::select! {
                    Some(()) = paused.recv() => true,
                    Some(()) = continued.recv() => false,
                    else => return,
                };
                switch.set(pause);
            }
        });
        pause
    }
}
