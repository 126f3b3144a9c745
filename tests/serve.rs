//! `fieldgap serve` with a virtual rig, by its interface for programs: scans, STOP, operation by hand, several people, hostile connections.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

use serde_json::Value;

mod served;

use served::{Served, Session, request};

fn place(state: &Value) -> f64 {
    state["hand"]["at_mm"][0].as_f64().expect("a place")
}

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
    assert!(took < Duration::from_millis(100), "{took:?} from the press to the wire");
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
fn a_jog_ends_without_heartbeats_and_refusals_have_their_reason() {
    let served = Served::begin("{ times = 1.0 }");
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    desk.post("/api/hand/open", "");
    let order = |body: &str| desk.ask("POST", "/api/hand/order", body);
    let (status, refusal) = order("{\"order\":\"step\",\"axis\":\"x\",\"by_mm\":1.0}");
    assert_eq!(
        (status, refusal["error"].as_str()),
        (409, Some("the robot must home before its first move"))
    );
    assert_eq!(order("{\"order\":\"home\"}").0, 200);
    let (status, refusal) = order("{\"order\":\"go\",\"to_mm\":[0.0,0.0,900.0]}");
    assert!(
        status == 409
            && refusal["error"].as_str().is_some_and(|error| error.contains("outside its travel")),
        "{refusal}"
    );
    assert_eq!(order("{\"order\":\"go\",\"to_mm\":[0.0,0.0,120.0]}").0, 200);

    let beat = "{\"order\":\"jog\",\"hold\":7,\"axis\":\"x\",\"speed_mm_s\":20.0}";
    let held = Instant::now();
    while held.elapsed() < Duration::from_millis(600) {
        desk.post("/api/hand/jog", beat);
        std::thread::sleep(Duration::from_millis(60));
    }
    // The connection is cut: no release is sent.
    let cut = Instant::now();
    let stood = desk.until("standing", |state| state["hand"]["doing"] == "stands still");
    // Up to the end of the heartbeats and of one short move; a busy computer is later in asking, never in stopping.
    let most = 20.0 * (held.elapsed().as_secs_f64() + 0.1);
    assert!(
        place(&stood) > 3.0 && place(&stood) <= most,
        "{} mm, {:?} after the cut",
        place(&stood),
        cut.elapsed()
    );
    std::thread::sleep(Duration::from_millis(400));
    assert_eq!(place(&desk.get("/api/state")), place(&stood));
    desk.post("/api/hand/jog", beat);
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(place(&desk.get("/api/state")), place(&stood), "a late heartbeat starts nothing");

    // A focus ends by its timer, and when the controls are released.
    assert_eq!(
        order("{\"order\":\"focus\",\"at_mm\":[0.0,0.0,100.0],\"seconds\":1,\"continuous\":true}")
            .0,
        200
    );
    let emits = desk.until("emitting", |state| state["hand"]["focus_mm"].is_array());
    assert_eq!(emits["hand"]["seconds_left"], 1);
    desk.until("silent", |state| state["hand"]["focus_mm"].is_null());
    desk.post("/api/controls/release", "");
    assert_eq!(desk.get("/api/state")["hand"]["open"], false);
}

#[test]
fn two_people_never_hold_the_controls_at_once() {
    let served = Served::begin("\"lockstep\"");
    let desk = served.log_in();
    let people: Vec<Session> = (0..8)
        .map(|n| {
            let link = desk
                .post("/api/links", &format!("{{\"name\":\"person {n}\",\"role\":\"operator\"}}"));
            Session::by(
                served.port,
                link["path"].as_str().and_then(|path| path.split_once('=')).expect("a link").1,
            )
        })
        .collect();
    for _ in 0..5 {
        let tries: Vec<_> = people
            .iter()
            .cloned()
            .map(|person| {
                std::thread::spawn(move || (person.ask("POST", "/api/controls/take", "").0, person))
            })
            .collect();
        let taken: Vec<Session> = tries
            .into_iter()
            .filter_map(|tried| {
                let (status, person) = tried.join().expect("no panic");
                (status == 200).then_some(person)
            })
            .collect();
        assert_eq!(taken.len(), 1);
        assert_eq!(desk.get("/api/state")["lease"]["holder"]["id"], taken[0].id);
        taken[0].post("/api/controls/release", "");
    }
}

#[test]
fn a_scan_does_not_notice_a_thousand_half_open_connections() {
    let served = Served::begin("{ times = 20.0 }");
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    desk.start_look();
    desk.until("measuring", |state| state["scan"]["done"].as_u64() > Some(3));
    let mut half_open: Vec<TcpStream> = (0..1000)
        .map(|n| {
            let mut stream = TcpStream::connect(("127.0.0.1", served.port)).expect("it listens");
            stream
                .write_all(if n % 2 == 0 { b"POST /api/stop HTTP/1.1\r\nHo" } else { b"" })
                .expect("it takes it");
            stream
        })
        .collect();
    let asked = Instant::now();
    desk.get("/api/state");
    assert!(asked.elapsed() < Duration::from_secs(1), "{:?} for an answer", asked.elapsed());
    desk.until("done", |state| state["scan"]["done"] == 171);
    // The server closes those that say nothing.
    let first = &mut half_open[0];
    first.set_read_timeout(Some(served::PATIENCE)).expect("set");
    let mut rest = Vec::new();
    let _ = first.read_to_end(&mut rest);
    desk.until("reported", |state| state["scan"]["has_report"] == true);
}

#[test]
fn twenty_viewers_see_each_reading_soon_after_it_is_journalled() {
    let served = Served::begin("{ times = 20.0 }");
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    let viewers: Vec<_> = (0..20)
        .map(|_| {
            let (port, cookie) = (served.port, desk.cookie.clone());
            std::thread::spawn(move || watched_rows(port, &cookie))
        })
        .collect();
    desk.until("watched", |state| state["viewers"] == 20);
    desk.start_look();
    let written = served::written(&served.records().join("look/journal.csv"), 171);
    let mut late_ms: Vec<f64> = viewers
        .into_iter()
        .flat_map(|viewer| viewer.join().expect("no panic"))
        .map(|(row, seen)| {
            seen.duration_since(written[row]).unwrap_or_default().as_secs_f64() * 1e3
        })
        .collect();
    assert_eq!(late_ms.len(), 20 * 171);
    late_ms.sort_by(f64::total_cmp);
    let at = |share: f64| late_ms[(share * (late_ms.len() - 1) as f64) as usize];
    eprintln!(
        "from the journal to 20 viewers: median {:.0} ms, 95 % {:.0} ms, longest {:.0} ms",
        at(0.5),
        at(0.95),
        at(1.0)
    );
    // The bar is 200 ms; a busy computer that runs other tests may take longer, a lost reading never comes.
    assert!(at(0.5) < 200.0, "median {:.0} ms", at(0.5));
}

/// The rows that a viewer is sent, with the time of each, until the last.
fn watched_rows(port: u16, cookie: &str) -> Vec<(usize, SystemTime)> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
    stream.set_read_timeout(Some(served::PATIENCE)).expect("set");
    let head =
        format!("GET /api/live HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nCookie: {cookie}\r\n\r\n");
    stream.write_all(head.as_bytes()).expect("it takes it");
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(stream));
    let (mut rows, mut kind) = (Vec::new(), String::new());
    while rows.len() < 171 {
        let line = lines.next().expect("more").expect("text");
        if let Some(event) = line.strip_prefix("event: ") {
            kind = event.to_owned();
        } else if let Some(data) = line.strip_prefix("data: ") {
            let value: Value = serde_json::from_str(data).expect("JSON");
            let readings = match kind.as_str() {
                "readings" => value.as_array().cloned(),
                "all" | "scan" => {
                    value["scan"]["readings"].as_array().or(value["readings"].as_array()).cloned()
                }
                _ => None,
            };
            let now = SystemTime::now();
            let new = readings
                .into_iter()
                .flatten()
                .map(|reading| (reading[0].as_u64().expect("a row") as usize, now));
            rows.extend(new);
        }
    }
    rows
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

/// A session of somebody whom an admin invites.
fn invited(served: &Served, admin: &Session, role: &str) -> Session {
    let link = admin.post("/api/links", &format!("{{\"name\":\"visitor\",\"role\":\"{role}\"}}"));
    let path = link["path"].as_str().and_then(|path| path.split_once('='));
    Session::by(served.port, path.expect("a link").1)
}

#[test]
fn a_reading_and_the_beam_axis_are_found_by_hand_and_a_stop_ends_the_search() {
    let served = Served::begin("{ times = 20.0 }");
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    desk.post("/api/hand/open", "");
    let order = |body: &str| desk.ask("POST", "/api/hand/order", body);
    let search = "{\"order\":\"find-axis\",\"heights_mm\":[140.0,80.0],\"reach_mm\":15.0}";
    let (status, refusal) = order(search);
    assert_eq!(
        (status, refusal["error"].as_str()),
        (409, Some("the robot must home before its first move"))
    );
    assert_eq!(order("{\"order\":\"home\"}").0, 200);
    for wrong in ["[]", "[0.0]", "[-80.0]", "[1e9]"] {
        let (status, refusal) = order(&search.replace("[140.0,80.0]", wrong));
        assert_eq!(status, 409, "{wrong}: {refusal}");
    }
    assert_eq!(order("{\"order\":\"sample\",\"samples\":0}").0, 409);
    assert_eq!(order("{\"order\":\"sample\",\"samples\":500}").0, 200);
    let read = desk.until("read", |state| state["hand"]["sample"].is_object());
    assert_eq!(read["hand"]["sample"]["count"], 500);
    let (status, refusal) = order(search);
    assert_eq!(status, 200, "{refusal}");
    let state = desk.get("/api/state");
    let axis = state["hand"]["axis"].as_str().expect("an axis");
    assert!(axis.contains("80.0") && axis.contains("140.0"), "{axis}");
    assert!(
        state["hand"]["focus_mm"].is_null() && state["hand"]["doing"] == "stands still",
        "{state}"
    );
    assert!(state["lines"].to_string().contains("beam at z = 140.0 mm"), "{state}");

    // A second search is stopped by somebody else in its middle.
    let visitor = invited(&served, &desk, "viewer");
    let searching = std::thread::spawn({
        let (desk, search) = (desk.clone(), search.replace("15.0", "40.0"));
        move || desk.ask("POST", "/api/hand/order", &search)
    });
    desk.until("searching", |state| state["hand"]["doing"] == "searches for the beam");
    let left = visitor.post("/api/stop", "")["left"].to_string();
    assert!(left.contains("the array is silent, the robot stands still"), "{left}");
    let (status, refusal) = searching.join().expect("no panic");
    assert_eq!((status, refusal["error"].as_str()), (409, Some("stopped")));
    assert_eq!(desk.get("/api/state")["hand"]["doing"], "must home: it was stopped");
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

const PASSWORD: &str = "nine white horses";

/// The answer of curl, which trusts the server's certificate alone: its head and body.
fn curl(served: &Served, path: &str, more: &[&str]) -> Option<String> {
    let certificate = served.home.path().join("settings/fieldgap/certificate.pem");
    let mut command = std::process::Command::new("curl");
    command.args(["-si", "--cacert"]).arg(certificate).args(more);
    let Ok(done) = command.arg(format!("{}{path}", served.address())).output() else {
        eprintln!("skipped: curl is not installed");
        return None;
    };
    Some(String::from_utf8_lossy(&done.stdout).into_owned())
}

#[test]
fn other_computers_are_let_in_by_password_over_tls_alone() {
    let served = Served::to_others(PASSWORD);
    let log_in = |name: &str, password: &str| {
        let body = format!("{{\"name\":\"{name}\",\"password\":\"{password}\"}}");
        curl(&served, "/api/session", &["-d", &body])
    };
    let Some(answer) = log_in("Ada", PASSWORD) else { return };
    assert!(answer.starts_with("HTTP/1.1 200") && answer.contains("; Secure"), "{answer}");
    for (name, password) in [("Ada", "nine white horsez"), ("Bob", PASSWORD), ("", "")] {
        let answer = log_in(name, password).expect("curl is there");
        assert!(answer.starts_with("HTTP/1.1 403"), "{answer}");
        assert!(answer.contains("name or password are wrong"), "{answer}");
    }
    // Without encryption there is no answer, under another name a refusal.
    let mut plain = TcpStream::connect(("127.0.0.1", served.port)).expect("it listens");
    let request = format!("GET / HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", served.port);
    plain.write_all(request.as_bytes()).expect("it takes it");
    let mut answer = Vec::new();
    let _ = plain.read_to_end(&mut answer);
    assert!(!answer.starts_with(b"HTTP"), "{answer:?}");
    let renamed = curl(&served, "/", &["-H", "Host: evil.example"]).expect("curl is there");
    assert!(renamed.starts_with("HTTP/1.1 403"), "{renamed}");
    // What the program says of its certificate is what another program finds.
    let certificate = served.home.path().join("settings/fieldgap/certificate.pem");
    let mut openssl = std::process::Command::new("openssl");
    openssl.args(["x509", "-noout", "-fingerprint", "-sha256", "-in"]).arg(certificate);
    match openssl.output() {
        Ok(found) => {
            let found = String::from_utf8_lossy(&found.stdout).trim().to_owned();
            let fingerprint = found.split_once('=').expect("a fingerprint").1;
            assert!(served.said.contains(fingerprint), "{found}: {}", served.said);
        }
        Err(_) => eprintln!("not compared: openssl is not installed"),
    }
}

#[test]
fn a_removed_user_is_logged_out() {
    let served = Served::to_others(PASSWORD);
    let jar = served.home.path().join("cookies");
    let jar = jar.to_str().expect("text");
    let body = format!("{{\"name\":\"Ada\",\"password\":\"{PASSWORD}\"}}");
    if curl(&served, "/api/session", &["-c", jar, "-d", &body]).is_none() {
        return;
    }
    let state = || curl(&served, "/api/state", &["-b", jar]).expect("curl is there");
    assert!(state().starts_with("HTTP/1.1 200"));
    let mut remove = served::fieldgap(served.home.path());
    assert!(remove.args(["serve", "user", "remove", "Ada"]).status().expect("it runs").success());
    let begun = Instant::now();
    while !state().starts_with("HTTP/1.1 401") {
        assert!(begun.elapsed() < served::PATIENCE, "she still looks");
        std::thread::sleep(Duration::from_millis(50));
    }
    let again = curl(&served, "/api/session", &["-d", &body]).expect("curl is there");
    assert!(again.starts_with("HTTP/1.1 403"), "{again}");
}

#[test]
fn nobody_is_let_in_without_users() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/virtual.toml");
    let mut serve = served::fieldgap(home.path());
    let refused = serve.arg("serve").arg(rig).args(["--listen", "0.0.0.0:0"]).output();
    let refused = refused.expect("it runs");
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(refused.status.code() == Some(1) && refused.stdout.is_empty(), "{said}");
    assert!(said.contains("there are no users in"), "{said}");
    assert!(said.contains("fieldgap serve user add"), "{said}");
}

#[test]
#[ignore = "takes minutes, and measures on a quiet computer"]
fn a_scan_with_twenty_viewers_takes_as_long_as_without_a_server() {
    let mut ratios = Vec::new();
    for _ in 0..5 {
        let served = Served::begin("{ times = 4.0 }");
        let mut run = served::fieldgap(served.home.path());
        run.args(["run", "scans/look.toml", "--rig", "rig.toml", "--out", "alone", "--yes"]);
        assert!(run.output().expect("it runs").status.success());
        let alone = measured_s(&served.home.path().join("alone"));
        let desk = served.log_in();
        desk.post("/api/controls/take", "");
        let viewers: Vec<TcpStream> =
            (0..20).map(|_| watching(served.port, &desk.cookie)).collect();
        desk.start_look();
        desk.until("reported", |state| {
            state["scan"]["has_report"] == true && state["queue"]["running"].is_null()
        });
        let watched = measured_s(&served.records().join("look"));
        drop(viewers);
        eprintln!("alone {alone:.2} s, with a server and twenty viewers {watched:.2} s");
        ratios.push(watched / alone);
    }
    ratios.sort_by(f64::total_cmp);
    eprintln!("with a server and twenty viewers, against alone: {ratios:.4?}");
    assert!(ratios[2] < 1.01, "{ratios:?}");
}

/// Time from the first to the last event of a scan, by the computer's clock, s.
fn measured_s(record: &Path) -> f64 {
    let text = std::fs::read_to_string(record.join("events.jsonl")).expect("events");
    let at = |line: Option<&str>| -> jiff::Timestamp {
        let event: Value = serde_json::from_str(line.expect("a line")).expect("JSON");
        event["at"].as_str().and_then(|at| at.parse().ok()).expect("a time")
    };
    at(text.lines().next_back()).duration_since(at(text.lines().next())).as_secs_f64()
}

/// Largest growth of the server from 20,000 to 100,000 readings, KiB: the readings themselves have 72 bytes each (6 MiB), a vector that grows
/// has twice that, and five pages that open are each sent everything (10 MiB of text).
const GROWTH_KIB: u64 = 64 << 10;

#[test]
#[ignore = "takes minutes: a scan of 100,000 readings"]
fn a_long_scan_with_viewers_who_come_and_go_needs_no_more_memory() {
    let served = Served::begin("\"lockstep\"");
    let planes: String = (0..5)
        .map(|n| {
            format!("[[plane]]\nz_mm = {}.0\nsize_mm = [70.5, 70.5]\nstep_mm = 0.5\n", 80 + 10 * n)
        })
        .collect();
    let plan = std::fs::read_to_string(served.home.path().join("scans/look.toml")).expect("a plan");
    let plan = format!("{}{planes}", plan.split("[[plane]]").next().expect("its beginning"));
    std::fs::write(served.home.path().join("scans/look.toml"), plan).expect("written");
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    desk.start_look();
    let of =
        desk.until("begun", |state| state["scan"]["of"].as_u64() > Some(100_000))["scan"]["of"]
            .as_u64()
            .expect("a number");
    let (mut at_20_000, mut largest, mut opened) = (None, 0, 0);
    let begun = Instant::now();
    loop {
        // Five viewers who stay for half a second.
        let viewers: Vec<TcpStream> = (0..5).map(|_| watching(served.port, &desk.cookie)).collect();
        std::thread::sleep(Duration::from_millis(500));
        viewers
            .iter()
            .for_each(|viewer| viewer.shutdown(std::net::Shutdown::Both).expect("closed"));
        opened += 5;
        let done = desk.get("/api/state")["scan"]["done"].as_u64().expect("a number");
        let now = served.resident_kib();
        if done > 20_000 {
            at_20_000.get_or_insert(now);
        }
        largest = largest.max(now);
        if done == of {
            break;
        }
        assert!(begun.elapsed() < Duration::from_secs(1800), "{done} of {of}");
    }
    let first = at_20_000.expect("it was long");
    eprintln!(
        "{of} readings in {:.0} s, {opened} pages opened: {first} KiB at 20,000 readings, at most {largest} KiB",
        begun.elapsed().as_secs_f64()
    );
    assert!(largest <= first + GROWTH_KIB, "{first} KiB grew to {largest} KiB");
    let journal =
        std::fs::read_to_string(served.records().join("look/journal.csv")).expect("a journal");
    assert_eq!(journal.lines().count() as u64, of + 1);
    desk.post("/api/stop", "");
}

/// A viewer who reads what is sent, until dropped.
fn watching(port: u16, cookie: &str) -> TcpStream {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
    let head =
        format!("GET /api/live HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nCookie: {cookie}\r\n\r\n");
    stream.write_all(head.as_bytes()).expect("it takes it");
    let mut reads = stream.try_clone().expect("a second handle");
    std::thread::spawn(move || {
        let mut part = [0; 1 << 16];
        while reads.read(&mut part).is_ok_and(|read| read > 0) {}
    });
    stream
}
