//! Requests to stop: from the keyboard, a closed terminal or the system.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::mpsc::{Receiver, channel};

/// Exit code of a program that was ended immediately.
pub(super) const STOPPED_AT_ONCE: i32 = 130;

/// Time after the first request in which further ones are ignored (a closing terminal sends two signals): enough to make
/// the rig safe.
const ECHO: Duration = Duration::from_secs(2);

/// The first request ends a scan safely. A later one, or one after the scan, ends the program immediately.
pub(super) struct StopRequests {
    first: Receiver<&'static str>,
}

impl StopRequests {
    /// Listens for as long as the runtime lives.
    pub(super) fn listen() -> std::io::Result<Self> {
        let (tell, first) = channel(1);
        let told = Arc::new(OnceLock::<Instant>::new());
        for (kind, who) in [
            (SignalKind::interrupt(), "interrupted from the keyboard"),
            (SignalKind::quit(), "interrupted from the keyboard"),
            (SignalKind::hangup(), "the terminal was closed"),
            (SignalKind::terminate(), "asked to terminate"),
        ] {
            let mut asked = signal(kind)?;
            let (tell, told) = (tell.clone(), Arc::clone(&told));
            tokio::spawn(async move {
                while asked.recv().await.is_some() {
                    let echo = told.get().is_some_and(|told| told.elapsed() < ECHO);
                    let first = !echo && told.get().is_none() && tell.try_send(who).is_ok();
                    if first {
                        let _ = told.set(Instant::now());
                    } else if !echo {
                        std::process::exit(STOPPED_AT_ONCE);
                    }
                }
            });
        }
        Ok(Self { first })
    }

    /// Resolves at the first request, with its reason.
    pub(super) async fn first(mut self) -> &'static str {
        match self.first.recv().await {
            Some(who) => who,
            None => std::future::pending().await,
        }
    }
}
