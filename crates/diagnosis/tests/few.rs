//! Scans of 30 to 500 readings: lines, single planes, a few planes, and places here and there. What a diagnosis says must be as certain as it is
//! right. The readings are those of the virtual rig's vibrating pistons, which share nothing with the diagnosis.

use std::collections::BTreeSet;
use std::path::Path;

use fieldgap_acoustics::{Simulation, Vec3};
use fieldgap_diagnosis::{Diagnosis, EffectId, Verdict, diagnose};
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap_virtual_rig::{Visit, noise_free_readings};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

const FOCUS_MM: [f64; 3] = [8.0, -5.0, 100.0];

/// Where a scan reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    /// A plane through the focus: points along a side, step in tenths of a millimetre.
    Plane(u32, u32),
    /// Two planes of so many points along a side.
    Planes(u32, u32),
    /// A line along an axis through the focus.
    Line(usize, u32, u32),
    /// Places here and there in a volume.
    Anywhere(u32),
}

const SHAPES: [Shape; 12] = [
    Shape::Plane(13, 20),
    Shape::Plane(21, 35),
    Shape::Plane(8, 90),
    Shape::Plane(6, 60),
    Shape::Planes(12, 40),
    Shape::Planes(6, 100),
    Shape::Line(0, 101, 7),
    Shape::Line(2, 81, 10),
    Shape::Line(1, 41, 20),
    Shape::Line(2, 30, 20),
    Shape::Anywhere(120),
    Shape::Anywhere(400),
];

impl Shape {
    fn places_mm(self, random: &mut ChaCha8Rng) -> Vec<Vec3> {
        let focus_mm = Vec3::from_column_slice(&FOCUS_MM);
        let plane = |side: u32, step_tenths: u32, z_mm: f64| {
            let at = move |n: u32| {
                0.1 * f64::from(step_tenths) * (f64::from(n) - 0.5 * f64::from(side - 1))
            };
            (0..side * side).map(move |n| {
                let (row, column) = (n / side, n % side);
                let column = if row % 2 == 1 { side - 1 - column } else { column };
                Vec3::new(FOCUS_MM[0] + at(column), FOCUS_MM[1] + at(row), z_mm)
            })
        };
        match self {
            Self::Plane(side, step) => plane(side, step, FOCUS_MM[2]).collect(),
            Self::Planes(side, step) => {
                plane(side, step, 85.0).chain(plane(side, step, 120.0)).collect()
            }
            Self::Line(axis, count, step) => (0..count)
                .map(|n| {
                    let along = 0.1 * f64::from(step) * (f64::from(n) - 0.5 * f64::from(count - 1));
                    focus_mm + Vec3::ith(axis, along)
                })
                .collect(),
            Self::Anywhere(count) => (0..count)
                .map(|_| {
                    let mut within = |half: f64| random.random_range(-half..half);
                    focus_mm + Vec3::new(within(25.0), within(25.0), within(25.0))
                })
                .collect(),
        }
    }
}

/// A small scan.
struct Small {
    shape: Shape,
    /// Share of the places that are read again.
    again: f64,
    dark: usize,
    /// Proportional noise, and each quadrature's over the largest level.
    noise: (f64, f64),
    /// The effects at work, as in `[effects]` of a truth file.
    causes: toml::Table,
    seed: u64,
}

impl Small {
    /// Places in the order in which they are read, those that are read again at the end.
    fn visits(&self) -> Vec<Visit> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed ^ 0x5eed);
        let mut places_mm = self.shape.places_mm(&mut random);
        let count = (self.again * places_mm.len() as f64).round() as usize;
        let again: Vec<Vec3> = (0..count).map(|n| places_mm[n * places_mm.len() / count]).collect();
        places_mm.extend(again);
        let visit = |(n, place_mm): (usize, Vec3)| Visit {
            position_m: place_mm * 1e-3,
            velocity_m_s: Vec3::zeros(),
            time_s: n as f64,
        };
        places_mm.into_iter().enumerate().map(visit).collect()
    }

    fn field(&self, causes: &toml::Table) -> Vec<f64> {
        let setup = setup();
        let simulation: Simulation = setup.simulation(setup.simulator, 0).expect("focus 0");
        noise_free_readings(&simulation, causes, 0.05, &self.visits(), self.seed).expect("valid")
    }

    /// The gap that the causes make beside the gain, rms, in standard deviations of a reading.
    fn size(&self) -> f64 {
        let (with, without) = (self.field(&self.causes), self.field(&toml::Table::new()));
        let additive = self.noise.1 * without.iter().fold(0.0f64, |most, level| most.max(*level));
        let weighted = |level: f64, by: f64| level / (self.noise.0 * by).hypot(additive);
        let (mut product, mut power) = (0.0, 0.0);
        for (with, without) in with.iter().zip(&without) {
            let [one, other] = [with, without].map(|level| weighted(*level, *without));
            product += one * other;
            power += other * other;
        }
        let squares = with
            .iter()
            .zip(&without)
            .map(|(with, without)| weighted(with - product / power * without, *without).powi(2));
        (squares.sum::<f64>() / with.len() as f64).sqrt()
    }

    fn record(&self) -> RecordedScan {
        let (visits, field) = (self.visits(), self.field(&self.causes));
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let additive = self.noise.1 * field.iter().fold(0.0f64, |most, level| most.max(*level));
        let mut samples = Vec::new();
        for n in 0..self.dark {
            let reading = (additive * normal()).hypot(additive * normal());
            let time_s = n as f64 - self.dark as f64 - 1.0;
            samples.push(RecordedSample::measured(time_s, None, Vec3::z() * 0.15, reading, None));
        }
        for (visit, level) in visits.iter().zip(field) {
            let (re, im) = (level + additive * normal(), additive * normal());
            let reading = (re.hypot(im) * (1.0 + self.noise.0 * normal())).max(0.0);
            let Visit { position_m, time_s, .. } = *visit;
            samples.push(RecordedSample::measured(time_s, Some(0), position_m, reading, None));
        }
        RecordedScan { setup: setup(), samples }
    }

    /// The ids of the causes.
    fn truth(&self) -> BTreeSet<EffectId> {
        self.causes.keys().map(|id| id.parse().expect("an id")).collect()
    }
}

fn setup() -> ScanSetup {
    setup_of("piston")
}

fn setup_of(simulator: &str) -> ScanSetup {
    let [x, y, z] = FOCUS_MM;
    let text = format!(
        "format = 1\nname = \"small\"\nrecorded = 2026-11-20T10:02:00Z\nreading = \"V\"\n\
         [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
         [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"{simulator}\"\n\
         [[focus]]\nx_mm = {x:?}\ny_mm = {y:?}\nz_mm = {z:?}\n"
    );
    ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("a set-up")
}

/// Causes that a scan at rest may have, with their parameters at a size; a size of one is large.
const CAUSES: [&str; 20] = [
    "sound-speed",
    "absorption",
    "flow",
    "temperature-gradient",
    "spreading",
    "directivity",
    "element-gain",
    "element-phase",
    "dead-elements",
    "polarity",
    "pitch",
    "array-tilt",
    "offset",
    "rotation",
    "axis-scale",
    "receiver-directivity",
    "aperture",
    "saturation",
    "standing-wave",
    "gain-drift",
];

fn cause(id: &str, size: f64, small: &Small, random: &mut ChaCha8Rng) -> toml::Table {
    let turn = random.random_range(0.0..std::f64::consts::TAU);
    let (sin, cos) = turn.sin_cos();
    let one = |name: &str, value: f64| format!("{name} = {value:?}");
    let peak = small.field(&toml::Table::new()).iter().fold(0.0f64, |most, level| most.max(*level));
    let parameters = match id {
        "sound-speed" => one("c_m_s", 343.0 * (1.0 + 0.03 * size * cos.signum())),
        "absorption" => one("db_per_m", 40.0 * size),
        "flow" => format!("vx_m_s = {:?}\nvy_m_s = {:?}", 12.0 * size * cos, 12.0 * size * sin),
        "temperature-gradient" => {
            format!("gx = {:?}\ngy = {:?}\ngz = 0.0", 0.3 * size * cos, 0.3 * size * sin)
        }
        "spreading" => one("exponent", 1.0 + size * cos.signum()),
        "directivity" => one("width_ratio", (0.4 * size * cos.signum()).exp()),
        "element-gain" => one("spread", 0.4 * size),
        "element-phase" => one("spread_rad", size),
        "dead-elements" | "polarity" => format!("elements = [{}]", random.random_range(0..36)),
        "pitch" => one("ratio", 1.0 + 0.05 * size * cos.signum()),
        "array-tilt" => {
            format!("about_x_rad = {:?}\nabout_y_rad = {:?}", 0.12 * size * cos, 0.12 * size * sin)
        }
        "offset" => format!(
            "x_mm = {:?}\ny_mm = {:?}\nz_mm = {:?}",
            4.0 * size * cos,
            4.0 * size * sin,
            4.0 * size * sin
        ),
        "rotation" => one("rad", 0.15 * size * cos.signum()),
        "axis-scale" => format!("x = {:?}\ny = 1.0\nz = 1.0", 1.0 + 0.06 * size * cos.signum()),
        "receiver-directivity" => one("half_angle_deg", 20.0 / size.sqrt()),
        "aperture" => one("radius_mm", 5.0 * size.sqrt()),
        "saturation" => one("level", peak / size.sqrt()),
        "standing-wave" => {
            format!("coefficient = [{:?}, {:?}]", 0.3 * size * cos, 0.3 * size * sin)
        }
        "gain-drift" => {
            let over_s = small.visits().len() as f64;
            format!("relative = {:?}\nover_s = {over_s:?}", 0.4 * size * cos.signum())
        }
        other => unreachable!("{other}"),
    };
    format!("[{id}]\n{parameters}").parse().expect("TOML")
}

/// A small scan of a shape, with a cause that makes about so large a gap, in standard deviations of a reading; without one where none is named.
fn drawn(seed: u64, shape: Shape, id: Option<&str>, target: f64) -> Small {
    let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
    let again = [0.0, 0.0, 0.1, 0.3][random.random_range(0..4)];
    let dark = [0, 4, 4, 32][random.random_range(0..4)];
    let noise = (random.random_range(0.005..0.03), random.random_range(0.002..0.008));
    let mut small = Small { shape, again, dark, noise, causes: toml::Table::new(), seed };
    let Some(id) = id else { return small };
    let mut size = 0.3;
    for _ in 0..4 {
        small.causes = cause(id, size, &small, &mut random.clone());
        let gap = small.size().max(1e-6);
        if (gap / target - 1.0).abs() < 0.1 {
            break;
        }
        size = (size * target / gap).clamp(1e-4, 1.0);
    }
    small.causes = cause(id, size, &small, &mut random);
    small
}

/// How a verdict compares with the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Outcome {
    /// The causes and no others are named; or none, where there are none.
    Right,
    /// They are among the rivals.
    AmongRivals,
    /// Nothing is named that is not there, but not all that is.
    Undecided,
    /// All rivals, or what is named, hold causes that are not there.
    Wrong,
}

fn outcome(small: &Small, found: &Diagnosis) -> Outcome {
    let truth = small.truth();
    let is_truth = |set: &Vec<EffectId>| set.iter().copied().collect::<BTreeSet<_>>() == truth;
    match found.verdict {
        Verdict::None if truth.is_empty() => Outcome::Right,
        Verdict::None | Verdict::Unexplained => Outcome::Undecided,
        Verdict::Explained | Verdict::MostlyExplained => match is_truth(&found.effects) {
            true => Outcome::Right,
            false => Outcome::Wrong,
        },
        Verdict::Ambiguous => match found.alternatives.iter().any(is_truth) {
            true => Outcome::AmongRivals,
            false => Outcome::Wrong,
        },
    }
}

/// Whether the likeliest set is the truth.
fn first_is_right(small: &Small, found: &Diagnosis) -> bool {
    found.ranked[0].effects.iter().copied().collect::<BTreeSet<_>>() == small.truth()
}

fn line(small: &Small, found: &Diagnosis) -> String {
    let names =
        |set: &[EffectId]| set.iter().map(EffectId::to_string).collect::<Vec<_>>().join("+");
    let truth: Vec<EffectId> = small.truth().into_iter().collect();
    let failed: Vec<String> = found
        .residual_tests
        .iter()
        .filter(|t| t.is_structure())
        .map(|t| format!("{} {:.1}", t.name, t.z))
        .collect();
    let rivals: Vec<String> = found.alternatives.iter().map(|set| names(set)).collect();
    format!(
        "{:11} {:3} {:?} n={} again {:.1} dark {} noise {:.2} % {:.2} % (read {:.2} % {:.2} %) truth [{}] {:.2} σ: {} {} {} p={:.3} first [{}] {}",
        format!("{:?}", outcome(small, found)),
        small.seed,
        small.shape,
        found.points,
        small.again,
        small.dark,
        100.0 * small.noise.0,
        100.0 * small.noise.1,
        100.0 * found.noise.multiplicative,
        100.0 * found.noise.additive
            / small.field(&small.causes).iter().fold(0.0f64, |most, level| most.max(*level)),
        names(&truth),
        if truth.is_empty() { 0.0 } else { small.size() },
        found.verdict.name(),
        names(&found.effects),
        rivals.join(" | "),
        found.ranked[0].probability,
        names(&found.ranked[0].effects),
        failed.join("; "),
    )
}

/// The scan of a seed in the sweep.
fn of_sweep(seed: u64) -> Small {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let shape = SHAPES[seed as usize % SHAPES.len()];
    // Half of the scans have no cause.
    let id = random.random_bool(0.5).then(|| CAUSES[random.random_range(0..CAUSES.len())]);
    let target = 0.3 * 20f64.powf(random.random_range(0.0..1.0));
    drawn(seed, shape, id, target)
}

/// Of the sweep's scans those in which causes were named that were not there, most with a probability above nine tenths, while the noise was taken
/// for known.
#[test]
fn few_readings_name_no_cause_that_is_not_there() {
    let wrong: Vec<String> = [12, 17, 27, 92, 135, 137, 216, 260, 267, 291, 305, 311, 326, 328]
        .into_par_iter()
        .filter_map(|seed| {
            let small = of_sweep(seed);
            let found = diagnose(&[small.record()], None).expect("comparable");
            (outcome(&small, &found) == Outcome::Wrong).then(|| line(&small, &found))
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Planes of 169 points through the focus, as in a first look, of pistons that are simulated as Gaussian lobes, at four noises. Against the larger
/// noises a bowed array, or crosstalk, makes nearly the same gap. What is named must then be right as often as a diagnosis that names it claims.
fn first_looks(seeds: u64) {
    let drawn = [0.0025, 0.005, 0.01, 0.02].into_iter().flat_map(|noise| {
        (0..seeds).map(move |seed| Small {
            shape: Shape::Plane(13, 20),
            again: 0.0,
            dark: 4,
            noise: (noise, 0.4 * noise),
            causes: toml::Table::new(),
            seed,
        })
    });
    let drawn: Vec<Small> = drawn.collect();
    let found: Vec<Diagnosis> = drawn
        .par_iter()
        .map(|small| {
            let record = RecordedScan { setup: setup_of("corrected"), ..small.record() };
            diagnose(&[record], None).expect("comparable")
        })
        .collect();
    let lobes = [EffectId::Directivity];
    let (mut right, mut wrong, mut without) = (0, 0, 0);
    for (small, found) in drawn.iter().zip(&found) {
        match found.verdict {
            Verdict::Explained | Verdict::MostlyExplained if found.effects == lobes => right += 1,
            Verdict::Explained | Verdict::MostlyExplained => {
                wrong += 1;
                println!("noise {} seed {}: {}", small.noise.0, small.seed, found.sentence);
            }
            Verdict::Ambiguous => {
                assert!(found.next_measurement.is_some(), "{}", found.sentence);
                without += u64::from(!found.alternatives.iter().any(|set| set == &lobes));
            }
            Verdict::Unexplained | Verdict::None => panic!("{}", found.sentence),
        }
    }
    println!("named: {right} rightly, {wrong} wrongly; {without} have rivals without the lobes");
    // A set is named from a probability of nine tenths on.
    assert!(wrong * 10 <= right + wrong && without * 10 <= drawn.len() as u64);
    assert!(2 * right > drawn.len());
}

#[test]
fn a_first_look_names_the_lobes_or_says_what_else_it_may_be() {
    first_looks(2);
}

#[test]
#[ignore = "160 small scans take a minute or two"]
fn first_looks_at_lobes_are_named_as_certainly_as_stated() {
    first_looks(40);
}

#[test]
#[ignore = "hundreds of small scans take minutes"]
fn stated_probabilities_are_rates_of_being_right() {
    let seeds: u64 = std::env::var("SMALL_SCANS").ok().and_then(|n| n.parse().ok()).unwrap_or(480);
    let scans: Vec<Small> = (0..seeds).map(of_sweep).collect();
    let found: Vec<Diagnosis> = scans
        .par_iter()
        .map(|small| diagnose(&[small.record()], None).expect("comparable"))
        .collect();
    let mut all: Vec<(&Small, &Diagnosis)> = scans.iter().zip(&found).collect();
    all.sort_by_key(|(small, found)| (outcome(small, found), small.seed));
    all.iter().for_each(|(small, found)| println!("{}", line(small, found)));
    let count = |of: &dyn Fn(&Small, &Diagnosis) -> bool| {
        all.iter().filter(|(small, found)| of(small, found)).count()
    };
    for (name, with) in [("none", false), ("one", true)] {
        let is = |small: &Small| small.causes.is_empty() != with;
        println!("causes: {name}, {} scans", count(&|small, _| is(small)));
        for kind in [Outcome::Right, Outcome::AmongRivals, Outcome::Undecided, Outcome::Wrong] {
            println!(
                "  {kind:?}: {}",
                count(&|small, found| is(small) && outcome(small, found) == kind)
            );
        }
    }
    println!("probability of the likeliest set: scans, mean stated, rate of being right");
    let edges = [0.0, 0.3, 0.5, 0.7, 0.85, 0.95, 1.0];
    for edge in edges.windows(2) {
        let within = |found: &Diagnosis| (edge[0]..edge[1]).contains(&found.ranked[0].probability);
        let n = count(&|_, found| within(found));
        let right = count(&|small, found| within(found) && first_is_right(small, found));
        let stated: f64 = all
            .iter()
            .filter(|(_, found)| within(found))
            .map(|(_, found)| found.ranked[0].probability)
            .sum();
        println!(
            "  {:.2} to {:.2}: {n:4} {:.3} {:.3}",
            edge[0],
            edge[1],
            stated / n as f64,
            right as f64 / n as f64
        );
    }
}
