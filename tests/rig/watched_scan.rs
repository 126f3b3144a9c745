//! Watched and unattended scans: the view in a terminal, the hooks, the reference point revisited by time.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use fieldgap::records::{EventKind, RecordedScan, read_events};
use rustix::process::{Pid, Signal, kill_process};

use crate::repository::{fieldgap, here, virtual_rig};
use crate::script::write_script;
use crate::terminal::{Terminal, shown};

/// Longest wait.
const PATIENCE: Duration = Duration::from_secs(60);

const PLAN: &str = r#"
name = "watched"
[simulator]
model = "corrected"
[[focus]]
x_mm = 5.0
y_mm = -5.0
z_mm = 100.0
[[plane]]
z_mm = 100.0
size_mm = [30.0, 30.0]
step_mm = 2.0
"#;

/// A plan, and a virtual rig at a multiple of real time, or in lockstep.
fn plan_and_rig(home: &Path, plan: &str, pace: &str) -> (PathBuf, PathBuf) {
    let (plan_path, rig_path) = (home.join("plan.toml"), home.join("rig.toml"));
    std::fs::write(&plan_path, plan).expect("it is written");
    std::fs::write(&rig_path, virtual_rig(pace)).expect("it is written");
    (plan_path, rig_path)
}

fn scan(plan: &Path, rig: &Path, folder: &Path) -> Command {
    let mut command = fieldgap();
    command.arg("scan").arg(plan).arg("--rig").arg(rig).arg("--out").arg(folder).arg("--trust");
    command
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A program on its own terminal, with standard error separate.
struct OnTerminal {
    child: Child,
    keys: File,
    shown: Receiver<Vec<u8>>,
    logged: Receiver<String>,
    all_shown: Vec<u8>,
    order: String,
}

impl OnTerminal {
    fn begin(mut command: Command) -> Self {
        let terminal = Terminal::of_width(80);
        let mut child = command
            .stdin(terminal.end())
            .stdout(terminal.end())
            .stderr(Stdio::piped())
            .env("FIELDGAP_LOG", "debug")
            .env("TERM", "xterm-256color")
            .spawn()
            .expect("it starts");
        let shown = shown(&terminal.face);
        let keys = terminal.face;
        let (log, logged) = channel();
        let lines = BufReader::new(child.stderr.take().expect("it is piped")).lines();
        std::thread::spawn(move || {
            lines.map_while(Result::ok).try_for_each(|line| log.send(line).ok())
        });
        Self { child, keys, shown, logged, all_shown: Vec::new(), order: String::new() }
    }

    /// Reads the screen until a word is shown. The screen is drawn in pieces, so that the text must be a single word.
    fn until_shown(&mut self, word: &str) {
        let begun = Instant::now();
        let from = self.all_shown.len();
        while !String::from_utf8_lossy(&self.all_shown[from..]).contains(word) {
            assert!(begun.elapsed() < PATIENCE, "`{word}` was never shown");
            if let Ok(bytes) = self.shown.recv_timeout(Duration::from_millis(100)) {
                self.all_shown.extend(bytes);
            }
        }
    }

    fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).expect("the terminal takes keys");
    }

    /// The last command sent to the array, once it is a silence command or the time is over.
    fn last_order(&mut self) -> String {
        let begun = Instant::now();
        loop {
            let lines = self.logged.try_iter();
            let sent = |line: &String| line.contains("focus array") && line.contains("sent=");
            self.order = lines.filter(sent).last().unwrap_or(std::mem::take(&mut self.order));
            if self.order.contains(" off*") || begun.elapsed() > PATIENCE {
                return self.order.clone();
            }
            std::thread::yield_now();
        }
    }
}

#[test]
fn a_watched_scan_pauses_continues_and_ends_by_keys() {
    let home = tempfile::tempdir().expect("a folder");
    let (plan, rig) = plan_and_rig(home.path(), PLAN, "{ times = 4.0 }");
    let folder = home.path().join("out");
    let mut command = scan(&plan, &rig, &folder);
    command.arg("--watch");
    let mut terminal = OnTerminal::begin(command);
    terminal.until_shown("pause");
    terminal.press("p");
    terminal.until_shown("PAUSED");
    assert!(terminal.last_order().contains(" off*"), "{}", terminal.last_order());
    let rows_then =
        std::fs::read_to_string(folder.join("samples.csv")).expect("kept").lines().count();
    terminal.press("r");
    terminal.until_shown("pause");
    terminal.press("ay");
    let status = terminal.child.wait().expect("it ends");
    assert_eq!(status.code(), Some(3));
    terminal.until_shown("\x1b[?1049l");
    let events = read_events(&folder).expect("they are kept");
    let kinds: Vec<EventKind> = events.iter().map(|event| event.kind).collect();
    for kind in [EventKind::Paused, EventKind::Continued, EventKind::Ended] {
        assert!(kinds.contains(&kind), "{kinds:?}");
    }
    let record = RecordedScan::open(&folder).expect("it is whole");
    assert!(record.samples.len() + 1 >= rows_then && record.samples.len() < 256);
    let state = std::fs::read_to_string(folder.join("state.toml")).expect("it is kept");
    assert!(state.contains("aborted from the keyboard: the array is silent"), "{state}");
}

#[test]
fn a_watched_loop_shows_its_sets_and_their_probabilities() {
    let home = tempfile::tempdir().expect("a folder");
    let region = PLAN.find("[[plane]]").expect("a plane");
    let in_loop = "[closed_loop]\nmin_mm = [-20.0, -20.0, 80.0]\nmax_mm = [20.0, 20.0, 130.0]\n\
                   first_readings = 120\nround_readings = 48\nsmallest_gap_sigma = 0.3\n";
    let plan = format!("{}{in_loop}", &PLAN[..region]);
    let (plan, rig) = plan_and_rig(home.path(), &plan, "\"lockstep\"");
    let folder = home.path().join("out");
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldgap"));
    command.args(["run", "--no-diagnose", "--watch", "--trust"]).arg(&plan).arg("--rig").arg(&rig);
    command.arg("--out").arg(&folder);
    let mut terminal = OnTerminal::begin(command);
    // Before the first search nothing is probable; after it the sets are, and the budget is counted.
    terminal.until_shown("evenly");
    terminal.until_shown("catalogue");
    terminal.press("ay");
    let status = terminal.child.wait().expect("it ends");
    assert!(matches!(status.code(), Some(0 | 3)), "{status}");
    let screen = String::from_utf8_lossy(&terminal.all_shown);
    assert!(screen.contains("1800"), "the budget of the plan");
}

#[test]
fn a_view_needs_a_terminal() {
    let home = tempfile::tempdir().expect("a folder");
    let (plan, rig) = plan_and_rig(home.path(), PLAN, "\"lockstep\"");
    let refused = scan(&plan, &rig, &home.path().join("out")).arg("--watch").output();
    let refused = refused.expect("it runs");
    assert_eq!(refused.status.code(), Some(1));
    assert!(said(&refused).contains("--watch needs a terminal"), "{}", said(&refused));
    assert!(!home.path().join("out").exists());
}

#[test]
fn hooks_of_plan_and_rig_run_and_a_missing_one_is_harmless() {
    let home = tempfile::tempdir().expect("a folder");
    let hooks = "[hooks]\non_finish = [\"./tell\", \"plan\"]\non_failure = \"./no-such-program\"\n";
    let (plan, rig) = plan_and_rig(home.path(), &format!("{PLAN}{hooks}"), "{ times = 20.0 }");
    let tell = home.path().join("tell");
    let script = "#!/bin/sh\ncd \"$(dirname \"$0\")\"\n\
                  echo \"$1 $FIELDGAP_EVENT $FIELDGAP_SCAN $FIELDGAP_MESSAGE\" > told\n";
    write_script(&tell, script);
    let folder = home.path().join("out");
    let done = scan(&plan, &rig, &folder).output().expect("it runs");
    assert!(done.status.success(), "{}", said(&done));
    let told = std::fs::read_to_string(home.path().join("told")).expect("the hook ran");
    assert_eq!(told, format!("plan finish {} complete: 256 points\n", folder.display()));

    // A terminated scan counts as a failure; its hook fails, too.
    let failing = home.path().join("failing");
    let mut failed = scan(&plan, &rig, &failing).arg("--json").spawn().expect("it runs");
    let mut lines = BufReader::new(failed.stdout.take().expect("it is piped")).lines();
    let begun = lines.find(|line| line.as_ref().is_ok_and(|line| line.contains("\"homed\"")));
    assert!(begun.is_some());
    let pid = Pid::from_raw(i32::try_from(failed.id()).expect("a number")).expect("not zero");
    kill_process(pid, Signal::TERM).expect("it is there");
    let hook = lines.find(|line| line.as_ref().is_ok_and(|line| line.contains("hook-failed")));
    let failed = failed.wait_with_output().expect("it ends");
    assert_eq!(failed.status.code(), Some(3), "{}", said(&failed));
    let hook = hook.expect("a word of the hook").expect("text");
    assert!(hook.contains("on_failure") && hook.contains("cannot be started"), "{hook}");
}

#[test]
fn programs_of_a_plan_run_only_if_they_are_trusted() {
    let home = tempfile::tempdir().expect("a folder");
    let told = home.path().join("told");
    let hooks = format!("[hooks]\non_finish = [\"touch\", \"{}\"]\n", told.display());
    let (plan, rig) = plan_and_rig(home.path(), &format!("{PLAN}{hooks}"), "\"lockstep\"");
    let folder = home.path().join("out");
    let scan = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_fieldgap"))
            .env("XDG_CONFIG_HOME", home.path())
            .args(arguments)
            .stdin(Stdio::null())
            .output()
            .expect("it runs")
    };
    let [plan, rig, out] = [&plan, &rig, &folder].map(|path| path.to_str().expect("text"));
    let refused = scan(&["scan", plan, "--rig", rig, "--out", out]);
    assert_eq!(refused.status.code(), Some(1), "{}", said(&refused));
    assert!(said(&refused).contains("--trust") && said(&refused).contains("on_finish: \"touch\""));
    assert!(!folder.exists() && !told.exists());
    let checked = scan(&["scan", plan, "--rig", rig, "--dry-run"]);
    assert!(said(&checked).contains("on_finish: \"touch\""), "{}", said(&checked));
    let done = scan(&["scan", plan, "--rig", rig, "--out", out, "--trust"]);
    assert!(done.status.success() && told.exists(), "{}", said(&done));
    // Looking at a record runs nothing.
    std::fs::remove_file(&told).expect("it is there");
    for command in ["replay", "compare", "diagnose"] {
        let looked = scan(&[command, out]);
        assert!(looked.status.success(), "{command}: {}", said(&looked));
        assert!(!told.exists(), "{command}");
    }
}

#[test]
fn the_reference_is_revisited_by_time_and_a_drift_is_reported() {
    let home = tempfile::tempdir().expect("a folder");
    let extra = "[reference]\nevery_min = 0.2\ndrift_percent = 1.0\n\
                 [hooks]\non_question = [\"sh\", \"-c\", \"echo \\\"$FIELDGAP_MESSAGE\\\" >> \\\"$0\\\"/told\", \"HOME\"]\n";
    let extra = extra.replace("\"HOME\"", &format!("'{}'", home.path().display()));
    let (plan, rig) = plan_and_rig(home.path(), &format!("{PLAN}{extra}"), "\"lockstep\"");
    let truth = std::fs::read_to_string(here("rigs/truth/thesis-lab.toml")).expect("it is there");
    let drifting = truth + "[effects.gain-drift]\nrelative = -0.1\nover_s = 60.0\n";
    std::fs::write(home.path().join("truth.toml"), drifting).expect("it is written");
    let text = std::fs::read_to_string(&rig).expect("it is there");
    let named = here("rigs/truth/thesis-lab.toml");
    std::fs::write(&rig, text.replace(&*named.to_string_lossy(), "truth.toml")).expect("written");
    let folder = home.path().join("out");
    let done = scan(&plan, &rig, &folder).output().expect("it runs");
    assert!(done.status.success(), "{}", said(&done));
    let record = RecordedScan::open(&folder).expect("it is whole");
    assert_eq!(record.samples.len(), 256, "revisits are no rows");
    let events = read_events(&folder).expect("they are kept");
    let of = |kind| events.iter().filter(|event| event.kind == kind).count();
    let took_s = record.samples.last().expect("rows").time_s;
    let due = (took_s / 12.0) as usize;
    assert!((due..=due + 2).contains(&of(EventKind::ReferenceChecked)), "{events:?}");
    assert!(of(EventKind::Question) >= 1, "{events:?}");
    let told = std::fs::read_to_string(home.path().join("told")).expect("somebody was told");
    assert!(told.contains("the level at the reference point is"), "{told}");
}

#[test]
fn a_terminal_that_takes_no_more_text_does_not_hold_up_a_scan() {
    let home = tempfile::tempdir().expect("a folder");
    let plan = PLAN.replace("step_mm = 2.0", "step_mm = 0.5");
    let (plan, rig) = plan_and_rig(home.path(), &plan, "\"lockstep\"");
    let folder = home.path().join("out");
    let terminal = Terminal::of_width(200);
    let mut command = scan(&plan, &rig, &folder);
    command.stdout(Stdio::null()).stderr(terminal.end()).env("TERM", "xterm-256color");
    let mut child = command.spawn().expect("it starts");
    let mut screen = terminal.face;
    let mut shown = Vec::new();
    let mut bytes = [0; 256];
    while !String::from_utf8_lossy(&shown).contains("points") {
        let count = screen.read(&mut bytes).expect("it writes");
        shown.extend_from_slice(&bytes[..count]);
    }
    // From here on nobody reads: after some pages the terminal takes no more.
    let begun = Instant::now();
    let complete = || {
        std::fs::read_to_string(folder.join("state.toml"))
            .is_ok_and(|state| state.contains("complete"))
    };
    while !complete() {
        let rows =
            std::fs::read_to_string(folder.join("samples.csv")).map_or(0, |s| s.lines().count());
        assert!(begun.elapsed() < PATIENCE, "it stands still behind {rows} rows");
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().expect("it can be ended, whether or not it waits for the terminal");
    child.wait().expect("it ends");
}
