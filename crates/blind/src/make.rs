//! Makes a set of scans. Only its answers state their causes.

use std::path::Path;

use rayon::prelude::*;

use super::answer::{Answer, Answers, Imperfections};
use super::assignment::{Assignment, Category, Shares, assign};
use super::catalogue;
use super::causes::{Causes, by_name};
use super::error::BlindError;
use super::laboratory::Laboratory;
use super::noise_units::{Believed, gap_of};
use super::random_sequence::RandomSequence;
use super::sizing::{Sizing, TargetGaps};
use super::unmodelled::UNMODELLED;
use super::varied;
use super::whole_bench;
use super::world::World;
use fieldgap_records::{RecordedSample, RecordedScan};
use fieldgap_virtual_rig::counter_rng::CounterRng;

/// Target gaps of a single cause.
const ALONE: TargetGaps = TargetGaps { least: 0.1, most: 10.0 };

/// Target gaps of each of two or three effects. A smaller effect would not count.
const OF_SEVERAL: TargetGaps = TargetGaps { least: 0.3, most: 10.0 };

/// The specification of a set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetToMake {
    /// Number of scans.
    pub count: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Shares of the categories.
    pub shares: Shares,
    /// Where the scans are made.
    pub worlds: Worlds,
}

/// Where the scans of a set are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Worlds {
    /// One bench: an array of 36 or 37 pistons, four planes, amplitudes with Gaussian noise, and nothing wrong but the causes.
    Bench,
    /// Laboratories that differ in radiators, array, drives, path, receiver and noise.
    Laboratories {
        /// Whether nothing is wrong but the causes. Otherwise each has the imperfections that every careful set-up has.
        ideal: bool,
    },
}

impl Worlds {
    /// A laboratory, for these causes.
    fn draw(self, assignment: &Assignment, random: &mut RandomSequence) -> Laboratory {
        match self {
            Self::Bench => Laboratory::draw(random),
            Self::Laboratories { ideal } => {
                let ids = match assignment {
                    Assignment::Effects(ids) => ids.as_slice(),
                    _ => &[],
                };
                let mut laboratory = varied::laboratory(ids, random);
                if !ideal {
                    varied::make_imperfect(&mut laboratory, ids, random);
                }
                laboratory
            }
        }
    }
}

impl SetToMake {
    /// Writes each scan into a folder of its own under `out`, and returns the answers. The bytes do not depend on the number of
    /// threads. `made` is called after each scan.
    ///
    /// # Errors
    /// [`BlindError`] if a scan cannot be written.
    pub fn make(self, out: &Path, made: impl Fn() + Sync) -> Result<Answers, BlindError> {
        let outside: Vec<usize> = (0..UNMODELLED.len()).collect();
        self.each("blind set", &catalogue::IDS, &outside, |_, name, assignment, rng| {
            let (scan, answer) = one(name, assignment, self.worlds, rng);
            scan.write(&out.join(&answer.name))?;
            made();
            Ok(answer)
        })
    }

    /// Assigns causes to the members of the set, among these effects and these unmodelled causes, and writes each: its number, its name, its causes and its random
    /// numbers. `stream` names those of the set.
    pub(super) fn each(
        self,
        stream: &str,
        ids: &[&'static str],
        outside: &[usize],
        write: impl Fn(u64, String, &Assignment, CounterRng) -> Result<Answer, BlindError> + Sync,
    ) -> Result<Answers, BlindError> {
        let rng = CounterRng::new(self.seed).stream(stream);
        let mut random = RandomSequence::new(rng.stream("assignment"));
        let assignments = assign(self.count, self.shares, ids, outside, &mut random);
        let width = self.count.saturating_sub(1).to_string().len().max(4);
        let answers = assignments
            .par_iter()
            .enumerate()
            .map(|(number, assignment)| {
                let (name, number) = (format!("{number:0width$}"), number as u64);
                write(number, name, assignment, rng.substream(number))
            })
            .collect::<Result<_, BlindError>>()?;
        Ok(Answers { format: 1, seed: self.seed, answers })
    }
}

/// One scan and its answer.
fn one(
    name: String,
    assignment: &Assignment,
    worlds: Worlds,
    rng: CounterRng,
) -> (RecordedScan, Answer) {
    let Drawn { laboratory, causes, believed, answer } = drawn(name, assignment, worlds, rng);
    let world = World::new(&laboratory, &causes, believed.volts, rng);
    (scan(&answer.name, &laboratory, &world), answer)
}

/// A laboratory with the causes at work in it.
pub(super) struct Drawn {
    pub laboratory: Laboratory,
    pub causes: Causes,
    pub believed: Believed,
    pub answer: Answer,
}

/// Draws a laboratory and its causes, each of the size that leaves a random gap in the survey of the laboratory.
pub(super) fn drawn(
    name: String,
    assignment: &Assignment,
    worlds: Worlds,
    rng: CounterRng,
) -> Drawn {
    let mut random = RandomSequence::new(rng.stream("draws"));
    let laboratory = worlds.draw(assignment, &mut random);
    let believed = Believed::new(&laboratory, rng);
    let sizing = Sizing { laboratory: &laboratory, believed: &believed, rng };
    let (category, causes) = match assignment {
        Assignment::None => (Category::None, Causes::none()),
        Assignment::Effects(ids) => {
            let category = [Category::One, Category::Two, Category::Three][ids.len() - 1];
            let targets = if ids.len() == 1 { ALONE } else { OF_SEVERAL };
            let sized = |&id: &&'static str| {
                let mut sizes = catalogue::draw(id, &laboratory, &mut random);
                if worlds == (Worlds::Laboratories { ideal: false }) {
                    sizes = varied::beyond_the_ordinary(id, sizes);
                }
                (id, sizing.effect(id, sizes, targets, &mut random))
            };
            (category, Causes::of_catalogue(ids.iter().map(sized).collect()))
        }
        Assignment::WholeBench => {
            let effects = whole_bench::effects(&sizing, &mut random);
            (Category::WholeBench, Causes::of_catalogue(effects))
        }
        &Assignment::Unmodelled(number) => {
            let draw = UNMODELLED[number].1(&laboratory, &mut random);
            let cause = sizing.unmodelled(&draw, ALONE, &mut random);
            (Category::Unmodelled, Causes::of_unmodelled(cause))
        }
    };
    let gaps_alone_sigma: Vec<f64> =
        causes.each_alone().iter().map(|alone| sizing.gap(alone)).collect();
    let names = causes.names();
    let largest =
        (0..names.len()).max_by(|&a, &b| gaps_alone_sigma[a].total_cmp(&gaps_alone_sigma[b]));
    let world = World::new(&laboratory, &causes, believed.volts, rng);
    let answer = Answer {
        category,
        dominant: largest.filter(|_| category == Category::WholeBench).map(|n| names[n].clone()),
        effects: names,
        parameters: causes.parameters(),
        gap_sigma: sizing.gap(&causes),
        gaps_alone_sigma,
        elements: elements(&world, &laboratory),
        noise: [laboratory.noise().multiplicative, laboratory.noise().additive_v],
        peak_v: laboratory.peak_v,
        imperfections: imperfections(&laboratory, &believed, rng),
        strata: laboratory.strata.clone(),
        name,
    };
    drop(world);
    Drawn { laboratory, causes, believed, answer }
}

/// What the set-up has beside its causes, and the gap that it leaves against a set-up without.
fn imperfections(
    laboratory: &Laboratory,
    believed: &Believed,
    rng: CounterRng,
) -> Option<Imperfections> {
    if laboratory.imperfections.is_empty() {
        return None;
    }
    let ideal = Laboratory { imperfections: Vec::new(), ..laboratory.clone() };
    let none = Causes::none();
    let world = World::new(laboratory, &none, believed.volts, rng);
    let gap_sigma = gap_of(&world, laboratory, &Believed::new(&ideal, rng));
    Some(Imperfections {
        parameters: by_name(laboratory.imperfections.iter().cloned()),
        stated_speed_m_s: laboratory.speed_m_s,
        gap_sigma,
    })
}

fn scan(name: &str, laboratory: &Laboratory, world: &World<'_>) -> RecordedScan {
    let stops = &laboratory.survey.stops;
    let every: Vec<usize> = (0..stops.len()).collect();
    let samples = stops
        .iter()
        .zip(world.phasors_v(&every))
        .enumerate()
        .filter_map(|(n, (stop, phasor_v))| {
            let read_v = world.reading_v(n, stop, phasor_v)?;
            let phase = laboratory.reception.phase;
            let phase_rad = phase.map(|phase| micro(phase.stated_rad(read_v)));
            let sample = RecordedSample::measured(
                stop.time_s,
                stop.focus,
                stop.at_mm * 1e-3,
                micro(read_v.norm()),
                None,
            );
            Some(sample.with_phase(phase_rad))
        })
        .collect();
    RecordedScan { setup: laboratory.setup(name), samples }
}

/// True amplitude and phase of every element, if an effect changed any.
fn elements(world: &World<'_>, laboratory: &Laboratory) -> Option<Vec<[f64; 2]>> {
    let of = |element: &fieldgap_acoustics::Element| [element.amplitude, element.phase_rad];
    let truly: Vec<_> = world.field().array().elements.iter().map(of).collect();
    let believed: Vec<_> = laboratory.elements().elements().iter().map(of).collect();
    (truly != believed).then_some(truly)
}

/// A reading rounded to the microvolt, or a phase to the microradian, as a receiver writes it.
fn micro(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::Vec3;
    use fieldgap_acoustics::rayleigh::{DiscRule, Piston};
    use num_complex::Complex64;

    /// The same field by an independent sum: far more patches per face, and the phases of a focus.
    fn pressure(laboratory: &Laboratory, focus_m: Vec3, at_m: Vec3, rule: &DiscRule) -> f64 {
        let k = std::f64::consts::TAU * 40e3 / 343.0;
        let sum: Complex64 = laboratory
            .elements()
            .elements()
            .iter()
            .map(|element| {
                let face = Piston::new(element.centre_m, element.normal, 4.5e-3, rule);
                let ahead = Complex64::from_polar(1.0, -k * (focus_m - element.centre_m).norm());
                ahead * face.field(at_m, k)
            })
            .sum();
        sum.norm()
    }

    #[test]
    fn a_scan_without_effects_is_the_pistons_field_and_noise_of_the_stated_size() {
        let rng = CounterRng::new(11);
        let (scan, answer) = one("0000".to_owned(), &Assignment::None, Worlds::Bench, rng);
        let laboratory = Laboratory::draw(&mut RandomSequence::new(rng.stream("draws")));
        let rule = DiscRule::new(8, 24);
        let [multiplicative, additive_v] = answer.noise;
        let pairs: Vec<(f64, f64)> = scan
            .samples
            .iter()
            .filter_map(|sample| Some((laboratory.foci_mm()[sample.focus?], sample)))
            .step_by(9)
            .map(|(focus_mm, sample)| {
                let expected = pressure(&laboratory, focus_mm / 1e3, sample.position_m(), &rule);
                (sample.reading, expected)
            })
            // Near zero a magnitude is not normally distributed.
            .filter(|(reading, _)| *reading > 8.0 * additive_v)
            .collect();
        let chi2 = |gain: f64| {
            let squares = pairs.iter().map(|(reading, expected)| {
                let level_v = gain * expected;
                (reading - level_v).powi(2) / additive_v.hypot(multiplicative * level_v).powi(2)
            });
            squares.sum::<f64>() / pairs.len() as f64
        };
        let weigh = |f: fn(f64, f64) -> f64| {
            pairs
                .iter()
                .map(|&(reading, expected)| f(reading, expected) / reading.powi(2))
                .sum::<f64>()
        };
        let gain = weigh(|reading, expected| reading * expected) / weigh(|_, e| e * e);
        let tolerance = 4.0 * (2.0 / pairs.len() as f64).sqrt();
        assert!(pairs.len() > 200 && (chi2(gain) - 1.0).abs() < tolerance, "{}", chi2(gain));
        let silent: Vec<f64> = scan.silent().map(|sample| sample.reading).collect();
        let power = silent.iter().map(|v| v * v).sum::<f64>() / silent.len() as f64;
        assert!((power / (2.0 * additive_v * additive_v) - 1.0).abs() < 0.5);
    }

    /// Every reading of many laboratories against the field and the stated noise, each in its own standard deviations.
    #[test]
    fn readings_scatter_about_the_field_as_their_laboratory_states() {
        let (mut along, mut across, mut complex, mut lost, mut wrong) =
            (Vec::new(), Vec::new(), 0, 0, 0);
        let worlds = Worlds::Laboratories { ideal: true };
        for seed in 0..160 {
            let rng = CounterRng::new(seed);
            let laboratory =
                worlds.draw(&Assignment::None, &mut RandomSequence::new(rng.stream("draws")));
            let (reception, stops) = (laboratory.reception, &laboratory.survey.stops);
            if stops.len() * laboratory.elements().len() > 50_000 || reception.slow > 0.0 {
                continue;
            }
            let (scan, answer) = one("0000".to_owned(), &Assignment::None, worlds, rng);
            assert_eq!(
                (answer.imperfections, scan.setup.phase.is_some()),
                (None, reception.phase.is_some())
            );
            let missing = (stops.len() - scan.samples.len()) as f64;
            let expected = reception.lost * stops.len() as f64;
            assert!(
                (missing - expected).abs() <= 4.0 * expected.sqrt(),
                "{seed}: {missing} {expected}"
            );
            lost += usize::from(missing > 0.0);

            let believed = Believed::new(&laboratory, rng);
            let none = Causes::none();
            let world = World::new(&laboratory, &none, believed.volts, rng);
            let every: Vec<usize> = (0..stops.len()).collect();
            let phasors = world.phasors_v(&every);
            let noise = laboratory.noise();
            let bits = f64::from(reception.bits.unwrap_or(30));
            let step_v = 1.6 * laboratory.peak_v * (-bits).exp2();
            let lasts_s = laboratory.survey.lasts_s();
            for sample in scan.samples.iter().filter(|sample| sample.focus.is_some()) {
                let n = stops.iter().position(|stop| stop.time_s == sample.time_s).expect("a stop");
                let level_v = phasors[n].norm();
                // Near zero a magnitude is not normally distributed, and steps are not noise.
                if level_v < 8.0 * noise.additive_v.max(step_v) {
                    continue;
                }
                let sigma_v = noise.at_v(level_v).hypot(step_v / 12f64.sqrt());
                let off = (sample.reading - level_v) / sigma_v;
                wrong += usize::from(reception.outliers.is_some() && off.abs() > 5.0);
                along.push(off);
                let (Some(phase), Some(stated_rad)) = (reception.phase, sample.phase_rad) else {
                    continue;
                };
                complex += 1;
                let drift_rad = phase.drift_rad * stops[n].time_s / lasts_s;
                let expected =
                    phasors[n] * Complex64::from_polar(1.0, phase.offset_rad + drift_rad);
                let turned = Complex64::from_polar(1.0, phase.convention.turned(stated_rad));
                let off_rad = (turned * expected.conj()).arg();
                let across_v = noise.across_v(level_v).expect("a phase");
                across.push(off_rad * level_v / across_v.hypot(step_v / 12f64.sqrt()));
            }
        }
        assert!(along.len() > 3000 && complex > 500 && lost > 1 && wrong > 2, "{wrong} {lost}");
        for off in [&mut along, &mut across] {
            off.iter_mut().for_each(|z| *z = z.abs());
            off.sort_by(f64::total_cmp);
            // Of a normal distribution half lies within 0.674 and 95.4 % within 2 standard deviations.
            let (median, within_two) = (off[off.len() / 2], off.partition_point(|z| *z <= 2.0));
            let share = within_two as f64 / off.len() as f64;
            assert!((median / 0.674 - 1.0).abs() < 0.06, "{median}");
            assert!((0.93..0.97).contains(&share), "{share}");
        }
    }

    #[test]
    fn a_set_does_not_depend_on_the_number_of_threads() {
        let shares = Shares { pairs: 0.5, unmodelled: 0.5, ..Shares::SINGLE };
        let worlds = Worlds::Bench;
        let set = SetToMake { count: 2, seed: 9, shares, worlds };
        let of_threads = |threads: usize| {
            let folder = tempfile::tempdir().expect("a folder");
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.expect("threads");
            let answers = pool.install(|| set.make(folder.path(), || ())).expect("made");
            let bytes = |answer: &Answer| {
                std::fs::read(folder.path().join(&answer.name).join("samples.csv")).expect("there")
            };
            let samples: Vec<_> = answers.answers.iter().map(bytes).collect();
            (answers, samples)
        };
        assert_eq!(of_threads(1), of_threads(3));
    }

    #[test]
    fn a_set_is_sealed_opened_and_scored() {
        let folder = tempfile::tempdir().expect("a folder");
        let shares = Shares { none: 1.0, ..Shares::SINGLE };
        let set = SetToMake { count: 1, seed: 3, shares, worlds: Worlds::Bench };
        let answers = set.make(folder.path(), || ()).expect("made");
        let seal = super::super::Seal::of(folder.path(), None);
        seal.close(&answers).expect("sealed");
        let diagnoses = folder.path().join("diagnoses");
        let empty = super::super::Score::of_folder(&answers, &diagnoses);
        assert!(matches!(empty, Err(BlindError::NothingToScore(_))));
        std::fs::create_dir(&diagnoses).expect("made");
        std::fs::write(diagnoses.join("0000.json"), r#"{"verdict":"none"}"#).expect("written");
        // Diagnoses are no part of what was committed to.
        let opened = seal.open(None).expect("untouched");
        let score = super::super::Score::of_folder(&opened, &diagnoses).expect("one");
        assert_eq!((score.scored, score.confusion[0].exact), (1, 1));
    }
}
