//! What every page shows: the running scan, the rig under hand, the controls, the last events. A page that opens late gets all of it, and
//! from then on each change.

use std::collections::{HashMap, VecDeque};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use jiff::Timestamp;
use serde::Serialize;
use serde_json::{Value, json};
use tokio::sync::broadcast;

use fieldgap_acquisition::AirRow;

use crate::access::lease::Lease;
use crate::hand_state::HandState;
use crate::scan_view::{Reading, ScanView};

/// Messages kept for a page that is slow. One that falls further behind is sent everything again.
const KEPT_MESSAGES: usize = 1024;

/// How long somebody keeps the controls without an open page: long enough to reload it or to change the network.
const CONTROLS_WITHOUT_PAGE: Duration = Duration::from_secs(60);

/// Lines of the log that are kept.
const KEPT_LINES: usize = 200;

/// A message to all pages: its kind, and the JSON of what changed.
pub(crate) type Message = (&'static str, std::sync::Arc<str>);

/// A line of the log.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Line {
    at: Timestamp,
    text: String,
}

#[derive(Debug, Default, Serialize)]
struct Seen {
    scan: Option<ScanView>,
    hand: HandState,
    lease: Lease,
    queue: Value,
    lines: VecDeque<Line>,
    viewers: usize,
    /// Open pages of the holder of the controls, by session, and since when there has been none.
    #[serde(skip)]
    pages: HashMap<u64, usize>,
    #[serde(skip)]
    alone_since: Option<Instant>,
}

/// The state that all pages share.
#[derive(Debug)]
pub(crate) struct Live {
    seen: Mutex<Seen>,
    changes: broadcast::Sender<Message>,
}

impl Live {
    pub fn new() -> Self {
        let queue = json!([]);
        Self {
            seen: Mutex::new(Seen { queue, ..Seen::default() }),
            changes: broadcast::channel(KEPT_MESSAGES).0,
        }
    }

    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends a message, under the lock, so that it comes after the state that a page began with.
    fn send(&self, kind: &'static str, value: &impl Serialize) {
        if let Ok(text) = serde_json::to_string(value) {
            // Without a page nobody receives it.
            let _ = self.changes.send((kind, text.into()));
        }
    }

    /// Everything, and the messages from then on.
    pub fn follow(&self) -> (String, broadcast::Receiver<Message>) {
        let seen = self.seen();
        // Written at once: 100,000 readings as a tree of values would take ten times their text.
        let all = serde_json::to_string(&*seen).unwrap_or_default();
        (all, self.changes.subscribe())
    }

    /// Everything but the readings.
    pub fn summary(&self) -> Value {
        let seen = self.seen();
        json!({
            "scan": seen.scan.as_ref().map(ScanView::progress), "hand": seen.hand, "lease": seen.lease,
            "queue": seen.queue, "lines": seen.lines, "viewers": seen.viewers,
        })
    }

    /// A page of a session has opened or closed.
    pub fn viewers_changed(&self, session: u64, by: isize) {
        let mut seen = self.seen();
        seen.viewers = seen.viewers.saturating_add_signed(by);
        let pages = seen.pages.entry(session).or_default();
        *pages = pages.saturating_add_signed(by);
        if *pages == 0 {
            seen.pages.remove(&session);
            if seen.lease.is_held_by(session) {
                seen.alone_since = Some(Instant::now());
            }
        }
        self.send("viewers", &seen.viewers);
    }

    /// The session that has the controls and closed its last page more than a minute ago. A program that never had a page open keeps them.
    pub fn has_left(&self, now: Instant) -> Option<u64> {
        let mut seen = self.seen();
        let holder = seen.lease.holder_id()?;
        if seen.pages.contains_key(&holder) {
            seen.alone_since = None;
        }
        let since = seen.alone_since?;
        (now.saturating_duration_since(since) > CONTROLS_WITHOUT_PAGE).then(|| {
            seen.alone_since = None;
            holder
        })
    }

    /// Another scan is shown.
    pub fn show_scan(&self, scan: ScanView) {
        let mut seen = self.seen();
        self.send("scan", &scan);
        seen.scan = Some(scan);
    }

    /// Readings were journalled.
    pub fn add_readings(&self, readings: &[Reading]) {
        let mut seen = self.seen();
        if let Some(scan) = &mut seen.scan {
            scan.add(readings);
            self.send("readings", &readings);
        }
    }

    /// The state of the shown scan has changed.
    pub fn update_scan(&self, update: impl FnOnce(&mut ScanView) -> bool) {
        let mut seen = self.seen();
        if let Some(scan) = &mut seen.scan
            && update(scan)
        {
            self.send("progress", &scan.progress());
        }
    }

    /// The air was measured.
    pub fn show_air(&self, air: Vec<AirRow>) {
        let mut seen = self.seen();
        if let Some(scan) = &mut seen.scan
            && scan.set_air(air)
        {
            self.send("air", &scan.air());
        }
    }

    /// Reads the shown scan.
    pub fn with_scan<T>(&self, read: impl FnOnce(Option<&ScanView>) -> T) -> T {
        read(self.seen().scan.as_ref())
    }

    /// The rig under hand has changed.
    pub fn show_hand(&self, hand: HandState) {
        let mut seen = self.seen();
        if seen.hand != hand {
            self.send("hand", &hand);
            seen.hand = hand;
        }
    }

    /// Reads or changes the controls; a change is sent.
    pub fn lease<T>(&self, act: impl FnOnce(&mut Lease) -> T) -> T {
        let mut seen = self.seen();
        let result = act(&mut seen.lease);
        self.send("lease", &seen.lease);
        result
    }

    /// Whether a session has the controls.
    pub fn has_controls(&self, id: u64) -> bool {
        self.seen().lease.is_held_by(id)
    }

    /// Whether an admin is about to take the controls.
    pub fn lease_is_taken(&self) -> bool {
        self.seen().lease.is_being_taken()
    }

    /// The queue has changed.
    pub fn show_queue(&self, queue: Value) {
        let mut seen = self.seen();
        self.send("queue", &queue);
        seen.queue = queue;
    }

    /// Adds a line to the log.
    pub fn note(&self, text: impl Into<String>) {
        self.note_at(Timestamp::now(), text);
    }

    /// Adds a line with its time.
    pub fn note_at(&self, at: Timestamp, text: impl Into<String>) {
        let text = text.into();
        let line = Line { at, text: fieldgap_input::visible_line(&text).into_owned() };
        let mut seen = self.seen();
        self.send("line", &line);
        if seen.lines.len() == KEPT_LINES {
            seen.lines.pop_front();
        }
        seen.lines.push_back(line);
    }
}
