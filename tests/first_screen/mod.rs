//! The first screen of a report: headline, cause and remedy.

use crate::{diagnosis_synthetic, report_synthetic};
use fieldgap::acoustics::Simulator;
use fieldgap::comparison::{Comparison, PlaneComparison, Uncertain};
use fieldgap::diagnosis::{Diagnosis, EffectId, Verdict, WaterfallPart, WaterfallStep};
use fieldgap::report::{
    Cause, ProposedChange, ProposedCorrection, headline, headline_of_diagnosis, write,
};

/// Words of letters; figures, signs and units are not counted.
fn words(headline: &str) -> usize {
    let is_word = |word: &&str| word.chars().any(char::is_alphabetic) && *word != "mm";
    headline
        .split([' ', '\u{a0}'])
        .map(|word| word.trim_matches([':', ',']))
        .filter(is_word)
        .count()
}

fn comparison(heights_mm: &[f64]) -> Comparison {
    let mut all = report_synthetic::comparisons(&[Simulator::Corrected], heights_mm, 5.0);
    all.remove(0)
}

/// The comparison with planes changed so that each judgement occurs.
fn judged() -> Vec<(&'static str, Comparison)> {
    let with = |change: fn(&mut PlaneComparison)| {
        let mut comparison = comparison(&[100.0]);
        comparison.planes.iter_mut().for_each(change);
        comparison
    };
    vec![
        (
            "agree",
            with(|plane| {
                plane.discrepancy.peak_distance_m = Uncertain { value: 1e-4, standard_error: 1e-4 };
                plane.agreement.residual_rms_ratio = 0.033;
            }),
        ),
        (
            "times the simulation",
            with(|plane| {
                plane.discrepancy.peak_distance_m = Uncertain { value: 1e-4, standard_error: 1e-4 };
                plane.agreement.residual_rms_ratio = 0.4;
                plane.agreement.residual_rms_ratio_own_gain = 0.03;
                plane.agreement.gain_ratio = 1.7;
            }),
        ),
        (
            "misses the peak",
            with(|plane| {
                plane.discrepancy.peak_distance_m =
                    Uncertain { value: 12.5e-3, standard_error: 1e-4 };
                plane.agreement.correlation = 0.5;
            }),
        ),
        (
            "differ",
            with(|plane| {
                plane.discrepancy.peak_distance_m = Uncertain { value: 1e-4, standard_error: 1e-4 };
                plane.agreement.residual_rms_ratio = 0.4;
                plane.agreement.residual_rms_ratio_own_gain = 0.4;
            }),
        ),
    ]
}

fn named(effects: &[EffectId]) -> Diagnosis {
    let mut diagnosis = diagnosis_synthetic::explained(&[100.0], 5.0);
    diagnosis.effects = effects.to_vec();
    diagnosis.waterfall = effects
        .iter()
        .map(|effect| WaterfallStep {
            part: WaterfallPart::Effect,
            effect: Some(*effect),
            share: 1.0 / effects.len() as f64,
        })
        .collect();
    diagnosis
}

#[test]
fn every_headline_has_at_most_fifteen_words() {
    for (difference, comparison) in judged() {
        let mut two_drives = comparison.clone();
        two_drives.planes.push(PlaneComparison { focus: 1, ..comparison.planes[0].clone() });
        for comparison in [&comparison, &two_drives] {
            for &effect in EffectId::ALL {
                for effects in [vec![effect], vec![effect, EffectId::Offset, EffectId::Lag]] {
                    let headline = headline(comparison, Some(&named(&effects)));
                    assert!(headline.contains(difference), "{headline}");
                    assert!(words(&headline) <= 15, "{} words: {headline}", words(&headline));
                    let alone = headline_of_diagnosis(&named(&effects));
                    assert!(words(&alone) <= 15, "{} words: {alone}", words(&alone));
                }
            }
            for verdict in [Verdict::None, Verdict::Unexplained, Verdict::Ambiguous] {
                let diagnosis = Diagnosis { verdict, ..named(&[]) };
                let headline = headline(comparison, Some(&diagnosis));
                assert!(words(&headline) <= 15, "{} words: {headline}", words(&headline));
            }
        }
    }
}

#[test]
fn the_headline_names_the_largest_cause_and_a_peak_inside_the_map() {
    let (_, mut comparison) = judged().remove(2);
    let mut at_edge = comparison.planes[0].clone();
    at_edge.z_m = 0.2;
    at_edge.discrepancy.peak_distance_m.value = 19.5e-3;
    at_edge.scan.peak_at_edge = true;
    comparison.planes.push(at_edge);
    let mut diagnosis = named(&[EffectId::Directivity, EffectId::PhasePlane]);
    diagnosis.waterfall[1].share = 0.9;
    assert_eq!(
        headline(&comparison, Some(&diagnosis)).replace('\u{a0}', " "),
        "The simulation misses the peak by 12.50 ± 0.10 mm at 100 mm: phases frozen at the focal height + 1 more"
    );
}

#[test]
fn the_first_screen_has_cause_keys_command_and_links() {
    let folder = tempfile::tempdir().expect("a folder");
    let comparison = comparison(&[100.0]);
    let diagnosis = diagnosis_synthetic::explained(&[100.0], 5.0);
    let correction = ProposedCorrection {
        file: "rig.toml".to_owned(),
        changes: vec![ProposedChange {
            key: "medium.speed_of_sound_m_s".to_owned(),
            before: Some("343.0".to_owned()),
            after: Some("347.12".to_owned()),
        }],
        fitted: vec!["sound-speed.c_m_s = 347.12 ± 0.21".to_owned()],
        manual: Vec::new(),
        command: "fieldgap diagnose scan --apply scan/rig.toml --out corrected-rig.toml".to_owned(),
    };
    let mut context = report_synthetic::context();
    context.pages = vec![("Why they differ".to_owned(), "why/index.html".to_owned())];
    let cause = Cause { diagnosis: &diagnosis, correction: Some(&correction) };
    let files = write(folder.path(), &context, &[comparison], Some(cause)).expect("written");
    let page = std::fs::read_to_string(files.index).expect("a page");
    let place = |words: &str| page.find(words).unwrap_or_else(|| panic!("no {words}"));
    let order = [
        "<h1>",
        "href=\"why/index.html\"",
        "another speed of sound: ",
        "medium.speed_of_sound_m_s",
        "343.0",
        "347.12",
        "--apply scan/rig.toml",
        "<source media",
        "<h2>Findings",
        "<h2>How to read this page",
    ];
    let places: Vec<usize> = order.iter().map(|words| place(words)).collect();
    assert!(places.is_sorted(), "{places:?}");
}
