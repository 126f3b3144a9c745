//! Points measured on a virtual rig with faults injected on its lines: every reading is right, every wait is bounded, every
//! error names device, attempt and last reply.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tokio::time::Instant;

use super::clock::ScanClock;
use super::rig_setup::RigSetup;
use super::sequencer::PointSequencer;
use fieldgap_acoustics::Vec3;
use fieldgap_input::TomlSource;
use fieldgap_records::{FocusSection, PlanPart, Visit, VisitKind, VisitPace};
use fieldgap_rig::focus_array::{Modulation, ThesisArray};
use fieldgap_rig::link::Wire;
use fieldgap_rig::link::fault_injection::FaultRates;
use fieldgap_rig::motion::guarded::Guarded;
use fieldgap_rig::motion::marlin::{Marlin, MarlinConfig};
use fieldgap_rig::receiver::{Encoding, StreamReceiver};
use fieldgap_rig::{Cause, Device, RigError, Role, SafeRig};
use fieldgap_virtual_rig::memory::MemoryRig;
use fieldgap_virtual_rig::{Believed, Truth, VirtualConfig};

/// Longest time without a result or an error.
const NO_HANG: Duration = Duration::from_secs(30);

/// Largest deviation of a reading from the true level, V: the step of the converter, and rounding.
const READING_OFF_V: f64 = 1e-3;

/// No noise, and readings within the range of the converter.
const TRUTH: &str = "[microphone]\nsensitivity_v_pa = 0.002\n";

/// Results of a run.
#[derive(Debug, Default)]
struct Tally {
    lines: u64,
    points: u64,
    impaired: u64,
    errors: BTreeMap<&'static str, u64>,
    longest: Duration,
}

fn rig_setup() -> RigSetup {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/virtual.toml");
    RigSetup::parse(TomlSource::read(&path).expect("it is there")).expect("a rig file")
}

/// The section of a rig file that the virtual rig reads.
#[derive(serde::Deserialize)]
struct Sections {
    #[serde(rename = "virtual")]
    virtual_rig: VirtualConfig,
}

fn foci() -> Vec<FocusSection> {
    [[17.5, -22.5, 100.0], [-12.0, 8.0, 120.0]]
        .map(|at_mm| FocusSection::Point(Vec3::from(at_mm)))
        .to_vec()
}

/// A virtual rig with faults on its lines, opened again after each error.
struct FaultyRig {
    rig_setup: RigSetup,
    config: VirtualConfig,
    rates: FaultRates,
    power_ups: u64,
    openings: u16,
    tally: Tally,
}

impl FaultyRig {
    fn power_up(&mut self) -> MemoryRig {
        self.power_ups += 1;
        let config = VirtualConfig {
            seed: self.config.seed + self.power_ups,
            faults: self.rates,
            ..self.config.clone()
        };
        let believed = Believed {
            array: self.rig_setup.nominal_array().clone(),
            medium: self.rig_setup.nominal_medium(),
            frequency_hz: self.rig_setup.array.frequency_hz(),
            array_origin_m: self.rig_setup.rig.motion.frame().origin_m,
        };
        let truth = Truth::from_source(&TomlSource::new(Path::new("truth.toml"), TRUTH));
        MemoryRig::power_up(&config, truth.expect("no noise"), &believed).expect("it powers up")
    }

    /// Opens the rig and homes it, as a scan does at its beginning.
    async fn open(&mut self, memory: &MemoryRig) -> Result<SafeRig, RigError> {
        let [robot, receiver, array] = memory.plugs();
        // The numbers of openings one second apart.
        self.openings = self.openings.wrapping_add(1000);
        let opening = self.openings;
        let wire = |plug, role| Wire::numbered(plug, Device::new(role, "memory"), opening);
        let modulation = Modulation { frequency_hz: 200.0, duty_percent: 50.0 };
        let array = ThesisArray::begin(wire(array, Role::FocusArray), modulation).await?;
        let receiver =
            StreamReceiver::begin(wire(receiver, Role::Receiver), Encoding::Binary).await?;
        let motion = &self.rig_setup.rig.motion;
        let config: MarlinConfig = toml::from_str("").expect("every key has a default");
        let robot = Marlin::begin(wire(robot, Role::Robot), &config).await?;
        let robot = Guarded::new(Box::new(robot), motion.envelope(), motion.position_tolerance_m());
        let mut rig = SafeRig::new(Box::new(robot), Box::new(receiver), Box::new(array));
        rig.array().continuous_wave().await?;
        rig.motion().home().await?;
        Ok(rig)
    }

    /// Counts an error, and checks that it names device, attempt and last reply.
    fn note(&mut self, error: &RigError) {
        let said = error.to_string();
        assert!(said.contains(" on memory, ") && !error.attempt().is_empty(), "{said}");
        // Without any reply there is no last one; a robot at another position has it in the cause.
        let without = matches!(
            error.cause(),
            Cause::Silent { .. } | Cause::Disconnected | Cause::WrongPosition { .. }
        );
        assert!(error.last_received().is_some() || without, "{said}");
        let kind = match error.cause() {
            Cause::Disconnected => "disconnected",
            Cause::Silent { .. } => "silent",
            Cause::Reset => "reset",
            Cause::Refused { .. } => "refused",
            Cause::LineNotKept { .. } => "out of step",
            Cause::RepeatedlyDamaged { .. } => "keeps garbling",
            Cause::WrongPosition { .. } => "elsewhere",
            Cause::NoReadings { .. } => "no readings",
            Cause::Unreadable { .. } => "unreadable",
            Cause::EndstopHit { .. } => "end switch",
            Cause::Halted { .. } => "halted",
            _ => panic!("an error that no injected fault explains: {said}"),
        };
        *self.tally.errors.entry(kind).or_default() += 1;
    }

    fn took(&mut self, since: Instant, what: &str) {
        let took = since.elapsed();
        self.tally.longest = self.tally.longest.max(took);
        assert!(took <= NO_HANG, "{what} took {took:?}");
    }

    /// Measures random points until so many lines were sent.
    async fn run(&mut self, lines: u64) {
        let mut draws = ChaCha8Rng::seed_from_u64(self.config.seed);
        while self.tally.lines < lines {
            let memory = self.power_up();
            // A few times the devices are only opened again, as on resuming; otherwise they are power-cycled.
            for _ in 0..draws.random_range(1..4) {
                let opening = Instant::now();
                match self.open(&memory).await {
                    Ok(mut rig) => self.measure(&memory, &mut rig, &mut draws).await,
                    Err(error) => self.note(&error),
                }
                // Opening takes many exchanges, each with its own time limit.
                assert!(opening.elapsed() < NO_HANG * 2000, "it never ends");
            }
            self.tally.lines += memory.lines_sent();
        }
    }

    /// Measures points until something fails.
    async fn measure(&mut self, memory: &MemoryRig, rig: &mut SafeRig, draws: &mut ChaCha8Rng) {
        let foci = foci();
        let mut sequencer = PointSequencer::new(&self.rig_setup, &foci, ScanClock::from_start());
        for _ in 0..2000 {
            let mm = |draws: &mut ChaCha8Rng, low: f64, high: f64| {
                (draws.random_range(low..high) * 100.0).round() * 1e-5
            };
            let position_m =
                Vec3::new(mm(draws, -30.0, 30.0), mm(draws, -30.0, 30.0), mm(draws, 60.0, 150.0));
            let focus = [None, Some(0), Some(0), Some(1)][draws.random_range(0..4)];
            let (kind, part) = (VisitKind::Point, PlanPart::Region(0));
            let visit = Visit { kind, focus, position_m, pace: VisitPace::OfPlan, part };
            let begun = Instant::now();
            let measured = sequencer.measure(rig, &visit).await;
            self.took(begun, "a point");
            match measured {
                Ok(measurement) => {
                    self.tally.points += 1;
                    self.tally.impaired += u64::from(measurement.lost > 0);
                    self.check_reading(memory, &sequencer, &visit, &measurement.sample);
                }
                Err(error) => {
                    self.note(&error);
                    let begun = Instant::now();
                    let report = rig.make_safe(error.to_string()).await;
                    assert!(begun.elapsed() <= Duration::from_secs(5));
                    if report.array.is_ok() {
                        let now_s = memory.clock.now_s();
                        assert!(!memory.world.drive_at(now_s).emitting, "{report}");
                    }
                    return;
                }
            }
        }
    }

    /// Compares a reading with the truth: position, drive of the array, level of the field.
    fn check_reading(
        &self,
        memory: &MemoryRig,
        sequencer: &PointSequencer,
        visit: &Visit,
        sample: &fieldgap_records::RecordedSample,
    ) {
        // At its last sample: a later restart does not affect it.
        let (world, now_s) = (&memory.world, memory.clock.now_s() - 1e-3);
        let off_m = (world.nozzle_m(now_s) - visit.position_m).norm();
        assert!(off_m < 0.1e-3, "the nozzle is {} mm off at {visit:?}", off_m * 1e3);
        let drive = world.drive_at(now_s);
        assert_eq!(drive.emitting, visit.focus.is_some(), "{visit:?}");
        if let Some(focus) = visit.focus {
            let clock_hz = self.rig_setup.array.frequency_hz() * 256.0;
            let wanted = sequencer.delays_of(focus);
            for (element, (told, is)) in wanted.iter().zip(&drive.delays_s).enumerate() {
                let fieldgap_rig::ElementDelay::Seconds(told) = told else { continue };
                let steps = (is.expect("it sounds") - told) * clock_hz;
                let off = (steps - (steps / 256.0).round() * 256.0).abs();
                assert!(off <= 0.5 + 1e-6, "element {element} is {off} steps off at {visit:?}");
            }
            assert_eq!(drive.duty, 1.0, "it sounds without modulation");
        }
        let level_v = world.reading_v(now_s, 0);
        assert!(
            (sample.reading - level_v).abs() < READING_OFF_V,
            "{} V were read where {level_v} V are at {visit:?}",
            sample.reading
        );
    }
}

async fn run_with_faults(rate: f64, lines: u64) -> Tally {
    let rig_setup = rig_setup();
    let sections: Sections = rig_setup.source().parse().expect("a [virtual] section");
    let config = sections.virtual_rig;
    let rates = FaultRates::even(rate).expect("a rate");
    let mut rig =
        FaultyRig { rig_setup, config, rates, power_ups: 0, openings: 0, tally: Tally::default() };
    rig.run(lines).await;
    println!("each kind of fault at {rate}: {:?}", rig.tally);
    rig.tally
}

#[tokio::test(start_paused = true)]
async fn line_faults_cause_no_wrong_reading() {
    for rate in [0.001, 0.01] {
        let tally = run_with_faults(rate, 6000).await;
        assert!(tally.points > 100, "{tally:?}");
    }
}

/// Each rate is that of one kind of fault; the six frequent kinds add up to 0.1 to 5 percent of all lines.
async fn faulty_lines_cause_no_wrong_reading(lines: u64) {
    for percent in [5.0, 2.0, 0.5, 0.1] {
        let tally = run_with_faults(percent / 100.0 / 6.0, lines / 4).await;
        assert!(tally.points > lines / 100, "{tally:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_hundred_thousand_faulty_lines_cause_no_wrong_reading() {
    faulty_lines_cause_no_wrong_reading(100_000).await;
}

#[tokio::test(start_paused = true)]
#[ignore = "takes half a minute"]
async fn a_million_faulty_lines_cause_no_wrong_reading() {
    faulty_lines_cause_no_wrong_reading(1_000_000).await;
}
