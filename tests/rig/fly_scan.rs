//! Rows at constant speed on the virtual rig: the same map as point by point, in a fraction of the time; and conditions that prevent it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use fieldgap::records::{EventKind, RecordedSample, RecordedScan, read_events};

/// Noise of one sample: `rigs/truth/thesis-lab.toml`.
const OF_LEVEL: f64 = 0.01;
const ADDED_V: f64 = 0.015;

struct Bench {
    home: tempfile::TempDir,
}

impl Bench {
    /// The virtual rig with replaced lines and an extended truth file.
    fn new(changes: &[(&str, &str)], truth: &str) -> Self {
        let home = tempfile::tempdir().expect("a folder");
        let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
        let read = |file: &str| std::fs::read_to_string(rigs.join(file)).expect("it is there");
        let mut rig = read("virtual.toml").replace("truth/thesis-lab.toml", "truth.toml");
        for (from, to) in changes {
            assert!(rig.contains(from), "{from}");
            rig = rig.replace(from, to);
        }
        std::fs::write(home.path().join("rig.toml"), rig).expect("written");
        let truth = read("truth/thesis-lab.toml") + truth;
        std::fs::write(home.path().join("truth.toml"), truth).expect("written");
        Self { home }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.home.path().join(name)
    }

    /// Scans a plane with additional lines in the plan.
    fn scan(&self, name: &str, plane: &str, more: &str) -> Output {
        let plan = format!(
            "name = \"{name}\"\nrig = \"rig.toml\"\n[simulator]\nmodel = \"piston\"\n\
             [[focus]]\nx_mm = 17.5\ny_mm = -22.5\nz_mm = 100.0\n[[plane]]\n{plane}\n{more}\n"
        );
        let path = self.path(&format!("{name}.toml"));
        std::fs::write(&path, plan).expect("written");
        Command::new(env!("CARGO_BIN_EXE_fieldgap"))
            .arg("scan")
            .arg(&path)
            .arg("--out")
            .arg(self.path(name))
            .output()
            .expect("it runs")
    }

    fn samples(&self, name: &str, plane: &str, more: &str) -> Vec<RecordedSample> {
        let output = self.scan(name, plane, more);
        assert!(output.status.success(), "{}", said(&output));
        let mut samples = RecordedScan::open(&self.path(name)).expect("a record").samples;
        samples.sort_by(|a, b| {
            let key = |sample: &RecordedSample| (sample.position_mm.y, sample.position_mm.x);
            key(a).partial_cmp(&key(b)).expect("finite")
        });
        samples
    }

    fn fly_events(&self, name: &str) -> Vec<String> {
        let events = read_events(&self.path(name)).expect("events");
        let flown = events.into_iter().filter(|event| event.kind == EventKind::Flown);
        flown.map(|event| event.text).collect()
    }
}

fn said(output: &Output) -> String {
    // Without line breaks, which depend on the terminal.
    String::from_utf8_lossy(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Mean square of the differences over that of the known noise.
fn apart(some: &[RecordedSample], others: &[RecordedSample]) -> f64 {
    assert_eq!(some.len(), others.len());
    let variance = |sample: &RecordedSample| {
        let count = f64::from(sample.spread.expect("spreads are kept").count);
        ((OF_LEVEL * sample.reading).powi(2) + ADDED_V.powi(2)) / count
    };
    let squares = some.iter().zip(others).map(|(one, other)| {
        assert!((one.position_mm - other.position_mm).norm() < 0.011, "{one:?} {other:?}");
        (one.reading - other.reading).powi(2) / (variance(one) + variance(other))
    });
    squares.sum::<f64>() / some.len() as f64
}

fn lasted_s(samples: &[RecordedSample]) -> f64 {
    let times = || samples.iter().map(|sample| sample.time_s);
    times().fold(0.0, f64::max) - times().fold(f64::INFINITY, f64::min)
}

const FLY: &str = "[fly]\nspeed_mm_s = 180.0";

#[test]
fn a_flown_plane_of_71_by_71_points_has_the_same_map_in_an_eighth_of_the_time() {
    let bench = Bench::new(&[], "");
    let plane = "z_mm = 100\nsize_mm = [70, 70]\nstep_mm = 1";
    let stopped = bench.samples("stopped", plane, "");
    let flown = bench.samples("flown", plane, FLY);
    assert_eq!(flown.len(), 71 * 71);
    let (slow_s, fast_s) = (lasted_s(&stopped), lasted_s(&flown));
    assert!(slow_s > 8.0 * fast_s, "{slow_s} and {fast_s} s");
    // 5,041 differences: their mean square scatters by 2 %; the interpolation error is smaller.
    let apart = apart(&stopped, &flown);
    assert!((0.92..1.08).contains(&apart), "{apart}");
    println!(
        "{slow_s:.1} s point by point, {fast_s:.1} s flown; differences {apart:.3} of the noise"
    );
}

#[test]
fn a_receiver_lag_is_measured_and_compensated() {
    let plane = "z_mm = 100\ncentre_mm = [17.5, -22.5]\nsize_mm = [40, 10]\nstep_mm = 1";
    let stopped = Bench::new(&[], "").samples("stopped", plane, "");
    let late = Bench::new(&[], "[effects.lag]\ns = 0.012\n");
    let flown = late.samples("flown", plane, FLY);
    let told = late.fly_events("flown");
    let lag_ms: f64 = told[0].split(' ').nth(2).and_then(|ms| ms.parse().ok()).expect("a number");
    assert!((lag_ms - 12.0).abs() < 0.2, "{told:?}");
    // 451 differences: their mean square scatters by 7 %; the standard error of the lag, 6 µm, adds some.
    let difference = apart(&stopped, &flown);
    assert!((0.67..1.4).contains(&difference), "{difference}");
    assert!(told[1].starts_with("11 rows at 180 mm/s"), "{told:?}");
    // Without compensation, rows in opposite directions are 4 mm apart.
    let uncorrected = late.samples("uncorrected", plane, &format!("{FLY}\nlag_ms = 0.0"));
    assert!(apart(&stopped, &uncorrected) > 10.0);
}

#[test]
fn impossible_rows_are_reported_at_the_latest_at_the_first_row() {
    let plane = "z_mm = 100\ncentre_mm = [17.5, -22.5]\nsize_mm = [20, 10]\nstep_mm = 1";
    let bench = Bench::new(&[], "");
    // 150 mm of travel to each side, and 20 mm of run-up.
    let wide = bench.scan("wide", "z_mm = 100\nsize_mm = [270, 2]\nstep_mm = 1", FLY);
    assert!(said(&wide).contains("outside its travel"), "{}", said(&wide));
    let fast = bench.scan("fast", plane, "[fly]\nspeed_mm_s = 600.0\nlead_mm = 20.0");
    assert!(said(&fast).contains("samples per point; at least 6 are needed"), "{}", said(&fast));
    let events = read_events(&bench.path("fast")).expect("they are kept");
    assert!(events.iter().all(|event| event.kind != EventKind::Homed), "nothing has moved");
    let short = bench.scan("short", plane, "[fly]\nspeed_mm_s = 180.0\nlead_mm = 1.0");
    assert!(said(&short).contains("the robot took"), "{}", said(&short));
    let even = bench.scan(
        "even",
        "z_mm = 100\ncentre_mm = [-110, 110]\nsize_mm = [8, 2]\nstep_mm = 1",
        FLY,
    );
    assert!(
        said(&even).contains("the lag of the readings behind the robot cannot be found"),
        "{}",
        said(&even)
    );
}
