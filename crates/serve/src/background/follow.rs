//! Follows the running scan by its journal.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use fieldgap_acoustics::Simulation;
use fieldgap_acquisition::AirRow;
use fieldgap_input::Fault;
use fieldgap_records::{EventKind, JournalTail, ScanState, read_events};

use crate::app::App;
use crate::live::Live;
use crate::scan_process::{process_of, running_below};
use crate::scan_view::{ScanView, Stage, planned_visits, readings};

/// Time between two looks at the journal. A page shall show a reading within 200 ms of its being journalled.
const LOOK: Duration = Duration::from_millis(40);

/// Time between two looks for a scan that another program has started, and at the events of one that runs.
const LOOK_AROUND: Duration = Duration::from_millis(500);

/// Follows whatever scan runs below the folder of the records, for as long as the server lives.
pub(crate) async fn follow_all(app: App) {
    let mut shown: Option<PathBuf> = None;
    loop {
        let (records, program) = (app.records().to_owned(), app.program().to_owned());
        let found = tokio::task::spawn_blocking(move || running_below(&records, &program)).await;
        // A scan of this server may have ended between two looks.
        let newest = app
            .queue()
            .newest_folder()
            .filter(|folder| shown.as_ref() != Some(folder) && folder.join("scan.toml").is_file());
        match found.ok().flatten().or(newest) {
            Some(folder) => {
                if let Err(fault) = follow(&app, &folder).await {
                    app.live().note(fault.to_string());
                    tokio::time::sleep(LOOK_AROUND).await;
                }
                shown = Some(folder);
            }
            None => {
                if let Some(folder) = &shown {
                    // The report is written after the record is closed.
                    let (has_report, busy) =
                        (folder.join("report/index.html").is_file(), app.is_busy());
                    app.live().update_scan(|scan| {
                        let stage = if busy { Stage::Reporting } else { Stage::Ended };
                        let reason = reason_of(folder);
                        scan.enter(stage, reason, has_report)
                    });
                }
                tokio::time::sleep(LOOK_AROUND).await;
            }
        }
    }
}

fn reason_of(folder: &Path) -> Option<String> {
    match ScanState::of(folder) {
        Ok(Some(ScanState::Partial { reason })) => Some(reason),
        _ => None,
    }
}

/// Waits until the plan of a scan that has just begun is beside its set-up, for as long as its process may still write it.
async fn until_planned(app: &App, folder: &Path) {
    loop {
        // Looked for before the plan: a process that has ended has written all.
        let runs = app.is_busy() || process_of(folder, app.program()).is_some();
        if planned_visits(folder).is_some() || !runs {
            return;
        }
        tokio::time::sleep(LOOK).await;
    }
}

/// Follows one scan to its end.
async fn follow(app: &App, folder: &Path) -> Result<(), Fault> {
    let live: &Arc<Live> = app.live();
    until_planned(app, folder).await;
    let mut tail = JournalTail::open(folder)?;
    let setup = tail.setup().clone();
    let simulations: Vec<Option<Simulation>> =
        (0..setup.foci.len()).map(|focus| setup.simulation(setup.simulator, focus)).collect();
    let mut events = 0;
    let mut shown = false;
    let mut looked_around = Instant::now() - LOOK_AROUND;
    loop {
        let ended = if looked_around.elapsed() >= LOOK_AROUND {
            looked_around = Instant::now();
            process_of(folder, app.program()).is_none()
        } else {
            false
        };
        // Read after the process was looked for, so that its last records are not missed.
        loop {
            let first = tail.rows();
            let records = tail.read_new()?;
            if !shown {
                let mut scan = ScanView::new(folder, app.name_of(folder), &setup);
                scan.add(&readings(&simulations, first, &records));
                live.show_scan(scan);
                shown = true;
            } else if !records.is_empty() {
                live.add_readings(&readings(&simulations, first, &records));
            }
            if records.is_empty() {
                break;
            }
        }
        live.show_air(AirRow::all_of(folder));
        if let Ok(all) = read_events(folder) {
            for event in all.iter().skip(events) {
                let kind = serde_json::to_value(event.kind).ok();
                let kind = kind
                    .as_ref()
                    .and_then(|kind| kind.as_str())
                    .unwrap_or_default()
                    .replace('-', " ");
                let text = match event.text.as_str() {
                    "" => kind,
                    text if text.starts_with(&kind) => text.to_owned(),
                    text => format!("{kind}: {text}"),
                };
                live.note_at(event.at, text);
            }
            events = all.len().max(events);
            let paused = all.iter().rev().find_map(|event| match event.kind {
                EventKind::Paused => Some(true),
                EventKind::Continued | EventKind::Resumed | EventKind::Started => Some(false),
                _ => None,
            });
            let stage = match (ended, paused) {
                (true, _) => Stage::Reporting,
                (false, Some(true)) => Stage::Paused,
                (false, _) => Stage::Scanning,
            };
            live.update_scan(|scan| scan.enter(stage, reason_of(folder), false));
        }
        if ended {
            return Ok(());
        }
        tokio::time::sleep(LOOK).await;
    }
}
