//! The monitor of an unattended scan: it raises an alarm when the scan makes no progress, and starts the hooks.
//!
//! It only reads events. Neither it nor a failing hook can affect the scan.

use std::path::{Path, PathBuf};
use std::time::Duration;

use tokio::sync::mpsc::UnboundedReceiver;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep_until};

use super::event::Event;
use super::hook;
use super::planned_scan::PlannedScan;
use fieldgap_records::{HookKind, Hooks};

/// The alarm is raised after this many times the expected duration of the slowest point...
const TIMES_SLOWEST: f64 = 10.0;

/// ... and not before this time.
const AT_LEAST: Duration = Duration::from_secs(60);

/// Most hooks that run at a time.
const MOST_HOOKS: usize = 4;

/// Monitors one scan.
#[derive(Debug, Clone)]
pub struct Monitor {
    hooks: Hooks,
    scan: PathBuf,
    no_progress: Duration,
}

impl Monitor {
    /// For a scan whose record is in `folder` and whose slowest point is expected to take `slowest_s`; it starts `hooks`.
    pub(super) fn new(scan: &PlannedScan, hooks: Hooks, folder: &Path, slowest_s: f64) -> Self {
        let plan = &scan.plan;
        let derived = || Duration::try_from_secs_f64(slowest_s * TIMES_SLOWEST);
        let no_progress = match plan.alarm.no_progress_s {
            Some(given) => Duration::try_from_secs_f64(given.get()),
            None => derived().map(|derived| derived.max(AT_LEAST)),
        };
        Self {
            hooks,
            scan: std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned()),
            no_progress: no_progress.unwrap_or(Duration::MAX),
        }
    }

    /// Follows the events of a scan until it has ended or the channel is closed, then waits for the hooks. Its own events
    /// go to `tell`.
    pub async fn follow(
        self,
        mut events: UnboundedReceiver<Event>,
        mut tell: impl FnMut(&Event) + Send,
    ) {
        let mut hooks: JoinSet<Option<Event>> = JoinSet::new();
        let mut alarm: Option<Instant> = None;
        loop {
            let quiet = async {
                match alarm {
                    Some(at) => sleep_until(at).await,
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                biased;
                event = events.recv() => {
                    let Some(event) = event else { break };
                    match event {
                        Event::Paused => alarm = None,
                        Event::Question { text } => {
                            self.start(HookKind::Question, text, &mut hooks, &mut tell);
                        }
                        Event::Suspended { suspended_s } => {
                            alarm = Instant::now().checked_add(self.no_progress);
                            let text = suspended(suspended_s);
                            self.start(HookKind::Question, text, &mut hooks, &mut tell);
                        }
                        Event::DiskFull { reason } => {
                            // The scan waits for a person, who is notified now.
                            alarm = None;
                            self.start(HookKind::Question, reason, &mut hooks, &mut tell);
                        }
                        Event::Ended { rows, of, reason } => {
                            let (kind, message) = ending(rows, of, reason);
                            self.start(kind, message, &mut hooks, &mut tell);
                            break;
                        }
                        // Homing has its own time limit in the rig file, and precedes the first point.
                        Event::Opened { .. } | Event::ImpairedReading { .. } | Event::HookFailed { .. } => {}
                        _ => alarm = Instant::now().checked_add(self.no_progress),
                    }
                }
                () = quiet => {
                    // Once, until the scan continues.
                    alarm = None;
                    let seconds = self.no_progress.as_secs_f64();
                    let text = format!("no point was measured for {seconds:.0} s: check the robot and the devices");
                    tell(&Event::Question { text: text.clone() });
                    self.start(HookKind::Question, text, &mut hooks, &mut tell);
                }
                Some(ended) = hooks.join_next() => report(ended, &mut tell),
            }
        }
        while let Some(ended) = hooks.join_next().await {
            report(ended, &mut tell);
        }
    }

    fn start(
        &self,
        kind: HookKind,
        message: String,
        hooks: &mut JoinSet<Option<Event>>,
        tell: &mut impl FnMut(&Event),
    ) {
        let Some(command) = self.hooks.command(kind).cloned() else { return };
        let name = kind.name();
        if hooks.len() >= MOST_HOOKS {
            let text =
                format!("hook on_{name} was not started: {MOST_HOOKS} hooks are still running");
            tell(&Event::HookFailed { text });
            return;
        }
        let scan = self.scan.clone();
        hooks.spawn(async move {
            let fault = hook::run(&command, kind, &scan, &message, hook::TIME_LIMIT).await.err()?;
            let text = format!("hook on_{name}, `{}`: {fault}", command.program());
            Some(Event::HookFailed { text })
        });
    }
}

fn suspended(suspended_s: f64) -> String {
    format!(
        "the computer was suspended for {suspended_s:.0} s; keep it from that during a scan, for example with systemd-inhibit"
    )
}

fn ending(rows: usize, of: usize, reason: Option<String>) -> (HookKind, String) {
    match reason {
        None => (HookKind::Finish, format!("complete: {rows} points")),
        Some(reason) => (HookKind::Failure, format!("ended with {rows} of {of} points: {reason}")),
    }
}

fn report(ended: Result<Option<Event>, tokio::task::JoinError>, tell: &mut impl FnMut(&Event)) {
    if let Ok(Some(event)) = ended {
        tell(&event);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
    use tokio::time::sleep;

    use super::*;
    use fieldgap_input::toml_text;

    type Notes = Arc<Mutex<Vec<Event>>>;

    fn monitored(hooks: &str) -> (UnboundedSender<Event>, Notes, tokio::task::JoinHandle<()>) {
        let monitor = Monitor {
            hooks: toml_text(Path::new("p.toml"), hooks).expect("hooks"),
            scan: "out/overnight".into(),
            no_progress: Duration::from_secs(60),
        };
        let (tell, told) = unbounded_channel();
        let said = Notes::default();
        let keeps = Arc::clone(&said);
        let task = tokio::spawn(monitor.follow(told, move |event| {
            keeps.lock().expect("not poisoned").push(event.clone());
        }));
        (tell, said, task)
    }

    fn measured(row: usize) -> Event {
        let at_mm = [0.0, 0.0, 100.0];
        let time_s = row as f64;
        Event::Measured { row, of: 9, focus: 0, at_mm, time_s, reading: 1.0, clipped: false }
    }

    async fn after(tell: &UnboundedSender<Event>, event: Event, seconds: u64) {
        tell.send(event).expect("it listens");
        sleep(Duration::from_secs(seconds)).await;
    }

    #[tokio::test(start_paused = true)]
    async fn the_alarm_is_raised_once_for_each_standstill() {
        let (tell, said, task) = monitored("");
        after(&tell, Event::Homed, 59).await;
        after(&tell, measured(0), 59).await;
        assert!(said.lock().expect("not poisoned").is_empty());
        after(&tell, measured(1), 600).await;
        assert_eq!(said.lock().expect("not poisoned").len(), 1);
        after(&tell, measured(2), 61).await;
        after(&tell, Event::Ended { rows: 3, of: 9, reason: None }, 0).await;
        task.await.expect("it ends");
        let said = said.lock().expect("not poisoned");
        assert_eq!(said.len(), 2);
        let Event::Question { text } = &said[0] else { panic!("{:?}", said[0]) };
        assert!(text.contains("no point was measured for 60 s"), "{text}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_paused_scan_raises_no_alarm() {
        let (tell, said, task) = monitored("");
        after(&tell, Event::Homed, 1).await;
        after(&tell, Event::Paused, 36_000).await;
        after(&tell, Event::Continued { waited_s: 36_000.0 }, 30).await;
        drop(tell);
        task.await.expect("it ends");
        assert!(said.lock().expect("not poisoned").is_empty());
    }

    #[tokio::test]
    async fn the_end_waits_for_its_hook_and_a_failing_hook_is_reported() {
        let home = tempfile::tempdir().expect("a folder");
        let file = home.path().join("told");
        let (tell, said, task) = monitored(&format!(
            "on_failure = ['sh', '-c', 'sleep 0.2; printf %s \"$FIELDGAP_MESSAGE\" > \"$0\"', '{}']\n\
             on_question = 'false'\n",
            file.display()
        ));
        tell.send(Event::Question { text: "is it warm?".into() }).expect("it listens");
        let reason = Some("the robot was lost".to_owned());
        tell.send(Event::Ended { rows: 3, of: 9, reason }).expect("it listens");
        task.await.expect("it ends");
        let told = std::fs::read_to_string(&file).expect("the hook wrote it");
        assert_eq!(told, "ended with 3 of 9 points: the robot was lost");
        let said = said.lock().expect("not poisoned");
        let [Event::HookFailed { text }] = said.as_slice() else { panic!("{said:?}") };
        assert!(text.starts_with("hook on_question, `false`: it failed"), "{text}");
    }
}
