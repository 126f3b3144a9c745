//! Sealed rigs in place of sealed scans: whoever diagnoses one decides what to measure.
//!
//! Each is a virtual rig whose truth file is sealed, with a plan that leaves the readings to a closed loop, and one of the scan that a
//! sealed scan has. Laboratories and causes are drawn as those of sealed scans, and the sizes are those that leave a gap there.
//!
//! Lag is among the causes only where the plans let the robot read in motion: one that stops at each point does not show it. Of the causes
//! outside of the catalogue there are those that a truth file can state.

use std::fmt::Write as _;
use std::path::Path;

use super::answer::Answers;
use super::catalogue::{self, Sizes};
use super::causes::Causes;
use super::error::BlindError;
use super::laboratory::Laboratory;
use super::make::{Drawn, SetToMake, Worlds, drawn};
use super::random_sequence::RandomSequence;
use super::seal_truth::seal_text;
use super::survey::Survey;
use super::unmodelled::UNMODELLED;
use fieldgap_records::Layout;
use fieldgap_virtual_rig::counter_rng::CounterRng;

/// The files of a rig, in its folder.
pub const RIG: &str = "rig.toml";
/// The plan that leaves the readings to a closed loop.
pub const LOOP_PLAN: &str = "find-out.toml";
/// The plan of a full scan.
const FULL_PLAN: &str = "full-scan.toml";
const TRUTH: &str = "truth.sealed";

/// Samples that a reading averages. Each has as much more noise as the average has less.
const SAMPLES: f64 = 16.0;

/// Time in which a drift has its stated size, s: the order of a closed loop. A jump of the level comes at the same share of it as of a sealed
/// scan.
const CHANGES_OVER_S: f64 = 200.0;

/// Relative change of the level at which a drift ends. Until then it goes on at its rate: a drift that ended within a scan is not the effect of
/// the catalogue.
const MOST_DRIFT: f64 = 0.9;

impl SetToMake {
    /// Writes each member as a rig in a folder of its own under `out`, and returns the answers. If it `flies`, its plans of closed loops have
    /// readings in motion, and a lag may be a cause. `made` is called after each.
    ///
    /// # Errors
    /// [`BlindError`] if a rig cannot be written.
    pub fn make_rigs(
        self,
        out: &Path,
        flies: bool,
        made: impl Fn() + Sync,
    ) -> Result<Answers, BlindError> {
        let ids: Vec<&'static str> =
            catalogue::IDS.into_iter().filter(|id| is_of_rigs(id, flies)).collect();
        let outside: Vec<usize> = (0..UNMODELLED.len()).filter(|n| is_of_truth(*n)).collect();
        self.each("blind rigs", &ids, &outside, |number, name, assignment, rng| {
            let mut drawn = drawn(name, assignment, Worlds::Bench, rng);
            // How far the level drifts depends on how long the loop lasts.
            drawn.answer.parameters.retain(|key, _| !key.starts_with("gain-drift."));
            write(&drawn, &out.join(&drawn.answer.name), self.seed ^ number, flies)?;
            made();
            Ok(drawn.answer)
        })
    }
}

/// Whether an effect can be a cause of a rig. How much the air warms depends on how long a loop lasts, and loops do not look for walls and objects.
fn is_of_rigs(id: &'static str, flies: bool) -> bool {
    !["temperature-drift", "wall", "scatterer"].contains(&id) && (flies || shows_at_rest(id))
}

/// Whether an effect shows in the readings of a robot that stands still: a lag does not.
fn shows_at_rest(id: &'static str) -> bool {
    let mut random = RandomSequence::new(CounterRng::new(0));
    let laboratory = Laboratory::draw(&mut random);
    let parameters = match catalogue::draw(id, &laboratory, &mut random) {
        Sizes::Any { largest, at, .. } => at(largest),
        Sizes::OneOf(drawn) => drawn[0].clone(),
    };
    let epochs = Causes::of_catalogue(vec![(id, parameters)]).epochs(&[]);
    epochs.iter().flat_map(|(_, effects)| effects).all(|(_, effect)| effect.lag_s() == 0.0)
}

/// Whether a truth file can state an unmodelled cause.
fn is_of_truth(number: usize) -> bool {
    let mut random = RandomSequence::new(CounterRng::new(0));
    let laboratory = Laboratory::draw(&mut random);
    let draw = UNMODELLED[number].1(&laboratory, &mut random);
    (draw.of_size)(draw.largest).is_of_truth()
}

fn write(drawn: &Drawn, folder: &Path, seed: u64, flies: bool) -> Result<(), BlindError> {
    std::fs::create_dir_all(folder).map_err(BlindError::writing(folder))?;
    let files = [
        (RIG, rig(drawn, seed)),
        (LOOP_PLAN, format!("{}{}{CLOSED_LOOP}", plan_head(drawn), if flies { FLY } else { "" })),
        (FULL_PLAN, format!("{}{}", plan_head(drawn), full_scan(drawn))),
    ];
    for (name, text) in files {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(BlindError::writing(&path))?;
    }
    seal_text(&truth(drawn), &folder.join(TRUTH)).map(drop)
}

/// The truth file: a field of 1/m is a pressure of 1 Pa, and the microphone makes the expected level of it.
fn truth(drawn: &Drawn) -> String {
    let noise = drawn.laboratory.noise();
    let mut effects = drawn.causes.tables();
    let number = |table: &toml::Value, key: &str| table.get(key).and_then(toml::Value::as_float);
    if let Some(drift) = effects.get_mut("gain-drift")
        && let Some(relative) = number(drift, "relative")
    {
        let over_s = CHANGES_OVER_S * MOST_DRIFT / relative.abs();
        *drift =
            toml::toml! { relative = (MOST_DRIFT.copysign(relative)) over_s = (over_s) }.into();
    }
    if let Some(jump) = effects.get_mut("gain-jump")
        && let (Some(at_s), Some(relative)) = (number(jump, "at_s"), number(jump, "relative"))
    {
        let at_s = CHANGES_OVER_S * at_s / drawn.laboratory.survey.lasts_s();
        *jump = toml::toml! { at_s = (at_s) relative = (relative) }.into();
    }
    let table = |entries: &[(&str, f64)]| {
        toml::Value::Table(
            entries.iter().map(|(key, value)| ((*key).to_owned(), (*value).into())).collect(),
        )
    };
    let file = toml::Table::from_iter([
        ("source".to_owned(), table(&[("pressure_pa_at_1_m", 1.0)])),
        ("microphone".to_owned(), table(&[("sensitivity_v_pa", drawn.believed.volts)])),
        (
            "noise".to_owned(),
            table(&[
                ("multiplicative", noise.multiplicative * SAMPLES.sqrt()),
                ("additive_v", noise.additive_v * SAMPLES.sqrt()),
            ]),
        ),
        ("effects".to_owned(), toml::Value::Table(effects)),
    ]);
    toml::to_string(&file).expect("numbers and lists of them")
}

fn rig(drawn: &Drawn, seed: u64) -> String {
    let layout = match drawn.laboratory.array.layout() {
        Layout::Hexagonal { rings, .. } => format!("layout = \"hexagonal\"\nrings = {rings}\n"),
        _ => "layout = \"square\"\ncolumns = 6\nrows = 6\n".to_owned(),
    };
    // TOML has signed numbers.
    let seed = seed >> 1;
    format!(
        "name = \"sealed\"\n\n[array]\nfrequency_hz = 40000.0\n{layout}element_diameter_mm = 10.5\nspacing_mm = 0.0\n\n\
         [medium]\nspeed_of_sound_m_s = 343.0\n\n\
         [motion]\norigin_mm = [150.0, 150.0, -20.0]\ntravel_mm = {{ x = [0.0, 300.0], y = [0.0, 300.0], z = [0.0, 250.0] }}\n\
         feed_mm_s = 80.0\nposition_tolerance_mm = 0.05\n\n[motion.marlin]\n\n\
         [receiver]\nsettle_ms = 20.0\nsamples = {SAMPLES}\n\n[receiver.stream]\nencoding = \"binary\"\n\n\
         [focus_array]\nmodulation_hz = 0.0\nmodulation_duty_percent = 100.0\n\n[focus_array.thesis]\n\n\
         [virtual]\nseed = {seed}\npace = \"lockstep\"\ntruth = \"{TRUTH}\"\n\n\
         [virtual.robot]\ntravel_mm = [300.0, 300.0, 250.0]\nacceleration_mm_s2 = 1000.0\n\n\
         [virtual.receiver]\nrate_hz = 1000.0\nfull_scale_v = 10.0\nresolution_bits = 18\n\n\
         [virtual.array]\nperiod_steps = 8192\n"
    )
}

fn plan_head(drawn: &Drawn) -> String {
    let mut text = format!(
        "name = \"{}\"\nrig = \"{RIG}\"\n\n[simulator]\nmodel = \"piston\"\n",
        drawn.answer.name
    );
    for focus_mm in drawn.laboratory.foci_mm() {
        let [x, y, z] = [focus_mm.x, focus_mm.y, focus_mm.z];
        let _ = write!(text, "\n[[focus]]\nx_mm = {x:?}\ny_mm = {y:?}\nz_mm = {z:?}\n");
    }
    text
}

/// The box of the full scan.
const CLOSED_LOOP: &str =
    "\n[closed_loop]\nmin_mm = [-35.0, -35.0, 80.0]\nmax_mm = [35.0, 35.0, 200.0]\n";

/// A third of the speed is that of the survey, for which causes have their sizes. The leads are longer than the largest lag's way.
const FLY: &str = "\n[fly]\nspeed_mm_s = 55.0\nlead_mm = 8.0\nlag_ms = 0.0\n";

/// The readings of the survey, in their order.
fn full_scan(drawn: &Drawn) -> String {
    let Survey { stops, .. } = &drawn.laboratory.survey;
    let mut text = "\n[[readings]]\nat_mm = [\n".to_owned();
    for stop in stops {
        let [x, y, z] = [stop.at_mm.x, stop.at_mm.y, stop.at_mm.z];
        let _ = writeln!(text, "  [{x}, {y}, {z}],");
    }
    text += "]\nfocus = [\n";
    for stop in stops {
        let _ = writeln!(text, "  {},", stop.focus.map_or(-1, |focus| focus as i64));
    }
    text + "]\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assignment::{Assignment, Category, Shares};
    use fieldgap_virtual_rig::Truth;

    #[test]
    fn a_rig_has_the_noise_and_the_causes_of_its_answer_and_its_plans_are_valid() {
        let folder = tempfile::tempdir().expect("a folder");
        let shares = Shares { pairs: 1.0, ..Shares::SINGLE };
        let set = SetToMake { count: 2, seed: 4, shares, worlds: Worlds::Bench };
        let answers = set.make_rigs(folder.path(), true, || ()).expect("made");
        for answer in &answers.answers {
            assert_eq!(answer.category, Category::Two);
            let at = folder.path().join(&answer.name);
            let truth = Truth::read(&at.join(TRUTH)).expect("it opens");
            let ids: Vec<&str> = truth.effects.iter().map(|(id, _)| *id).collect();
            assert!(answer.effects.iter().all(|id| ids.contains(&id.as_str())), "{ids:?}");
            let [multiplicative, additive_v] = answer.noise;
            assert!((truth.noise.multiplicative.get() / 4.0 - multiplicative).abs() < 1e-12);
            assert!((truth.noise.additive_v.get() / 4.0 - additive_v).abs() < 1e-12);
            for (plan, readings) in [(LOOP_PLAN, 0), (FULL_PLAN, 64 + 4 * 1296 + 240)] {
                let plan = fieldgap_records::Plan::read(&at.join(plan)).expect("a plan");
                assert!(plan.visits().len() == readings || plan.foci.len() == 2);
                assert_eq!(plan.fly.is_some(), plan.closed_loop.is_some());
            }
            // What the closed loop reads does not say what is sealed.
            let text = std::fs::read_to_string(at.join(RIG)).expect("there");
            assert!(answer.effects.iter().all(|id| !text.contains(id.as_str())));
        }
    }

    #[test]
    fn a_robot_at_rest_shows_every_effect_but_a_lag() {
        let hidden: Vec<&str> =
            catalogue::IDS.into_iter().filter(|id| !shows_at_rest(id)).collect();
        assert_eq!(hidden, ["lag"]);
    }

    #[test]
    fn a_drift_goes_on_at_its_rate_and_a_jump_comes_within_a_loop() {
        let of = |id: &'static str, parameters: &str| {
            let rng = CounterRng::new(4);
            let mut drawn = drawn("0000".to_owned(), &Assignment::None, Worlds::Bench, rng);
            let parameters = parameters.parse().expect("TOML");
            drawn.causes = Causes::of_catalogue(vec![(id, parameters)]);
            let text: toml::Table = truth(&drawn).parse().expect("TOML");
            (text["effects"][id].clone(), drawn.laboratory.survey.lasts_s())
        };
        let (drift, _) = of("gain-drift", "relative = -0.1\nover_s = 840.0");
        let value = |table: &toml::Value, key: &str| table[key].as_float().expect("a number");
        let rate = value(&drift, "relative") / value(&drift, "over_s");
        assert!((rate * CHANGES_OVER_S + 0.1).abs() < 1e-12 && value(&drift, "over_s") > 1000.0);
        let (jump, lasts_s) = of("gain-jump", "at_s = 420.0\nrelative = 0.2");
        assert!((value(&jump, "at_s") / CHANGES_OVER_S - 420.0 / lasts_s).abs() < 1e-12);
    }

    #[test]
    fn causes_outside_of_the_catalogue_are_those_of_truth_files() {
        let of_truth = (0..UNMODELLED.len()).filter(|n| is_of_truth(*n));
        let names: Vec<&str> = of_truth.map(|number| UNMODELLED[number].0).collect();
        let all = ["gain-jump", "hot-plume", "row-sag", "screen", "tilted-receiver"];
        assert_eq!(names, all);
        let folder = tempfile::tempdir().expect("a folder");
        let shares = Shares { unmodelled: 1.0, ..Shares::SINGLE };
        let set = SetToMake { count: all.len(), seed: 4, shares, worlds: Worlds::Bench };
        let answers = set.make_rigs(folder.path(), false, || ()).expect("made");
        let mut at_work: Vec<String> = answers
            .answers
            .iter()
            .map(|answer| {
                assert_eq!(answer.category, Category::Unmodelled);
                let truth = Truth::read(&folder.path().join(&answer.name).join(TRUTH));
                let effects = truth.expect("it opens").effects;
                assert_eq!(effects.len(), 1);
                effects[0].0.to_owned()
            })
            .collect();
        at_work.sort_unstable();
        assert_eq!(at_work, all);
    }
}
