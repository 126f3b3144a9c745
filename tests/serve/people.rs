//! Who is let in, and who has the controls.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::served::{self, Served, Session};

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
