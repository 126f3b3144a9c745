//! Diagnoses made by hand: the scan is the corrected simulation in faster air, in volts, with a little noise.

use std::collections::BTreeMap;

use fieldgap::acoustics::{Array, Excitation, Medium, PlaneGrid, Simulation, Simulator, Vec3};
use fieldgap::comparison::{
    ComparedMap, Estimate, Mirror, Noise, NoiseSource, Registering, Registration,
    UndeterminedCombination,
};
use fieldgap::diagnosis::{
    Candidate, DiagnosedPlane, Diagnosis, EffectId, FittedParameter, HeldOutBy, KindShares,
    NextMeasurement, PlaneShare, Region, RegionShare, ResidualTest, Verdict, WaterfallPart,
    WaterfallStep, Where,
};

use crate::report_synthetic::{FOCUS_M, figured, noise};

const GAIN_V: f64 = 0.12;
const BELIEVED_M_S: f64 = 343.0;
const TRUE_M_S: f64 = 347.1;
const NOISE: Noise = Noise { additive: 0.002, multiplicative: 0.01, source: NoiseSource::Repeats };

/// Faster air than believed, found.
pub fn explained(heights_mm: &[f64], step_mm: f64) -> Diagnosis {
    let planes: Vec<DiagnosedPlane> =
        heights_mm.iter().map(|z_mm| plane(*z_mm, step_mm * 1e-3)).collect();
    let squares = |residual: fn(&DiagnosedPlane, usize) -> f64| -> Vec<f64> {
        let sum = |plane: &DiagnosedPlane| -> f64 {
            (0..plane.measured.len()).map(|point| residual(plane, point).powi(2)).sum()
        };
        planes.iter().map(sum).collect()
    };
    let before = squares(|plane, point| plane.measured[point] - plane.before[point]);
    let after = squares(|plane, point| plane.measured[point] - plane.after[point]);
    let noise = squares(|plane, point| sigma_v(plane.after[point]));
    let scan = squares(|plane, point| plane.measured[point]);
    let whole = |parts: &[f64]| parts.iter().sum::<f64>();
    let gap = |left: &[f64]| (whole(left) / whole(&scan)).sqrt();
    let shares = (0..planes.len()).map(|index| PlaneShare {
        scan: 0,
        focus: 0,
        z_mm: planes[index].z_mm,
        share: (before[index] - noise[index]) / (whole(&before) - whole(&noise)),
        gap: (before[index] / scan[index]).sqrt(),
        gap_after: (after[index] / scan[index]).sqrt(),
        noise: (noise[index] / scan[index]).sqrt(),
    });
    let shares: Vec<PlaneShare> = shares.collect();
    let points = planes.iter().map(|plane| plane.measured.len()).sum();
    let mut ranked = ranked();
    for candidate in &mut ranked {
        // Those that leave all of the gap leave as much as there is.
        candidate.gap_after = candidate.gap_after.min(gap(&before)).max(gap(&after));
        candidate.gap_after_held_out = candidate.gap_after_held_out.min(1.02 * gap(&before));
    }
    Diagnosis {
        uncertainty: None,
        format: 1,
        scan: "thesis-focus".to_owned(),
        scans: vec!["thesis-focus".to_owned()],
        simulator: Simulator::Corrected,
        reading_unit: "V".to_owned(),
        outliers: 0,
        elements: None,
        points,
        verdict: Verdict::Explained,
        effects: vec![EffectId::SoundSpeed],
        remainder: None,
        alternatives: Vec::new(),
        ranked,
        gap_before: gap(&before),
        gap_before_held_out: 1.02 * gap(&before),
        held_out_by: HeldOutBy::Place,
        held_out_block_mm: Some(14.0),
        noise_floor: gap(&noise),
        explained_fraction: 0.9982,
        r#where: Where {
            planes: shares,
            regions: vec![
                RegionShare { region: Region::MainLobe, share: 0.402 },
                RegionShare { region: Region::SideLobes, share: 0.351 },
                RegionShare { region: Region::Outside, share: 0.247 },
            ],
            kinds: KindShares { gain: 0.053, registration: 0.021, shape: 0.924, noise: 0.002 },
        },
        next_measurement: None,
        noise: NOISE,
        slow_noise: None,
        phase: None,
        registration: registration(),
        residual_tests: vec![
            residual_test("neighbours alike", 0.8, Some(61.2), None),
            residual_test("planes off as a whole", -1.1, Some(12.4), None),
            residual_test("elements graded across the array", 4.4, Some(8.7), None),
            residual_test("a screw that is out of true", 5.2, None, Some("of x, 8.0 mm a turn")),
        ],
        waterfall: vec![
            added(EffectId::SoundSpeed, 0.9982),
            residual(0.0018),
        ],
        undetermined: vec![
            "The height of the scan and the speed of sound are known together only: 0.5 mm higher and 0.4 m/s faster \
             would look the same."
                .to_owned(),
        ],
        sentence: "Sound travels at 347.12 ± 0.21 m/s, not at 343.00 m/s as believed; with that the gap shrinks \
                   to what noise leaves (probability 0.993)."
            .to_owned(),
        planes,
    }
}

fn added(effect: EffectId, share: f64) -> WaterfallStep {
    WaterfallStep { part: WaterfallPart::Effect, effect: Some(effect), share }
}

fn residual(share: f64) -> WaterfallStep {
    WaterfallStep { part: WaterfallPart::Residual, effect: None, share }
}

/// The same scan at one height, where a larger array looks like faster air.
pub fn ambiguous(step_mm: f64) -> Diagnosis {
    let mut diagnosis = explained(&[150.0], step_mm);
    diagnosis.verdict = Verdict::Ambiguous;
    diagnosis.effects.clear();
    diagnosis.alternatives = vec![vec![EffectId::SoundSpeed], vec![EffectId::Pitch]];
    diagnosis.ranked[0].probability = 0.55;
    diagnosis.ranked[1].probability = 0.44;
    diagnosis.ranked[1].log_evidence = -0.223;
    diagnosis.ranked[1].gap_after = 0.0125;
    diagnosis.ranked[1].gap_after_held_out = 0.0139;
    diagnosis.sentence = "Faster air and an array larger than modelled explain these readings equally well; a scan at \
                          a second height tells them apart."
        .to_owned();
    diagnosis.next_measurement = Some(NextMeasurement {
        what: "Scan at 50 mm and at 200 mm: with faster air the focus moves towards the array, with a larger array it \
               does not."
            .to_owned(),
        expected_sigma: 41.3,
        present_sigma: 0.7,
        readings: 1250,
        duration_s: Some(900.0),
        plan: Some(
            "name = \"faster-air-or-larger-array\"\n\n[simulator]\nmodel = \"corrected\"\n\n[[focus]]\nx_mm = 17.5\n\
             y_mm = -22.5\nz_mm = 100.0\n\n[[plane]]\nz_mm = [50.0, 200.0]\nsize_mm = [70.0, 70.0]\nstep_mm = 5.0\n"
                .to_owned(),
        ),
    });
    diagnosis
}

/// Two causes at once, one of them among the elements, the other a reflection.
pub fn two_causes(heights_mm: &[f64], step_mm: f64) -> Diagnosis {
    let mut diagnosis = explained(heights_mm, step_mm);
    diagnosis.effects = vec![EffectId::DeadElements, EffectId::Reflection];
    let parameters = BTreeMap::from([
        ("dead-elements.elements".to_owned(), FittedParameter::Elements { value: vec![3, 17] }),
        ("reflection.height_mm".to_owned(), real(412.0, 1.3)),
        (
            "reflection.coefficient".to_owned(),
            FittedParameter::Complex { value: [0.13, -0.07], standard_error: [0.01, 0.02] },
        ),
    ]);
    let both = Candidate {
        effects: diagnosis.effects.clone(),
        parameters,
        readings: vec![
            "Elements 3 and 17 are silent.".to_owned(),
            "A surface 412 mm above the array sends back 15 % of the sound.".to_owned(),
        ],
        ..diagnosis.ranked[0].clone()
    };
    diagnosis.ranked[0] = both;
    diagnosis.waterfall = vec![
        added(EffectId::DeadElements, 0.83),
        added(EffectId::Reflection, 0.14),
        residual(0.03),
    ];
    diagnosis.sentence =
        "Elements 3 and 17 are silent, and a surface 412 mm above the array reflects (probability 0.993).".to_owned();
    diagnosis
}

/// A simulation that is right.
pub fn no_gap(step_mm: f64) -> Diagnosis {
    let mut diagnosis = explained(&[100.0], step_mm);
    diagnosis.verdict = Verdict::None;
    diagnosis.effects.clear();
    diagnosis.ranked.reverse();
    for (place, candidate) in diagnosis.ranked.iter_mut().enumerate() {
        candidate.probability = if place == 0 { 0.96 } else { 0.01 };
        candidate.log_evidence = if place == 0 { 0.0 } else { -4.5 };
    }
    diagnosis.gap_before = 0.0119;
    diagnosis.gap_before_held_out = 0.0119;
    diagnosis.explained_fraction = 0.0;
    diagnosis.r#where.planes[0].share = f64::NAN;
    diagnosis.waterfall.clear();
    diagnosis.residual_tests.clear();
    diagnosis.undetermined.clear();
    diagnosis.sentence =
        "Scan and simulation differ by no more than noise: 1.2 % of the scan's rms.".to_owned();
    diagnosis
}

fn real(value: f64, standard_error: f64) -> FittedParameter {
    FittedParameter::Real { value, standard_error }
}

fn ranked() -> Vec<Candidate> {
    let candidate = |effects: &[EffectId],
                     (probability, log_evidence): (f64, f64),
                     parameters: &[(&str, FittedParameter)],
                     reading: &str,
                     gap_after: f64| Candidate {
        effects: effects.to_vec(),
        probability,
        log_evidence,
        parameters: parameters.iter().map(|(name, fit)| (name.to_string(), fit.clone())).collect(),
        readings: Vec::from_iter((!reading.is_empty()).then(|| reading.to_owned())),
        gap_after,
        gap_after_held_out: 1.1 * gap_after,
    };
    vec![
        candidate(
            &[EffectId::SoundSpeed],
            (0.9928, 0.0),
            &[("sound-speed.c_m_s", real(347.1234, 0.2061))],
            "Sound is 1.2 % faster than believed, as in air about 7 °C warmer.",
            0.0124,
        ),
        candidate(
            &[EffectId::SoundSpeed, EffectId::Pitch],
            (0.0062, -5.1),
            &[("pitch.ratio", real(1.0003, 0.0009)), ("sound-speed.c_m_s", real(347.0, 0.6))],
            "The array is as large as modelled, within the error.",
            0.0124,
        ),
        candidate(
            &[EffectId::Pitch],
            (0.0008, -7.2),
            &[("pitch.ratio", real(0.979, 0.002))],
            "The array is 2.1 % smaller than modelled.",
            0.041,
        ),
        candidate(&[EffectId::TemperatureGradient], (2e-12, -28.0), &[], "", 0.12),
        candidate(&[EffectId::DriveFrequency], (0.0, -711.0), &[], "", 0.21),
        candidate(&[], (0.0, -20_711.0), &[], "", 0.2731),
    ]
}

fn registration() -> Registration {
    let held = |value| Estimate { value, standard_error: 0.0, estimated: false };
    Registration {
        requested: Registering::Auto,
        chosen: Registering::GainAndShift,
        why: "the whole pose explains no more than the gain and a small shift do".to_owned(),
        gain: Estimate { value: GAIN_V, standard_error: 0.0007, estimated: true },
        mirror: Mirror::None,
        turn_rad: held(0.0),
        step_ratio: held(1.0),
        shift_m: [held(0.0); 3],
        receiver_face_m: None,
        tried: Vec::new(),
        undetermined: Vec::<UndeterminedCombination>::new(),
        phases: None,
    }
}

/// The corrected simulation, in volts, where sound travels at a speed the delays were not computed for.
fn field_v(speed_of_sound_m_s: f64, grid: &PlaneGrid) -> Vec<f64> {
    let array = Array::square(6, 6, 10.5e-3).expect("not empty");
    let believed = Medium { speed_of_sound_m_s: BELIEVED_M_S };
    let phases = Excitation::Focus(Vec3::from(FOCUS_M)).phases_rad(&array, &believed, 40e3);
    let simulation = Simulation {
        simulator: Simulator::Corrected,
        array,
        medium: Medium { speed_of_sound_m_s },
        frequency_hz: 40e3,
        excitation: Excitation::Phases(phases),
    };
    simulation.magnitudes(&grid.points()).into_iter().map(|pressure| GAIN_V * pressure).collect()
}

fn sigma_v(level_v: f64) -> f64 {
    NOISE.additive.hypot(NOISE.multiplicative * level_v)
}

fn plane(z_mm: f64, step_m: f64) -> DiagnosedPlane {
    let grid = PlaneGrid::square(0.035, step_m, z_mm * 1e-3);
    let truth = field_v(TRUE_M_S, &grid);
    let measured: Vec<f64> = truth
        .iter()
        .enumerate()
        .map(|(index, &level)| (level + sigma_v(level) * noise(index + z_mm as usize)).max(0.0))
        .collect();
    let (before, after) = (field_v(BELIEVED_M_S, &grid), field_v(347.12, &grid));
    let residual = |model: &[f64]| -> Vec<f64> {
        let pairs = measured.iter().zip(model);
        pairs.map(|(measured, model)| (measured - model) / sigma_v(*model)).collect()
    };
    let map = |simulation: &[f64]| ComparedMap {
        x_m: grid.x_m.clone(),
        y_m: grid.y_m.clone(),
        scan: measured.clone(),
        simulation: simulation.to_vec(),
        phase_rad: None,
    };
    let with_before = figured(z_mm * 1e-3, map(&before));
    let with_after = figured(z_mm * 1e-3, map(&after));
    DiagnosedPlane {
        scan: 0,
        focus: 0,
        z_mm,
        residual_before: residual(&before),
        residual_after: residual(&after),
        figures: Some([with_before.scan, with_before.simulation, with_after.simulation]),
        x_m: grid.x_m,
        y_m: grid.y_m,
        measured,
        before,
        after,
    }
}

fn residual_test(
    name: &'static str,
    z: f64,
    z_before: Option<f64>,
    sign_of: Option<&'static str>,
) -> ResidualTest {
    ResidualTest { name, z, z_before, limit: 3.3, sign_of: sign_of.map(str::to_owned) }
}
