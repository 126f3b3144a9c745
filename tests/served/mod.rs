//! A running `fieldgap serve` with a virtual rig, and requests to it.

// Each of the test programs that share this uses a part of it.
#![allow(dead_code)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

use serde_json::Value;
use tempfile::TempDir;

#[path = "../heard/mod.rs"]
mod heard;

use heard::Heard;

/// Longest wait.
pub const PATIENCE: Duration = Duration::from_secs(60);

const PLAN: &str = r#"
name = "look"
[simulator]
model = "corrected"
[[focus]]
x_mm = 5.0
y_mm = -5.0
z_mm = 100.0
[dark]
before = 2
[[plane]]
z_mm = 100.0
centre_mm = [5.0, -5.0]
size_mm = [24.0, 24.0]
step_mm = 2.0
"#;

pub struct Served {
    server: Child,
    pub home: TempDir,
    pub port: u16,
    pub secret: String,
    /// What was said at the start.
    pub said: String,
    listens: Vec<String>,
    /// The devices, where they are behind ports.
    rig: Option<Heard>,
}

/// A session, as a program has it that keeps the cookie.
#[derive(Clone)]
pub struct Session {
    port: u16,
    pub cookie: String,
    pub csrf: String,
    pub id: u64,
    pub view_key: String,
}

impl Served {
    /// Serves the virtual rig at a multiple of real time, or in lockstep.
    pub fn begin(pace: &str) -> Self {
        let rig = std::fs::read_to_string(here("rigs/virtual.toml")).expect("it is there");
        Self::with(&rig.replace("pace = \"lockstep\"", &format!("pace = {pace}")), PLAN)
    }

    /// Serves the rig of `rigs/withheld.toml`, whose field has an effect that its simulation lacks, with the plan of that name.
    pub fn withheld() -> Self {
        let text = |path: &str| std::fs::read_to_string(here(path)).expect("it is there");
        Self::with(&text("rigs/withheld.toml"), &text("scans/withheld-effect.toml"))
    }

    /// Serves a virtual rig whose gain drifts while it grows warmer, both measured.
    pub fn with_drift() -> Self {
        let text = |path: &str| std::fs::read_to_string(here(path)).expect("it is there");
        let sensor = "[environment]\nevery_s = 2.0\n[environment.lines]\npattern = \"T={temperature_c} RH={humidity_percent}\"\nask = \"R\"\n";
        let air = "[virtual.environment]\ntemperature_c = 22.0\nhumidity_percent = 40.0\nwarms_c_per_h = 36.0\n";
        let drift = "[effects.gain-drift]\nrelative = -0.05\nover_s = 60.0\n";
        let rig = text("rigs/virtual.toml").replace("truth/thesis-lab.toml", "drifting.toml");
        let rig = rig.replace("[virtual]  ", &format!("{sensor}[virtual]  "));
        let plan = PLAN.replace(
            "[dark]",
            "[reference]\nat_mm = [5.0, -5.0, 100.0]\nevery_points = 20\n[dark]",
        );
        let home = Self::folder(&format!("{rig}\n{air}"), &plan);
        let truth = text("rigs/truth/thesis-lab.toml");
        std::fs::write(home.path().join("drifting.toml"), format!("{truth}\n{drift}"))
            .expect("written");
        Self::start(home, &["--port", "0"])
    }

    /// Serves the rig of `rigs/levels.toml` as real devices, of which people hear the array.
    pub fn heard() -> Self {
        let rig = std::fs::read_to_string(here("rigs/levels.toml")).expect("it is there");
        let home = Self::folder("", PLAN);
        std::fs::remove_file(home.path().join("rig.toml")).expect("removed");
        std::fs::write(home.path().join("paced.toml"), rig).expect("written");
        let devices = Heard::behind(fieldgap(home.path()), home.path(), "paced.toml", "rig.toml");
        let mut served = Self::start(home, &["--port", "0"]);
        served.rig = Some(devices);
        served
    }

    /// Serves the virtual rig to other computers too, to a user Ada with a password.
    pub fn to_others(password: &str) -> Self {
        let rig = std::fs::read_to_string(here("rigs/virtual.toml")).expect("it is there");
        let home = Self::folder(&rig, PLAN);
        Self::add_user(home.path(), "Ada", "operator", password);
        Self::start(home, &["--listen", "127.0.0.1:0"])
    }

    /// Adds a user by the command for it.
    pub fn add_user(home: &Path, name: &str, role: &str, password: &str) {
        let mut command = fieldgap(home);
        command.args(["serve", "user", "add", name, "--role", role]).stdin(Stdio::piped());
        let mut adding = command.stderr(Stdio::null()).spawn().expect("it starts");
        let mut stdin = adding.stdin.take().expect("piped");
        stdin.write_all(password.as_bytes()).expect("it reads");
        drop(stdin);
        assert!(adding.wait().expect("it ends").success());
    }

    pub fn with(rig: &str, plan: &str) -> Self {
        Self::start(Self::folder(rig, plan), &["--port", "0"])
    }

    fn folder(rig: &str, plan: &str) -> TempDir {
        let home = tempfile::tempdir().expect("a folder");
        std::os::unix::fs::symlink(here("rigs/truth"), home.path().join("truth")).expect("linked");
        std::fs::create_dir(home.path().join("scans")).expect("made");
        std::fs::write(home.path().join("rig.toml"), rig).expect("written");
        std::fs::write(home.path().join("scans/look.toml"), plan).expect("written");
        home
    }

    fn start(home: TempDir, listens: &[&str]) -> Self {
        let (server, port, secret, said) = start(home.path(), listens);
        let listens = listens.iter().map(|word| word.replace(":0", &format!(":{port}"))).collect();
        Self { server, home, port, secret, said, listens, rig: None }
    }

    /// Kills the server and starts another on the same port and folder.
    pub fn kill_and_restart(&mut self) {
        self.kill();
        self.restart();
    }

    /// Starts another server on the same port and folder.
    pub fn restart(&mut self) {
        let port = self.port.to_string();
        let listens: Vec<&str> = self
            .listens
            .iter()
            .map(|word| if word == "0" { &port } else { word.as_str() })
            .collect();
        let (server, port, secret, _) = start(self.home.path(), &listens);
        assert_eq!(port, self.port);
        (self.server, self.secret) = (server, secret);
    }

    /// The number of the server's process.
    pub fn process(&self) -> u32 {
        self.server.id()
    }

    /// Kills the server, as a power failure would.
    pub fn kill(&mut self) {
        self.server.kill().expect("it is killed");
        self.server.wait().expect("it has ended");
    }

    /// Memory of the server, KiB.
    pub fn resident_kib(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.server.id()))
            .expect("its state");
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("its memory");
        line.split_whitespace().next().and_then(|kib| kib.parse().ok()).expect("a number")
    }

    pub fn records(&self) -> PathBuf {
        self.home.path().join("out")
    }

    /// Address of the page.
    pub fn address(&self) -> String {
        let scheme = if self.listens[0] == "--listen" { "https" } else { "http" };
        format!("{scheme}://127.0.0.1:{}", self.port)
    }

    pub fn link(&self) -> String {
        format!("{}/#link={}", self.address(), self.secret)
    }

    /// Logs in by the printed link.
    pub fn log_in(&self) -> Session {
        Session::by(self.port, &self.secret)
    }
}

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The program with settings of its own.
pub fn fieldgap(home: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldgap"));
    command.current_dir(home).env("XDG_CONFIG_HOME", home.join("settings"));
    command
}

fn start(home: &Path, listens: &[&str]) -> (Child, u16, String, String) {
    let says = home.join("says.txt");
    let mut server = fieldgap(home)
        .args(["serve", "rig.toml"])
        .args(listens)
        .stdout(Stdio::piped())
        .stderr(std::fs::File::create(&says).expect("made"))
        .spawn()
        .expect("it starts");
    let mut link = String::new();
    BufReader::new(server.stdout.take().expect("piped")).read_line(&mut link).expect("a line");
    let (address, secret) = link.trim().split_once("/#link=").expect("a link");
    let port = address.rsplit(':').next().and_then(|port| port.parse().ok()).expect("a port");
    (server, port, secret.to_owned(), std::fs::read_to_string(says).expect("text"))
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

impl Session {
    pub fn by(port: u16, secret: &str) -> Self {
        let body = format!("{{\"secret\":\"{secret}\"}}");
        let (status, head, body) = request(port, "POST", "/api/session", &[], &body);
        assert_eq!(status, 200, "{body}");
        let cookie =
            head.lines().find_map(|line| line.strip_prefix("set-cookie: ")).expect("a cookie");
        assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
        let who: Value = serde_json::from_str(&body).expect("JSON");
        let text = |key: &str| who[key].as_str().expect("a text").to_owned();
        Self {
            port,
            cookie: cookie.split(';').next().expect("a pair").to_owned(),
            csrf: text("csrf"),
            id: who["id"].as_u64().expect("a number"),
            view_key: text("view_key"),
        }
    }

    /// Status and JSON of an answer.
    pub fn ask(&self, method: &str, path: &str, body: &str) -> (u16, Value) {
        let headers = [("Cookie", self.cookie.as_str()), ("X-Fieldgap-CSRF", &self.csrf)];
        let (status, _, body) = request(self.port, method, path, &headers, body);
        (status, serde_json::from_str(&body).unwrap_or(Value::String(body)))
    }

    pub fn get(&self, path: &str) -> Value {
        let (status, answer) = self.ask("GET", path, "");
        assert_eq!(status, 200, "{answer}");
        answer
    }

    pub fn post(&self, path: &str, body: &str) -> Value {
        let (status, answer) = self.ask("POST", path, body);
        assert_eq!(status, 200, "{answer}");
        answer
    }

    /// Starts the plan as it was shown.
    pub fn start_look(&self) {
        let digest = self.get("/api/plans/look")["digest"].as_str().expect("a digest").to_owned();
        self.post("/api/scans", &format!("{{\"plan\":\"look\",\"digest\":\"{digest}\"}}"));
    }

    /// Asks for the state until it is as wanted.
    pub fn until(&self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let begun = Instant::now();
        loop {
            let state = self.get("/api/state");
            if wanted(&state) {
                return state;
            }
            assert!(begun.elapsed() < PATIENCE, "never {what}: {state}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// When each of the first `rows` rows of a journal was there, by a look at the file every few milliseconds.
pub fn written(journal: &Path, rows: usize) -> Vec<SystemTime> {
    let mut written: Vec<SystemTime> = Vec::new();
    let begun = Instant::now();
    while written.len() < rows {
        assert!(begun.elapsed() < PATIENCE, "{} rows", written.len());
        let lines = std::fs::read(journal)
            .map_or(0, |text| text.iter().filter(|&&byte| byte == b'\n').count());
        written.resize(lines.saturating_sub(1).max(written.len()), SystemTime::now());
        std::thread::sleep(Duration::from_millis(2));
    }
    written
}

/// Status, head and body of an answer.
pub fn request(
    port: u16,
    method: &str,
    path: &str,
    headers: &[(&str, &str)],
    body: &str,
) -> (u16, String, String) {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("set");
    let mut head = format!(
        "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\nContent-Length: {}\r\n",
        body.len()
    );
    headers.iter().for_each(|(name, value)| head += &format!("{name}: {value}\r\n"));
    stream.write_all(format!("{head}\r\n{body}").as_bytes()).expect("it takes it");
    // chromedriver keeps the connection, so the length ends the answer where it is stated.
    let mut answer = Vec::new();
    let mut part = [0; 1 << 16];
    while !is_whole(&answer) {
        let read = stream.read(&mut part).expect("an answer");
        if read == 0 {
            break;
        }
        answer.extend_from_slice(&part[..read]);
    }
    let answer = String::from_utf8_lossy(&answer).into_owned();
    let (head, body) = answer.split_once("\r\n\r\n").expect("a head");
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
    (status, head.replace("\r\n", "\n"), body.to_owned())
}

/// Whether an answer has the length that it states.
fn is_whole(answer: &[u8]) -> bool {
    let Some(head) = answer.windows(4).position(|end| end == b"\r\n\r\n") else { return false };
    let stated = String::from_utf8_lossy(&answer[..head]).to_lowercase();
    let length = stated
        .lines()
        .find_map(|line| line.strip_prefix("content-length:")?.trim().parse::<usize>().ok());
    length.is_some_and(|length| answer.len() >= head + 4 + length)
}
