//! What a closed loop costs between two rounds, against one simulation of its readings: `cargo bench --bench closed_loop`.
//!
//! A virtual rig measures 2,000 readings: its receiver has a face, which looks much like a directivity, so that several sets stay in question.
//! The decisions of its last rounds are then made again from the record: the search that runs while a round is measured; the update, which
//! fits the sets in question to all readings; and the whole decision, which is the update and the choice of a batch. Each figure is the median
//! of the last rounds. A decision that needed a search of its own is left out.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use fieldgap::acquisition::{
    ChooseRounds, Ending, NextRound, NoNextRound, PlannedScan, RigSetup, ScanRun,
};
use fieldgap::closed_loop::{Inquiry, Purpose, read_rounds};
use fieldgap::diagnosis::{Findings, Options, Verdict};
use fieldgap::input::TomlSource;
use fieldgap::records::{Plan, RecordedScan};
use fieldgap::rig_file::simulated_devices;

const PLAN: &str = "name = \"bench\"\nrig = \"rig.toml\"\n[simulator]\nmodel = \"piston\"\n\
                    [[focus]]\nx_mm = 10.0\ny_mm = -5.0\nz_mm = 100.0\n\
                    [closed_loop]\nmin_mm = [-30.0, -30.0, 80.0]\nmax_mm = [30.0, 30.0, 140.0]\n\
                    readings = 100000\nfirst_readings = 1500\nprobability = 0.999\n";

const TRUTH: &str = "[microphone]\nsensitivity_v_pa = 0.003\n\
                     [noise]\nmultiplicative = 0.02\nadditive_v = 0.01\n[effects.aperture]\nradius_mm = 2.0\n";

/// Pressure of all elements together at one metre, Pa: more than that of 36 elements of 4 Pa exceeds the range of the converter.
const PRESSURE_PA: f64 = 144.0;

/// Readings after which the loop is ended.
const READINGS: usize = 2000;

/// Decisions that are timed: the last of so many rounds.
const DECISIONS: usize = 5;

/// A loop that ends after so many readings, whatever it found.
struct Ended(Inquiry);

impl ChooseRounds for Ended {
    fn next(&self, plan: &Plan, record: &RecordedScan) -> Result<NextRound, NoNextRound> {
        let next = self.0.next(plan, record)?;
        let plan = next.plan.filter(|_| record.samples.len() < READINGS);
        Ok(NextRound { plan, ..next })
    }

    fn meanwhile(&self, record: &RecordedScan) {
        self.0.meanwhile(record);
    }
}

fn main() {
    println!("elements  readings  simulation    search        update      decision   (sets)");
    for side in [6, 16] {
        let folder = tempfile::tempdir().expect("a folder");
        let record = measured(folder.path(), side);
        let plan = Plan::read(&record.join("plan.toml")).expect("its plan");
        let rig_setup = RigSetup::read(&folder.path().join("rig.toml")).expect("the rig");
        let rounds = read_rounds(&record).expect("rounds");
        let whole = RecordedScan::open(&record).expect("a record");
        let options = Options { simulator: Some(plan.simulator), ..Options::default() };
        let mut took_s: [Vec<f64>; 4] = Default::default();
        let mut readings = 0;
        let mut sets = 0;
        for (number, round) in rounds.iter().enumerate().skip(2).rev().take(DECISIONS) {
            let earlier = &rounds[..number];
            let by_update = earlier[number - 1].purpose == Purpose::Explore
                && round.purpose == Purpose::Explore;
            if !by_update || round.verdict == Some(Verdict::Unexplained) {
                continue;
            }
            let before = up_to(&whole, earlier[number - 1].before);
            let seen = [up_to(&whole, round.before)];
            let inquiry = Inquiry::new(&plan, &rig_setup, &record).expect("a loop");
            let mut plan = plan.clone();
            plan.readings.truncate(number);
            let live = {
                let findings = Findings::of(std::slice::from_ref(&before), &options);
                findings.expect("comparable").live_sets()
            };
            let simulation = whole.setup.simulation(plan.simulator, 0).expect("a focus");
            let places: Vec<_> = seen[0].samples.iter().map(|s| s.position_m()).collect();
            let mut time = |which: usize, work: &mut dyn FnMut()| {
                let start = Instant::now();
                work();
                took_s[which].push(start.elapsed().as_secs_f64());
            };
            time(0, &mut || drop(black_box(simulation.magnitudes(&places))));
            time(1, &mut || inquiry.meanwhile(&before));
            time(2, &mut || {
                let findings = Findings::of_live(&seen, &options, &live).expect("comparable");
                sets = findings.probabilities().len();
            });
            time(3, &mut || {
                let decision = inquiry.decide(&plan, &seen[0], earlier).expect("a decision");
                assert_eq!(decision.round.purpose, round.purpose, "{}", decision.round.reason);
            });
            readings = readings.max(seen[0].samples.len());
        }
        let [simulation_s, search_s, update_s, decision_s] = took_s.map(median);
        println!(
            "{:8}  {readings:8}  {:7.2} ms  {search_s:6.2} s {:5.0} x  {update_s:5.2} s {:5.0} x  {decision_s:5.2} s {:5.0} x  ({sets})",
            side * side,
            1e3 * simulation_s,
            search_s / simulation_s,
            update_s / simulation_s,
            decision_s / simulation_s,
        );
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn up_to(record: &RecordedScan, readings: usize) -> RecordedScan {
    RecordedScan { setup: record.setup.clone(), samples: record.samples[..readings].to_vec() }
}

/// The record of a loop on a virtual rig with a square array.
fn measured(folder: &Path, side: usize) -> std::path::PathBuf {
    let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../rigs");
    let rig = std::fs::read_to_string(rigs.join("virtual.toml")).expect("the rig file");
    let rig = rig
        .replace("truth/thesis-lab.toml", "truth.toml")
        .replace("columns = 6\nrows = 6", &format!("columns = {side}\nrows = {side}"))
        .replace("[virtual.robot]", "[virtual.array]\nperiod_steps = 8192\n\n[virtual.robot]");
    let pressure_pa = PRESSURE_PA / (side * side) as f64;
    let truth = format!("[source]\npressure_pa_at_1_m = {pressure_pa:?}\n{TRUTH}");
    for (name, text) in [("rig.toml", rig.as_str()), ("truth.toml", &truth), ("plan.toml", PLAN)] {
        std::fs::write(folder.join(name), text).expect("written");
    }
    let record = folder.join("record");
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let ending = runtime.block_on(async {
        let scan = PlannedScan::read(&folder.join("plan.toml"), None).expect("a plan");
        let inquiry = Inquiry::new(scan.plan(), scan.rig_setup(), &record).expect("a loop");
        let (plan, first) =
            inquiry.first_plan(scan.plan(), scan.rig_setup()).expect("a first round");
        let source = |path: &Path, text: &str| TomlSource::new(path, text.to_owned());
        let rig = scan.rig_setup().source();
        let plan = source(plan.path(), plan.text());
        let scan = PlannedScan::parse(plan, source(rig.path(), rig.text())).expect("the same");
        let mut scan_run = ScanRun::begin(scan, &record, simulated_devices).await.expect("a rig");
        inquiry.begin(first).expect("logged");
        scan_run.in_rounds(Box::new(Ended(inquiry)));
        scan_run.run(&mut |_| (), std::future::pending()).await.expect("it ends")
    });
    assert_eq!(ending, Ending::Complete);
    record
}
