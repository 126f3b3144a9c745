//! Levels and exposure through the program, against the physics of the virtual rig.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use serde_json::Value;

mod heard;
mod terminal;

use heard::Heard;
use terminal::{Terminal, shown};

/// A folder with copies of rigs and scans, and the user's settings.
struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        for inputs in ["rigs", "rigs/truth", "scans"] {
            let from = Path::new(env!("CARGO_MANIFEST_DIR")).join(inputs);
            let to = folder.path().join(inputs);
            std::fs::create_dir_all(&to).expect("a folder");
            for entry in std::fs::read_dir(from).expect("a folder") {
                let path = entry.expect("an entry").path();
                if path.extension().is_some_and(|ending| ending == "toml") {
                    std::fs::copy(&path, to.join(path.file_name().expect("a name")))
                        .expect("a copy");
                }
            }
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_fieldgap"));
        command
            .args(arguments)
            .current_dir(self.0.path())
            .env("XDG_CONFIG_HOME", self.path("settings"))
            .stdin(Stdio::null());
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the program starts")
    }

    /// The rig of `rigs/levels.toml`, which can also receive with its elements, as real devices in `rigs/heard.toml`.
    fn heard(&self) -> Heard {
        let rig = std::fs::read_to_string(self.path("rigs/levels.toml")).expect("there");
        let sensing = "[sensing]\nleft = [12, 17]\nright = [18, 23]\nrate_hz = 250.0\n";
        let rig = rig.replace("[exposure.source]", &format!("{sensing}[exposure.source]"));
        std::fs::write(self.path("rigs/paced.toml"), rig).expect("written");
        Heard::behind(self.command(&[]), self.0.path(), "rigs/paced.toml", "rigs/heard.toml")
    }

    /// The lines of the log of times with the array driven: what was done, and for how long, s.
    fn sounded(&self) -> Vec<(String, f64)> {
        let log = std::fs::read_to_string(self.path("settings/fieldgap/sounding.jsonl"));
        let read = |line| {
            let line: Value = serde_json::from_str(line).expect("JSON");
            assert_eq!(line["rig"], "levels");
            (
                line["what"].as_str().expect("a text").to_owned(),
                line["seconds"].as_f64().expect("a time"),
            )
        };
        log.unwrap_or_default().lines().map(read).collect()
    }

    /// What a command prints.
    fn printed(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", said(&output));
        String::from_utf8(output.stdout).expect("text")
    }

    fn json(&self, arguments: &[&str]) -> Value {
        serde_json::from_str(&self.printed(arguments)).expect("JSON")
    }
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Pressure at a place (mm) over the thesis's array focused at another: pistons of 4 Pa rms at 1 m, as `rigs/truth/thesis-lab.toml` has them.
fn true_pa(focus_mm: [f64; 3], at_mm: [f64; 3]) -> f64 {
    let k = std::f64::consts::TAU * 40e3 / 343.15;
    let way = |from: [f64; 3], to: [f64; 3]| {
        let [x, y, z] = std::array::from_fn(|axis| (to[axis] - from[axis]) * 1e-3);
        (f64::hypot(x, y), (x * x + y * y + z * z).sqrt())
    };
    let (mut real, mut imaginary) = (0.0, 0.0);
    for n in 0..36 {
        let element = [(f64::from(n % 6) - 2.5) * 10.5, (f64::from(n / 6) - 2.5) * 10.5, 0.0];
        let (across, distance) = way(element, at_mm);
        let x = k * 4.5e-3 * across / distance;
        let level = 4.0 * if x < 1e-9 { 1.0 } else { 2.0 * libm::j1(x) / x } / distance;
        let phase = k * (distance - way(element, focus_mm).1);
        real += level * phase.cos();
        imaginary += level * phase.sin();
    }
    real.hypot(imaginary)
}

#[test]
fn the_level_of_a_scan_is_that_of_the_sound_and_gives_the_level_of_the_array() {
    let bench = Bench::new();
    let scan =
        ["scan", "scans/quick-look.toml", "--rig", "rigs/levels.toml", "--out", "out/levels"];
    let output = bench.run(&scan);
    assert!(output.status.success(), "{}", said(&output));
    // The limit of the rig file is exceeded, and nobody hears a virtual array.
    assert!(said(&output).contains("is above the limit of 110.0 dB"), "{}", said(&output));
    assert!(said(&output).contains("nobody hears it"), "{}", said(&output));
    assert!(!bench.path("settings/fieldgap/sounding.jsonl").exists());

    let comparison = bench.json(&["compare", "out/levels", "--json"]);
    let plane = &comparison[0]["levels"]["planes"][0];
    let peak = &comparison[0]["planes"][0]["scan"]["peak_position_m"];
    let at = |axis: usize| peak[axis]["value"].as_f64().expect("a place") * 1e3;
    let number = |value: &Value| value.as_f64().expect("a number");
    let expected_pa = true_pa([17.5, -22.5, 100.0], [at(0), at(1), 100.0]);
    let off_db = 20.0 * (number(&plane["scan"]["rms_pa"]) / expected_pa).log10();
    assert!(off_db.abs() < number(&plane["expanded_db"]), "{off_db}: {plane}");
    let lines = plane["budget"]["lines"].as_array().expect("lines");
    assert!(lines.iter().any(|line| line["source"] == "receiver's sensitivity"), "{plane}");

    let csv = bench.printed(&["compare", "out/levels", "--format", "csv"]);
    let mut rows = csv.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let (names, values) = (rows.next().expect("names"), rows.next().expect("a row"));
    let column = names.iter().position(|name| *name == "scan_peak_db").expect("the column");
    let db: f64 = values[column].parse().expect("a level");
    assert!((db - number(&plane["scan"]["level_db"])).abs() < 1e-9);

    // The data sheet, at 6.7 V, and the record know the same array: 4 Pa at 1 m.
    let level = |more: &[&str]| {
        let arguments =
            [&["exposure", "scans/quick-look.toml", "--rig", "rigs/levels.toml", "--json"], more]
                .concat();
        let found = bench.json(&arguments);
        let place = found["places"][0].clone();
        assert_eq!(place["against"][0]["standing"], "above");
        number(&place["level_db"])
    };
    let [sheet, record] = [level(&[]), level(&["--record", "out/levels"])];
    assert!((sheet - record).abs() < 0.7, "{sheet} {record}");
    let record_of_no_level = ["scan", "scans/quick-look.toml", "--out", "out/plain"];
    assert!(bench.run(&record_of_no_level).status.success());
    let refused = bench.run(&["exposure", "rigs/levels.toml", "--record", "out/plain"]);
    assert!(said(&refused).contains("sensitivity of the receiver"), "{}", said(&refused));
    let plain = bench.printed(&["compare", "out/plain"]);
    assert!(!plain.contains("dB"), "{plain}");
}

#[test]
fn a_sound_calibrator_gives_the_sensitivity_of_the_rig_file() {
    let bench = Bench::new();
    std::fs::write(
        bench.path("points.csv"),
        "x_mm,y_mm,z_mm,reading\n0,0,100,0.03004\n0,0,100,0.03001\n0,0,100,0.02998\n0,0,100,0.03007\n",
    )
    .expect("written");
    bench.printed(&[
        "import",
        "points",
        "points.csv",
        "--columns",
        "x,y,z,reading",
        "--units",
        "mm,mm,mm,V",
        "--rig",
        "rigs/virtual.toml",
        "--focus-mm",
        "0,0,100",
        "--out",
        "out/calibrator",
        "--yes",
    ]);
    let whole = [
        "calibrate",
        "level",
        "out/calibrator",
        "--db",
        "114",
        "--u-db",
        "0.1",
        "--response-db",
        "-1.8",
        "--response-u-db",
        "0.4",
    ];
    let text = bench.printed(&[&whole[..], &["--write", "receiver.toml"]].concat());
    // The date of an imported record is that of its file.
    let text: Vec<&str> = text.lines().filter(|line| !line.starts_with("# [receiver]")).collect();
    insta::assert_snapshot!(text.join("\n"));

    // The lines are read by a rig file.
    let lines = std::fs::read_to_string(bench.path("receiver.toml")).expect("written");
    let rig = std::fs::read_to_string(bench.path("rigs/virtual.toml")).expect("there");
    std::fs::write(
        bench.path("rigs/calibrated.toml"),
        rig.replace("[receiver]\n", &format!("[receiver]\n{lines}")),
    )
    .expect("written");
    let scan = [
        "scan",
        "scans/quick-look.toml",
        "--rig",
        "rigs/calibrated.toml",
        "--out",
        "out/calibrated",
    ];
    assert!(bench.run(&scan).status.success());
    let setup = std::fs::read_to_string(bench.path("out/calibrated/scan.toml")).expect("there");
    assert!(setup.contains("sensitivity_v_pa = 0.0024"), "{setup}");

    // No file is overwritten, and an incomplete uncertainty is left to the person.
    let again = bench.run(&[&whole[..], &["--write", "receiver.toml"]].concat());
    assert!(!again.status.success() && said(&again).contains("not changed"), "{}", said(&again));
    let part = bench.printed(&["calibrate", "level", "out/calibrator", "--db", "114"]);
    assert!(part.contains("# sensitivity_u_percent"), "{part}");
    assert!(part.contains("not in it: the uncertainty of the calibrator's level"), "{part}");
    let mixed = bench.run(&["calibrate", "level", "out/calibrated", "--db", "114"]);
    assert!(said(&mixed).contains("is not known"), "{}", said(&mixed));
}

#[test]
fn a_real_array_above_a_limit_starts_only_on_the_users_word_and_its_time_is_kept() {
    let bench = Bench::new();
    let _rig = bench.heard();
    std::fs::write(
        bench.path("scans/short.toml"),
        "name = \"short\"\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 60.0\n\
         [[points]]\nat_mm = [[-2.0, 0.0, 60.0], [0.0, 0.0, 60.0], [2.0, 0.0, 60.0], [4.0, 0.0, 60.0]]\n",
    )
    .expect("written");
    let scan =
        ["scan", "scans/short.toml", "--rig", "rigs/heard.toml", "--out", "out/heard", "--yes"];
    let refused = bench.run(&scan);
    assert!(!refused.status.success());
    for words in ["is above the limit", "--above-limits", "nothing was done"] {
        assert!(said(&refused).contains(words), "{words}: {}", said(&refused));
    }
    assert!(!bench.path("out/heard").exists());

    let agreed = bench.run(&[&scan[..], &["--above-limits"]].concat());
    assert!(agreed.status.success(), "{}", said(&agreed));
    let log =
        std::fs::read_to_string(bench.path("settings/fieldgap/sounding.jsonl")).expect("a log");
    let line: Value = serde_json::from_str(log.trim()).expect("one line");
    assert_eq!(line["rig"], "levels");
    let seconds = line["seconds"].as_f64().expect("a time");
    assert!(seconds > 0.0 && seconds < 60.0, "{line}");
    let today = bench.json(&["exposure", "scans/short.toml", "--rig", "rigs/heard.toml", "--json"]);
    let minutes = today["minutes_today"].as_f64().expect("minutes");
    assert!((minutes * 60.0 - seconds).abs() < 1e-6, "{minutes} {seconds}");

    // So many minutes are in the log that no scan fits into the day.
    let ended = line["ended"].as_str().expect("a time");
    let long = format!(
        "{{\"ended\":\"{ended}\",\"seconds\":20000.0,\"rig\":\"levels\",\"what\":\"x\"}}\n"
    );
    std::fs::write(bench.path("settings/fieldgap/sounding.jsonl"), log + &long).expect("written");
    let quiet = std::fs::read_to_string(bench.path("rigs/heard.toml")).expect("there");
    std::fs::write(
        bench.path("rigs/quiet.toml"),
        quiet.replace("drive_v_rms = 6.7", "drive_v_rms = 0.1"),
    )
    .expect("written");
    let dry = bench.run(&["scan", "scans/short.toml", "--rig", "rigs/quiet.toml", "--dry-run"]);
    assert!(said(&dry).contains("are more than 240"), "{}", said(&dry));
}

#[test]
fn whatever_drives_a_real_array_by_hand_keeps_to_the_limits_and_its_time_is_kept() {
    let bench = Bench::new();
    let _rig = bench.heard();
    let at = ["--at-mm", "0,0,60", "--seconds", "0.3", "--yes"];
    let commands: [(&str, Vec<&str>); 5] = [
        (
            "focus",
            vec!["scans/display-circle.toml", "--rig", "rigs/heard.toml", "--seconds", "0.3"],
        ),
        ("sense", vec!["rigs/heard.toml", "--seconds", "4"]),
        ("rig focus", [&["rigs/heard.toml"], &at[..]].concat()),
        ("rig sample", vec!["rigs/heard.toml", "--focus-mm", "0,0,60", "--count", "2", "--yes"]),
        ("rig find-axis", vec!["rigs/heard.toml", "--heights-mm", "60,80", "--yes"]),
    ];
    for (number, (command, arguments)) in commands.iter().enumerate() {
        let whole: Vec<&str> = command.split(' ').chain(arguments.iter().copied()).collect();
        let refused = bench.run(&whole);
        assert!(!refused.status.success(), "{command}");
        for words in ["is above the limit of 110.0 dB", "--above-limits", "nothing was done"] {
            assert!(said(&refused).contains(words), "{command}: {words}: {}", said(&refused));
        }
        assert_eq!(bench.sounded().len(), number, "{command}: it sounded");
        let agreed = bench.run(&[&whole[..], &["--above-limits"]].concat());
        assert!(agreed.status.success(), "{command}: {}", said(&agreed));
        let sounded = bench.sounded();
        let (what, seconds) = &sounded[number];
        assert_eq!((sounded.len(), what.as_str()), (number + 1, *command));
        assert!(*seconds > 0.1 && *seconds < 60.0, "{command}: {seconds} s");
    }

    // Without places of people in the rig file nothing is asked.
    let rig = std::fs::read_to_string(bench.path("rigs/heard.toml")).expect("there");
    let (before, exposure) = rig.split_once("[exposure.source]").expect("the section");
    let after = exposure.find("[virtual]").map_or("", |at| &exposure[at..]);
    std::fs::write(bench.path("rigs/nobody.toml"), format!("{before}{after}")).expect("written");
    let sense = ["sense", "rigs/nobody.toml", "--seconds", "1"];
    let output = bench.run(&sense);
    assert!(output.status.success() && !said(&output).contains("exposure"), "{}", said(&output));
}

#[test]
fn a_calibration_of_a_real_array_asks_for_the_exposure_before_it_begins() {
    let bench = Bench::new();
    let _rig = bench.heard();
    let calibrate =
        ["calibrate", "rigs/heard.toml", "--minutes", "60", "--out", "out/calibration", "--yes"];
    let refused = bench.run(&calibrate);
    assert!(!refused.status.success());
    assert!(said(&refused).contains("the limit of 110.0 dB"), "{}", said(&refused));
    assert!(!bench.path("out/calibration").exists() && bench.sounded().is_empty());
}

/// A command at a terminal of its own.
struct AtTerminal {
    child: Child,
    keys: File,
    shown: Receiver<Vec<u8>>,
    text: String,
}

impl AtTerminal {
    fn begin(mut command: Command) -> Self {
        let terminal = Terminal::of_width(200);
        let [input, output, errors] = [(); 3].map(|()| terminal.end());
        let command = command.stdin(input).stdout(output).stderr(errors);
        let child = command.env("TERM", "xterm-256color").spawn().expect("it starts");
        let shown = shown(&terminal.face);
        let keys = terminal.face;
        Self { child, keys, shown, text: String::new() }
    }

    /// Waits until a word is shown that was not there before, then presses keys.
    fn at(&mut self, word: &str, keys: &str) {
        let begun = Instant::now();
        self.text.clear();
        while !self.text.contains(word) {
            assert!(begun.elapsed() < Duration::from_secs(60), "no `{word}`: {}", self.text);
            if let Ok(bytes) = self.shown.recv_timeout(Duration::from_millis(100)) {
                self.text += &String::from_utf8_lossy(&bytes);
            }
        }
        self.keys.write_all(keys.as_bytes()).expect("the terminal takes keys");
    }

    fn succeeds(mut self) -> bool {
        self.child.wait().expect("it ends").success()
    }
}

#[test]
fn a_person_at_a_terminal_is_asked_before_a_display_and_before_a_jog_with_sound() {
    let bench = Bench::new();
    let _rig = bench.heard();
    let play =
        ["focus", "scans/display-circle.toml", "--rig", "rigs/heard.toml", "--seconds", "0.2"];
    let mut refused = AtTerminal::begin(bench.command(&play));
    refused.at("driven all the same? [y/N]", "n\n");
    assert!(!refused.succeeds());
    assert!(bench.sounded().is_empty(), "it sounded");
    let mut agreed = AtTerminal::begin(bench.command(&play));
    agreed.at("driven all the same? [y/N]", "y\n");
    agreed.at("silent", "");
    assert!(agreed.succeeds());
    assert_eq!(bench.sounded().len(), 1);

    let jog = ["rig", "jog", "rigs/heard.toml", "--focus-mm", "0,0,60"];
    let mut jog = AtTerminal::begin(bench.command(&jog));
    jog.at("driven all the same? [y/N]", "y\n");
    jog.at("silent", "f");
    jog.at("EMITS", "q");
    assert!(jog.succeeds());
    let (what, seconds) = &bench.sounded()[1];
    assert!(what == "rig jog" && *seconds > 0.0, "{what} {seconds}");
}
