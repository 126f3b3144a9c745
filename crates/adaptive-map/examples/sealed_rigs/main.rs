//! Maps of sealed rigs against their truth: adaptive, by a process alone, and by plain grids of as many readings.
//!
//! `cargo run --release -p fieldgap-adaptive-map --example sealed_rigs -- SEED COUNT FOLDER [NAME,NAME]`
//!
//! Every rig has two effects of the catalogue that its simulation does not know. The truth is that of the virtual rig's own physics. The
//! table goes to standard output, one rig a line; means and shares follow.

mod bench_rig;
mod spline;

use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

use fieldgap_acoustics::Vec3;
use fieldgap_adaptive_map::{Estimate, FieldMap, MapEnd, Mapping, checks_of, map, places_of};
use fieldgap_blind::{SetToMake, Shares, Worlds};
use fieldgap_closed_loop::Planned;
use fieldgap_comparison::DarkReadings;
use fieldgap_input::TomlSource;
use fieldgap_records::{MapPrior, Plan, RecordedScan};
use rayon::prelude::*;

use bench_rig::BenchRig;

/// The grid of the full scan of a sealed set: four planes of 36 by 36 places. With silent readings and repeats it has so many readings.
const SIDE: usize = 36;
const HEIGHTS_MM: [f64; 4] = [80.0, 120.0, 160.0, 200.0];
const FULL_SCAN: usize = 5424;

/// What one way of mapping did, errors as shares of the true peak.
#[derive(Clone, Copy)]
struct Outcome {
    rms: f64,
    largest: f64,
    /// Share of the places whose error is within 1.96 standard errors, and root mean square of the standard errors.
    within: f64,
    stated: f64,
}

struct Line {
    name: String,
    effects: String,
    found: String,
    readings: usize,
    end: Option<MapEnd>,
    factor: f64,
    minutes: f64,
    seconds: f64,
    /// Adaptive; process alone; plain grid by spline, by process, by simulation and process.
    outcomes: [Outcome; 5],
    process_readings: usize,
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let seed: u64 = arguments.next().expect("a seed").parse().expect("a number");
    let count: usize = arguments.next().expect("a count").parse().expect("a number");
    let folder = arguments.next().expect("a folder");
    let folder = Path::new(&folder).join(seed.to_string());
    let chosen: Option<Vec<String>> =
        arguments.next().map(|names| names.split(',').map(str::to_owned).collect());
    let error = std::env::var("MAP_ERROR").unwrap_or_else(|_| "0.01".to_owned());
    let shares = Shares { pairs: 1.0, ..Shares::SINGLE };
    let set = SetToMake { count, seed, shares, worlds: Worlds::Bench };
    let answers = set.make_rigs(&folder, false, || ()).expect("made");
    let lines = Mutex::new(Vec::new());
    let chosen = |name: &str| chosen.as_ref().is_none_or(|names| names.iter().any(|n| n == name));
    answers.answers.par_iter().filter(|answer| chosen(&answer.name)).for_each(|answer| {
        let mapped = || one(&folder.join(&answer.name), answer.effects.join(" + "), &error);
        // One that fails does not stop the others.
        let Ok(line) = std::panic::catch_unwind(mapped) else {
            return println!("{} | {} | failed", answer.name, answer.effects.join(" + "));
        };
        println!("{}", line.text());
        lines.lock().expect("no thread panicked").push(line);
    });
    let lines = lines.into_inner().expect("no thread panicked");
    for (number, name) in
        ["adaptive", "process alone", "grid, spline", "grid, process", "grid, simulation"]
            .iter()
            .enumerate()
    {
        let of = |f: fn(&Outcome) -> f64| -> Vec<f64> {
            let mut values: Vec<f64> = lines.iter().map(|line| f(&line.outcomes[number])).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let rms = of(|o| o.rms);
        let within = of(|o| o.within);
        println!(
            "{name}: rms median {:.2} %, largest {:.2} %, at most 1 % in {} of {}; within 1.96 SE: mean {:.1} %, from {:.0} to {:.0} %",
            100.0 * rms[rms.len() / 2],
            100.0 * rms[rms.len() - 1],
            rms.iter().filter(|rms| **rms <= 0.01).count(),
            rms.len(),
            100.0 * within.iter().sum::<f64>() / within.len() as f64,
            100.0 * within[0],
            100.0 * within[within.len() - 1],
        );
    }
    let worse = lines.iter().filter(|line| {
        let [adaptive, _, spline, process, _] = line.outcomes;
        adaptive.rms > spline.rms.min(process.rms)
    });
    println!("worse than the better of both plain grids: {}", worse.count());
}

fn one(folder: &Path, effects: String, error: &str) -> Line {
    let begun = Instant::now();
    let text = std::fs::read_to_string(folder.join(fieldgap_blind::LOOP_PLAN)).expect("a plan");
    let head = text.split("[closed_loop]").next().expect("its head");
    // One focus: the second, where a rig has one, has other heights in the full scan.
    let head: String = head.split("\n[[focus]]").take(2).collect::<Vec<_>>().join("\n[[focus]]");
    let most = FULL_SCAN / 8;
    let plan = |prior: &str, readings: usize| {
        let text = format!(
            "{head}\n[adaptive]\nz_mm = [80.0, 120.0, 160.0, 200.0]\nsize_mm = [70.0, 70.0]\nstep_mm = 2.0\n\
             error = {error}\nreadings = {readings}\nprior = \"{prior}\"\n"
        );
        Plan::parse(TomlSource::new(&folder.join("map.toml"), text)).expect("a plan")
    };
    let simulation = plan("simulation", most);
    let rig = BenchRig::open(folder, &simulation);
    let places = places_of(simulation.adaptive.as_ref().expect("a map"), 1);
    let (record, adaptive, end) = adaptive(&rig, simulation, &places);
    let seconds = begun.elapsed().as_secs_f64();
    let readings = record.samples.len();
    let (process_record, process, _) =
        self::adaptive(&rig, plan("process", readings.max(192)), &places);
    let grid = plain_grid(readings);
    let mut session = rig.session(&plan("process", most));
    session.take(&grid);
    let plain = session.record;
    let duration_s = |record: &RecordedScan| record.samples.last().map_or(0.0, |s| s.time_s);
    let levels: Vec<Vec<f64>> =
        places.iter().map(|&(at_m, focus)| rig.levels_v(at_m, focus)).collect();
    let truth = |record: &RecordedScan| -> Vec<f64> {
        let middle_s = middle_s(record);
        levels.iter().map(|levels_v| rig.truth_v(levels_v, middle_s)).collect()
    };
    let [of_adaptive, of_process, of_plain] = [&record, &process_record, &plain].map(truth);
    let by_spline = by_spline(&plain, &record);
    // The plain grid knows the noise of the receiver as the adaptive scan does: by its silent readings.
    let mut plain_with_dark = plain.clone();
    plain_with_dark
        .samples
        .splice(0..0, record.samples.iter().filter(|s| s.focus.is_none()).copied());
    let by = |prior| map(&plain_with_dark, &places, prior, None).expect("a map").estimates;
    let (by_process, by_simulation) = (by(MapPrior::Process), by(MapPrior::Simulation));
    Line {
        name: folder.file_name().expect("a name").to_string_lossy().into_owned(),
        effects,
        found: adaptive.effects.iter().map(|id| id.as_str()).collect::<Vec<_>>().join(" + "),
        readings,
        end,
        factor: adaptive.factor,
        minutes: duration_s(&record) / 60.0,
        seconds,
        outcomes: [
            outcome(&adaptive.estimates, &of_adaptive),
            outcome(&process.estimates, &of_process),
            outcome(&by_spline, &of_plain),
            outcome(&by_process, &of_plain),
            outcome(&by_simulation, &of_plain),
        ],
        process_readings: process_record.samples.len(),
    }
}

/// The mean time of the driven readings, at which a drifting rig is mapped.
fn middle_s(record: &RecordedScan) -> f64 {
    let driven: Vec<f64> =
        record.samples.iter().filter(|s| s.focus.is_some()).map(|s| s.time_s).collect();
    0.5 * (driven[0] + driven[driven.len() - 1])
}

fn adaptive(
    rig: &BenchRig,
    plan: Plan,
    places: &[(Vec3, usize)],
) -> (RecordedScan, FieldMap, Option<MapEnd>) {
    let prior = plan.adaptive.as_ref().expect("a map").prior;
    let mapping = Mapping::new(&plan, &rig.setup, Path::new("unused")).expect("a map");
    let (mut plan, first) = mapping.first_plan(&plan, &rig.setup).expect("a first round");
    let mut rounds = vec![first];
    let mut session = rig.session(&plan);
    loop {
        let readings = plan.readings.last().expect("a round").list.clone();
        let readings: Vec<Planned> = readings.iter().map(|(mm, f)| (mm / 1e3, *f)).collect();
        session.take(&readings);
        let (round, longer) = mapping.decide(&plan, &session.record, &rounds).expect("a decision");
        if std::env::var("MAP_VERBOSE").is_ok() {
            let effects: Vec<_> = round.effects.iter().map(|id| id.as_str()).collect();
            eprintln!("{} {:?} {} {effects:?} {:?}", plan.name, prior, round.reason, round.checks);
        }
        rounds.push(round);
        let Some(text) = longer else { break };
        plan = Plan::parse(TomlSource::new(plan.path(), text)).expect("a plan");
    }
    let checks = checks_of(&session.record, &rounds);
    let made = map(&session.record, places, prior, checks).expect("a map");
    (session.record, made, rounds.last().and_then(|round| round.end))
}

/// As many readings as that, on grids that span the planes; every row in the same direction.
fn plain_grid(readings: usize) -> Vec<Planned> {
    let side = ((readings as f64 / HEIGHTS_MM.len() as f64).sqrt()) as usize;
    let at = |n: usize| 35e-3 * (2.0 * n as f64 / (side - 1) as f64 - 1.0);
    let plane = |z_mm: f64| {
        (0..side * side).map(move |n| (Vec3::new(at(n % side), at(n / side), z_mm / 1e3), Some(0)))
    };
    HEIGHTS_MM.into_iter().flat_map(plane).collect()
}

/// The plain grid by splines, less the noise of the receiver's quadratures; the spline states no errors.
fn by_spline(plain: &RecordedScan, adaptive: &RecordedScan) -> Vec<Estimate> {
    let noise = DarkReadings::of_scan(adaptive).map_or(0.0, |dark| dark.noise(0.02).additive);
    let power = noise * noise * 16.0;
    let level = |reading: f64| {
        let mut square = reading * reading;
        for _ in 0..20 {
            let lost = 0.5708 / (1.0 + 0.434 * square / power.max(f64::MIN_POSITIVE));
            square = (reading * reading - power * (1.0 + lost)).max(0.0);
        }
        square.sqrt()
    };
    let levels: Vec<f64> = plain.samples.iter().map(|sample| level(sample.reading)).collect();
    let of_plane = levels.len() / HEIGHTS_MM.len();
    let side = (of_plane as f64).sqrt().round() as usize;
    let values =
        levels.chunks(of_plane).flat_map(|plane| spline::interpolated(plane, side, SIDE, SIDE));
    values.map(|value| Estimate { amplitude: value.max(0.0), standard_error: 0.0 }).collect()
}

fn outcome(estimates: &[Estimate], truth: &[f64]) -> Outcome {
    let peak = truth.iter().copied().fold(0.0, f64::max);
    let errors: Vec<f64> =
        estimates.iter().zip(truth).map(|(e, truth)| (e.amplitude - truth).abs()).collect();
    let n = truth.len() as f64;
    let within =
        errors.iter().zip(estimates).filter(|(error, e)| **error <= 1.96 * e.standard_error);
    let rms = |squares: f64| (squares / n).sqrt() / peak;
    Outcome {
        rms: rms(errors.iter().map(|e| e * e).sum()),
        largest: errors.iter().copied().fold(0.0, f64::max) / peak,
        within: within.count() as f64 / n,
        stated: rms(estimates.iter().map(|e| e.standard_error.powi(2)).sum()),
    }
}

impl Line {
    fn text(&self) -> String {
        let percent = |share: f64| 100.0 * share;
        let [adaptive, process, spline, by_process, by_simulation] = self.outcomes;
        format!(
            "{} | {} | {} | {} {:?} x{:.2} {:.1} min {:.0} s | adaptive {:.2} max {:.2} stated {:.2} within {:.0} | process {:.2} ({}) within {:.0} | spline {:.2} | grid process {:.2} within {:.0} | grid simulation {:.2} within {:.0}",
            self.name,
            self.effects,
            self.found,
            self.readings,
            self.end,
            self.factor,
            self.minutes,
            self.seconds,
            percent(adaptive.rms),
            percent(adaptive.largest),
            percent(adaptive.stated),
            percent(adaptive.within),
            percent(process.rms),
            self.process_readings,
            percent(process.within),
            percent(spline.rms),
            percent(by_process.rms),
            percent(by_process.within),
            percent(by_simulation.rms),
            percent(by_simulation.within),
        )
    }
}
