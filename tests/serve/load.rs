//! Many viewers, many connections, long scans.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

use serde_json::Value;

use crate::served::{self, Served};

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
