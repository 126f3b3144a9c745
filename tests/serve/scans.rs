//! Scans from their plans to their reports, and what is done with the records.

use std::path::Path;
use std::time::{Duration, SystemTime};

use serde_json::Value;

use crate::served::{self, Served, Session, request};

#[test]
fn a_scan_runs_from_its_plan_to_its_report() {
    let served = Served::begin("\"lockstep\"");
    let desk = served.log_in();
    let digest = desk.get("/api/plans/look")["digest"].clone();
    let start = |digest: &str| format!("{{\"plan\":\"look\",\"digest\":\"{digest}\"}}");
    let (status, refusal) =
        desk.ask("POST", "/api/scans", &start(digest.as_str().expect("a digest")));
    assert_eq!(status, 409, "without the controls: {refusal}");
    desk.post("/api/controls/take", "");
    let (status, refusal) = desk.ask("POST", "/api/scans", &start("of-another-plan"));
    assert_eq!(
        (status, refusal["error"].as_str()),
        (409, Some("the plan or the rig file was changed since it was shown"))
    );
    desk.start_look();
    desk.start_look();
    let state = desk.until("done", |state| {
        state["queue"]["running"].is_null()
            && state["scan"]["has_report"] == true
            && state["scan"]["folder"] == "look-2"
    });
    assert_eq!((&state["scan"]["done"], &state["scan"]["of"]), (&171.into(), &171.into()));
    for record in ["look", "look-2"] {
        let path = format!("/view/{}/{record}/report/index.html", desk.view_key);
        let (status, head, page) = request(served.port, "GET", &path, &[], "");
        assert_eq!(status, 200);
        assert!(head.contains("sandbox") && page.contains("</html>"));
    }
    let listed = desk.get("/api/records");
    assert!(listed.as_array().is_some_and(
        |records| records.len() == 2 && records.iter().all(|record| record["report"] == true)
    ));
}

#[test]
fn a_scan_pauses_continues_and_stops_at_once() {
    let served = Served::begin("{ times = 20.0 }");
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    desk.start_look();
    desk.until("measuring", |state| state["scan"]["done"].as_u64() > Some(3));
    desk.post("/api/scans/pause", "");
    let paused = desk.until("paused", |state| state["scan"]["stage"] == "paused");
    desk.post("/api/scans/continue", "");
    desk.until("going on", |state| {
        state["scan"]["stage"] == "scanning"
            && state["scan"]["done"].as_u64() > paused["scan"]["done"].as_u64()
    });

    // A viewer stops it; the time from the press to the command on the wire of the array.
    let link = desk.post("/api/links", "{\"name\":\"visitor\",\"role\":\"viewer\"}");
    let visitor = Session::by(
        served.port,
        link["path"].as_str().and_then(|path| path.split_once('=')).expect("a link").1,
    );
    assert_eq!(visitor.ask("POST", "/api/scans/pause", "").0, 403);
    let pressed = SystemTime::now();
    let left = visitor.post("/api/stop", "");
    assert!(
        left["left"]
            .as_str()
            .is_some_and(|left| left.contains("the array is silent, the robot stands still")),
        "{left}"
    );
    let sent = last_sent(&served.records().join("look/wire/focus-array.log"));
    let took = sent.duration_since(pressed).unwrap_or_default();
    // The goal is 100 ms on a quiet computer; this one runs other tests.
    assert!(took < Duration::from_secs(3), "{took:?} from the press to the wire");
    eprintln!("from the press of STOP to the command on the array's wire: {took:?}");
    let state = desk.until("ended", |state| state["scan"]["stage"] == "ended");
    assert!(state["queue"]["held"] == true && state["scan"]["reason"].is_string(), "{state}");
    let audit = std::fs::read_to_string(served.records().join("audit.jsonl")).expect("a log");
    assert!(
        audit.lines().any(|line| line.contains("\"visitor\"") && line.contains("POST /api/stop")),
        "{audit}"
    );
}

/// When the last line was sent on a wire: its first line has the time of the beginning, each line the seconds since.
fn last_sent(log: &Path) -> SystemTime {
    let text = std::fs::read_to_string(log).expect("a wire log");
    let seconds = |line: &str| {
        line.split(' ').next().and_then(|word| word.parse::<f64>().ok()).expect("seconds")
    };
    let opened = text.lines().find(|line| line.contains(" @ ")).expect("its beginning");
    let began: jiff::Timestamp =
        opened.split(' ').nth(3).and_then(|at| at.parse().ok()).expect("a time");
    let silenced = text
        .lines()
        .rfind(|line| line.contains(" > ") && line.contains(" off"))
        .expect("a line was sent");
    SystemTime::from(began) + Duration::from_secs_f64(seconds(silenced) - seconds(opened))
}

#[test]
fn a_scan_outlives_a_killed_server_and_is_seen_by_the_next() {
    let mut served = Served::begin("{ times = 20.0 }");
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    desk.start_look();
    let before = desk.until("measuring", |state| state["scan"]["done"].as_u64() > Some(3));
    served.kill_and_restart();
    assert_eq!(desk.ask("GET", "/api/state", "").0, 401, "a session ends with its server");
    let desk = served.log_in();
    let after = desk.until("seen again", |state| {
        state["scan"]["done"].as_u64() > before["scan"]["done"].as_u64()
    });
    assert_eq!(after["scan"]["folder"], "look");
    // The new server stops what the old one started.
    let left = desk.post("/api/stop", "");
    assert!(
        left["left"].as_str().is_some_and(|left| left.contains("the robot stands still")),
        "{left}"
    );
}

#[test]
fn a_rig_file_is_corrected_in_a_new_file_after_its_lines_were_shown() {
    let served = Served::withheld();
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    desk.start_look();
    desk.until("reported", |state| {
        state["scan"]["has_report"] == true && state["queue"]["running"].is_null()
    });
    let record = desk.get("/api/records")[0]["folder"].as_str().expect("a name").to_owned();
    let files = || {
        let files = std::fs::read_dir(served.home.path()).expect("a folder");
        files
            .map(|file| file.expect("a file").file_name())
            .collect::<std::collections::BTreeSet<_>>()
    };
    let rig = || std::fs::read_to_string(served.home.path().join("rig.toml")).expect("a rig file");
    let (files_before, rig_before) = (files(), rig());
    let path = format!("/api/records/{record}/correction");
    let shown = desk.post(&path, "{\"keep\":false}");
    let lines = shown["lines"].to_string();
    assert!(lines.contains("spacing_mm = 0.0") && lines.contains("pitch.ratio"), "{shown}");
    assert_eq!(
        (files(), &shown["file"]),
        (files_before.clone(), &Value::Null),
        "what is only shown is not kept"
    );
    let kept = desk.post(&path, "{\"keep\":true}");
    assert_eq!((&kept["file"], &kept["lines"]), (&"rig-corrected.toml".into(), &shown["lines"]));
    let corrected =
        fieldgap::rig_file::RigFile::read(&served.home.path().join("rig-corrected.toml"))
            .expect("a rig file");
    let pitch = |elements: &[fieldgap::acoustics::Element]| {
        (elements[1].centre_m - elements[0].centre_m).norm()
    };
    // The file holds what is said of it; what the rig's truth is, is sealed.
    let said = kept["said"][0].as_str().expect("a text");
    let ratio: f64 = said
        .split("pitch.ratio = ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next()?.parse().ok())
        .expect("a ratio");
    let found = pitch(corrected.setup.nominal_array().elements()) / 0.0105;
    assert!((found - ratio).abs() < 1e-5 && found > 1.01, "{found} for {said}");
    assert_eq!(rig(), rig_before, "the rig file itself was changed");
    for wrong in ["no-such-record", "..", "%2e%2e"] {
        assert_eq!(
            desk.ask("POST", &format!("/api/records/{wrong}/correction"), "{\"keep\":true}").0,
            404,
            "{wrong}"
        );
    }
}

#[test]
fn the_program_of_the_documentation_runs() {
    if std::process::Command::new("curl").arg("--version").output().is_err() {
        eprintln!("skipped: curl is not installed");
        return;
    }
    let repository = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(repository.join("docs/serve.md")).expect("a page");
    let program = page
        .split("```bash\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .expect("a program");
    let home = tempfile::tempdir().expect("a folder");
    for folder in ["rigs", "scans"] {
        std::os::unix::fs::symlink(repository.join(folder), home.path().join(folder))
            .expect("linked");
    }
    let fieldgap = Path::new(env!("CARGO_BIN_EXE_fieldgap")).parent().expect("a folder");
    let paths = format!("{}:{}", fieldgap.display(), std::env::var("PATH").expect("set"));
    let done = std::process::Command::new("bash")
        .args(["-eu", "-c", program])
        .current_dir(home.path())
        .env("PATH", paths)
        .output()
        .expect("bash");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let report = std::fs::read_to_string(home.path().join("report.html")).expect("a report");
    assert!(report.contains("</html>"));
}

#[test]
fn notes_are_kept_with_the_record() {
    let served = Served::begin("\"lockstep\"");
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    desk.start_look();
    desk.until("reported", |state| {
        state["scan"]["has_report"] == true && state["queue"]["running"].is_null()
    });
    desk.post("/api/records/look/notes", "{\"text\":\"swapped the preamplifier\"}");
    let note = |words: &[&str]| {
        let mut command = served::fieldgap(served.home.path());
        command.arg("note").args(words).output().expect("it runs")
    };
    assert!(note(&["out/look", "new cable", "--by", "Bob"]).status.success());
    let notes = desk.get("/api/records/look/notes");
    assert_eq!(desk.get("/api/records")[0]["notes"], notes);
    let said = |n: usize, key: &str| notes[n][key].as_str().expect("a text").to_owned();
    assert_eq!([said(0, "who"), said(0, "text")], ["desk", "swapped the preamplifier"]);
    assert_eq!([said(1, "who"), said(1, "text")], ["Bob", "new cable"]);
    assert_eq!(desk.ask("POST", "/api/records/look/notes", "{\"text\":\" \"}").0, 400);
    assert_eq!(desk.ask("POST", "/api/records/none/notes", "{\"text\":\"a\"}").0, 404);
    let printed = note(&["out/look"]).stdout;
    assert!(String::from_utf8_lossy(&printed).contains("Bob: new cable"));
    let nowhere = note(&["out", "new cable", "--by", "Bob"]);
    assert_eq!(nowhere.status.code(), Some(1), "a note goes to a record");
}
