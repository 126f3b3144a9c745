//! Runs the scans of the queue, each as a process of its own.

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::Command;

use crate::app::App;
use crate::plans;
use crate::queue::Waiting;
use crate::refusal::{Refusal, blocking};

/// Lines of a process's messages that are kept, for the case that it fails.
const KEPT_WORDS: usize = 30;

/// Starts scans of the queue, one after the other, for as long as the server lives.
pub(crate) async fn run_queue(app: App) {
    loop {
        let free = !app.hand().is_open() && !app.scan_runs();
        let Some(next) = free.then(|| app.queue().begin()).flatten() else {
            tokio::time::sleep(Duration::from_millis(100)).await;
            continue;
        };
        app.live().show_queue(app.queue().shown());
        match permitted(&app, &next).await {
            Ok(above_limits) => {
                let folder = fresh_folder(&app, &next.plan);
                app.queue().records_in(&folder);
                app.live().note(format!("{}: begins, into {}", next.plan, app.name_of(&folder)));
                if let Ok(plan) = plans::file_of(app.plans(), &next.plan) {
                    run(&app, &plan, &folder, above_limits).await;
                }
            }
            Err(refusal) => {
                app.live().note(format!("{}: not started: {}", next.plan, refusal.problem))
            }
        }
        app.queue().ended();
        app.live().show_queue(app.queue().shown());
    }
}

/// Whether a scan may start above the limits of exposure.
///
/// # Errors
/// It may not start: the plan or the rig file was changed, or something speaks against it that was not accepted.
async fn permitted(app: &App, next: &Waiting) -> Result<bool, Refusal> {
    let (bench, plan) = (app.clone(), next.plan.clone());
    let check = move || plans::check(bench.plans(), &plan, bench.rig(), &**bench.exposing());
    let checked = blocking(check).await??;
    if checked.digest() != next.digest {
        return Err(Refusal::conflict(
            "plan or rig file were changed",
            "look at the dry run again",
        ));
    }
    next.accepts.covers(checked.exposure())
}

/// A folder for a record that does not exist yet.
fn fresh_folder(app: &App, plan: &str) -> PathBuf {
    let named = |n: u32| if n == 1 { plan.to_owned() } else { format!("{plan}-{n}") };
    let folders = (1..).map(|n| app.records().join(named(n)));
    folders.into_iter().find(|folder| !folder.exists()).unwrap_or_else(|| app.records().join(plan))
}

/// Starts a scan with its report, as a process of its own, which outlives this server; returns once it has ended.
async fn run(app: &App, plan: &Path, folder: &Path, above_limits: bool) {
    let mut command = Command::new(app.program());
    // Its own group: an interrupt at the server's terminal does not end the scan. Programs that a plan names are not run unasked:
    // without a terminal to ask at, the scan refuses.
    command
        .arg("run")
        .arg(plan)
        .arg("--rig")
        .arg(app.rig())
        .arg("--out")
        .arg(folder)
        .arg("--yes")
        .args(above_limits.then_some("--above-limits"))
        .process_group(0);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).kill_on_drop(false);
    let live = app.live();
    let mut child = match command.spawn() {
        Ok(child) => child,
        Err(error) => return live.note(format!("the scan could not be started: {error}")),
    };
    let mut words: Vec<String> = Vec::new();
    if let Some(stderr) = child.stderr.take() {
        let mut lines = BufReader::new(stderr).lines();
        while let Ok(Some(line)) = lines.next_line().await {
            if words.len() == KEPT_WORDS {
                words.remove(0);
            }
            words.push(line);
        }
    }
    match child.wait().await {
        Ok(status) if status.success() => live.note(format!("{}: done", app.name_of(folder))),
        // The exit code of a scan that ended early; its record has the reason.
        Ok(status) if status.code() == Some(3) => {
            live.note(format!("{}: ended early", app.name_of(folder)))
        }
        Ok(_) => {
            for word in words.iter().filter(|word| !word.trim().is_empty()) {
                live.note(word);
            }
        }
        Err(error) => live.note(format!("the scan's process cannot be waited for: {error}")),
    }
}
