//! A campaign on virtual rigs: cells are ordinary records, kills lose and repeat none, and a broken rig does not stop the others.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use fieldgap::campaign::{CampaignFolder, CellState, State};
use fieldgap::records::{RecordedScan, ScanState};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::process::{Pid, Signal, kill_process};

const PLAN: &str = r#"
name = "small"
[simulator]
model = "corrected"
[[focus]]
x_mm = 10.0
y_mm = -5.0
z_mm = 100.0
[dark]
before = 1
[[plane]]
z_mm = 100.0
centre_mm = [10.0, -5.0]
size_mm = [8.0, 8.0]
step_mm = 4.0
"#;

/// A folder with a plan and the virtual rig.
struct Laboratory {
    home: tempfile::TempDir,
}

impl Laboratory {
    fn new() -> Self {
        let home = tempfile::tempdir().expect("a folder");
        let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
        let read = |file: &str| std::fs::read_to_string(rigs.join(file)).expect("it is there");
        let laboratory = Self { home };
        laboratory.write("plan.toml", PLAN);
        laboratory.write(
            "rig.toml",
            &read("virtual.toml").replace("truth/thesis-lab.toml", "truth.toml"),
        );
        laboratory.write("truth.toml", &read("truth/thesis-lab.toml"));
        laboratory
    }

    fn path(&self, name: &str) -> PathBuf {
        self.home.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("written");
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_fieldgap"));
        command.args(arguments).current_dir(self.home.path()).stdin(Stdio::null());
        command
    }

    fn fieldgap(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the program starts")
    }

    fn done(&self, arguments: &[&str]) -> String {
        let output = self.fieldgap(arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {error}");
        String::from_utf8(output.stdout).expect("text")
    }

    fn state(&self) -> State {
        CampaignFolder::read(&self.path("c")).expect("a campaign")
    }
}

const TWO_FOCI: &str = "name = \"c\"\nplan = \"plan.toml\"\nrigs = [\"rig.toml\"]\n[[axis]]\nname = \"focus\"\nparameter = [\"focus.0.x_mm\", \"focus.0.y_mm\"]\n\
     values = [[10.0, -5.0], [0.0, 0.0]]\nlabels = [\"right\", \"centre\"]\n[[axis]]\nname = \"c\"\nparameter = \"medium.speed_of_sound_m_s\"\nvalues = [343.0, 346.0]\n";

#[test]
fn cells_are_records_with_a_page_and_a_table() {
    let laboratory = Laboratory::new();
    laboratory.write("c.toml", &format!("{TWO_FOCI}[schedule]\nrounds = 2\n"));
    let check = laboratory.done(&["campaign", "run", "c.toml", "--dry-run", "--json"]);
    let check: serde_json::Value = serde_json::from_str(&check).expect("JSON");
    assert_eq!(
        (check["cells_a_round"].as_u64(), check["readings_a_round"].as_u64()),
        (Some(4), Some(40))
    );
    assert!(!laboratory.path("c").exists(), "a dry run writes nothing");

    laboratory.done(&["campaign", "run", "c.toml", "--out", "c", "--json"]);
    let cells: Vec<PathBuf> = std::fs::read_dir(laboratory.path("c/cells"))
        .expect("cells")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    assert_eq!(cells.len(), 8, "{cells:?}");
    for cell in &cells {
        let scan = RecordedScan::open(cell).expect("a record");
        assert_eq!(scan.samples.len(), 10);
        let centred = scan.setup.foci[0].excitation().focus_m().expect("a focus").x == 0.0;
        let name = cell.file_name().expect("a name").to_string_lossy().into_owned();
        assert_eq!(centred, name.contains("focus=centre"), "{name}");
        let speed = scan.setup.medium.medium().speed_of_sound_m_s;
        assert_eq!(name.contains("c=346.0"), (speed - 346.0).abs() < 1e-9, "{name}: {speed}");
        assert!(
            cell.join("report/index.html").is_file() && cell.join("report/figures.json").is_file()
        );
        laboratory.done(&["compare", &cell.to_string_lossy(), "--json"]);
    }
    assert!(laboratory.path("c/index.html").is_file());
    let table = laboratory.done(&["campaign", "report", "c", "--format", "csv"]);
    assert_eq!(table.lines().count(), 9);
    assert!(table.starts_with("cell,round,repeat,setting,status,"), "{table}");
    let status = laboratory.done(&["campaign", "status", "c", "--json"]);
    let status: serde_json::Value = serde_json::from_str(&status).expect("JSON");
    assert_eq!((status["done"].as_u64(), status["running"].as_bool()), (Some(8), Some(false)));
}

#[test]
fn programs_of_a_campaign_run_only_with_agreement_and_learn_the_gap() {
    let laboratory = Laboratory::new();
    let tell = r#"["sh", "-c", "echo \"$FIELDGAP_EVENT $FIELDGAP_GAP_PERCENT $FIELDGAP_REPORT\" >> told"]"#;
    let condition = "[[condition]]\nname = \"screen\"\nvalues = [\"in\"]\nset = [\"sh\", \"-c\", \"echo set $0 >> told\", \"{value}\"]\n";
    laboratory.write("c.toml", &format!("{TWO_FOCI}{condition}[hooks]\non_cell = {tell}\n"));
    let output = laboratory.fieldgap(&["campaign", "run", "c.toml", "--out", "c"]);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && error.contains("names programs to run"), "{error}");
    assert!(!laboratory.path("told").exists() && !laboratory.path("c").exists());

    laboratory.done(&["campaign", "run", "c.toml", "--out", "c", "--trust"]);
    let told = std::fs::read_to_string(laboratory.path("told")).expect("told");
    let lines: Vec<&str> = told.lines().collect();
    assert_eq!((lines.len(), lines[0]), (5, "set in"), "{told}");
    for line in &lines[1..] {
        let words: Vec<&str> = line.split(' ').collect();
        assert_eq!(words[0], "cell");
        let gap: f64 = words[1].parse().expect("a gap");
        assert!(gap > 0.0 && gap < 100.0 && Path::new(words[2]).is_file(), "{line}");
    }
    // A gap above the limit has an exit code of its own.
    let small = laboratory.fieldgap(&[
        "campaign",
        "run",
        "c.toml",
        "--out",
        "d",
        "--trust",
        "--fail-above",
        "0.001",
    ]);
    assert_eq!(small.status.code(), Some(4));
}

#[test]
fn a_rig_that_fails_is_left_alone_while_the_other_goes_on() {
    let laboratory = Laboratory::new();
    let rig = std::fs::read_to_string(laboratory.path("rig.toml")).expect("a rig");
    let deaf = rig.replacen("name = \"virtual\"", "name = \"deaf\"", 1)
        + "\n[virtual.faults]\nlose = 1.0\n";
    assert!(deaf.contains("name = \"deaf\""));
    laboratory.write("deaf.toml", &deaf);
    let file = TWO_FOCI.replace("[\"rig.toml\"]", "[\"deaf.toml\", \"rig.toml\"]");
    laboratory.write("c.toml", &format!("{file}[retry]\nattempts = 0\n[after]\ncompare = false\n"));
    let output = laboratory.fieldgap(&["campaign", "run", "c.toml", "--out", "c"]);
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let state = laboratory.state();
    let count =
        |of: fn(&CellState) -> bool| state.cells.values().filter(|log| of(&log.state)).count();
    assert_eq!(count(|state| matches!(state, CellState::Closed { .. })), 4);
    assert_eq!(count(|state| matches!(state, CellState::Failed { .. })), 3);
    assert!(state.rigs_left["deaf"].starts_with("3 cells in a row failed"));
    // Mended, it goes on with what is open, and then with what failed.
    laboratory.write("deaf.toml", &deaf.replace("lose = 1.0", "lose = 0.0"));
    laboratory.fieldgap(&["campaign", "resume", "c"]);
    laboratory.done(&["campaign", "resume", "c", "--failed"]);
    assert!(
        laboratory.state().cells.values().all(|log| matches!(log.state, CellState::Closed { .. }))
    );
}

#[test]
fn a_person_answers_from_elsewhere() {
    let laboratory = Laboratory::new();
    let condition =
        "[[condition]]\nname = \"screen\"\nvalues = [\"in\"]\nask = \"Is the screen {value}?\"\n";
    laboratory.write("c.toml", &format!("{TWO_FOCI}{condition}[after]\ncompare = false\n"));
    let mut running = laboratory
        .command(&["campaign", "run", "c.toml", "--out", "c"])
        .stderr(Stdio::null())
        .spawn()
        .expect("it starts");
    let begun = Instant::now();
    let question = loop {
        assert!(begun.elapsed() < Duration::from_secs(60), "no question is asked");
        let status = laboratory.fieldgap(&["campaign", "status", "c", "--json"]);
        let status: serde_json::Value = serde_json::from_slice(&status.stdout).unwrap_or_default();
        if let Some(question) = status["question"].as_str() {
            break question.to_owned();
        }
        std::thread::sleep(Duration::from_millis(50));
    };
    assert_eq!(question, "Is the screen in?");
    assert!(laboratory.state().cells.is_empty(), "no cell begins before the answer");
    laboratory.done(&["campaign", "answer", "c", "yes"]);
    assert!(running.wait().expect("it ended").success());
    assert_eq!(laboratory.state().cells.len(), 4);
    let none = laboratory.fieldgap(&["campaign", "answer", "c", "yes"]);
    assert!(String::from_utf8_lossy(&none.stderr).contains("no question is open"));
}

/// Runs a campaign of so many cells and kills it so many times, each time after a random number of milliseconds.
fn killed(cells: usize, kills: usize, seed: u64) {
    let laboratory = Laboratory::new();
    let values: Vec<String> = (0..cells).map(|n| format!("{:.3}", n as f64 * 0.01)).collect();
    let axis = format!(
        "[[axis]]\nname = \"x\"\nparameter = \"focus.0.x_mm\"\nvalues = [{}]\n",
        values.join(", ")
    );
    let head = "name = \"c\"\nplan = \"plan.toml\"\nrigs = [\"rig.toml\"]\n";
    laboratory.write("c.toml", &format!("{head}{axis}[after]\ncompare = false\n"));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut killed = 0;
    let begun = Instant::now();
    while killed < kills {
        assert!(begun.elapsed() < Duration::from_secs(3600), "the campaign makes no progress");
        let begins = !laboratory.path("c/campaign.jsonl").exists();
        let arguments: &[&str] = if begins {
            &["campaign", "run", "c.toml", "--out", "c"]
        } else {
            &["campaign", "resume", "c"]
        };
        let mut child =
            laboratory.command(arguments).stderr(Stdio::null()).spawn().expect("it starts");
        std::thread::sleep(Duration::from_millis(random.random_range(1..1500)));
        if child.try_wait().expect("a state").is_some() {
            break;
        }
        let pid = Pid::from_raw(i32::try_from(child.id()).expect("a pid")).expect("not zero");
        kill_process(pid, Signal::KILL).expect("killed");
        child.wait().expect("it ended");
        killed += 1;
    }
    assert!(killed > 0);
    if laboratory.path("c/campaign.jsonl").exists() {
        laboratory.done(&["campaign", "resume", "c"]);
    } else {
        laboratory.done(&["campaign", "run", "c.toml", "--out", "c"]);
    }
    let state = laboratory.state();
    assert_eq!(state.cells.len(), cells, "no cell is lost");
    let mut places = BTreeSet::new();
    for (cell, log) in &state.cells {
        assert!(matches!(log.state, CellState::Closed { .. }), "{cell}: {log:?}");
        let folder = laboratory.path("c/cells").join(cell);
        assert_eq!(ScanState::of(&folder).expect("a state"), Some(ScanState::Complete), "{cell}");
        let scan = RecordedScan::open(&folder).expect("a record");
        assert_eq!(scan.samples.len(), 10, "{cell}");
        let focus_m = scan.setup.foci[0].excitation().focus_m().expect("a focus");
        places.insert((focus_m.x * 1e6).round() as i64);
    }
    assert_eq!(places.len(), cells, "each cell has its own focus");
    // A cell is announced as complete once: it was not measured twice.
    let log = std::fs::read_to_string(laboratory.path("c/campaign.jsonl")).expect("a log");
    let complete = log.lines().filter(|line| line.contains("\"event\":\"measured\"")).count();
    assert_eq!(complete, cells);
    let aside = std::fs::read_dir(laboratory.path("c/cells"))
        .expect("cells")
        .map(|entry| entry.expect("an entry").path());
    let aside: Vec<PathBuf> =
        aside.filter(|path| path.to_string_lossy().contains(".interrupted-")).collect();
    for folder in &aside {
        assert!(
            !folder.join("samples.csv").exists() || RecordedScan::open(folder).is_err(),
            "{} holds readings",
            folder.display()
        );
    }
    eprintln!(
        "{cells} cells, {killed} kills, {} records that held no reading were moved aside, {:.0} s",
        aside.len(),
        begun.elapsed().as_secs_f64()
    );
}

#[test]
fn kills_lose_no_cell_and_repeat_none() {
    killed(24, 10, 1);
}

/// Minutes long.
#[test]
#[ignore = "takes some minutes"]
fn two_hundred_kills_of_a_thousand_cells_lose_none_and_repeat_none() {
    killed(1000, 200, 2);
}
