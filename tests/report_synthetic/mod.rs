//! Comparisons with a known answer: the scan is the corrected simulation itself, in volts, with a little noise.

use fieldgap::acoustics::metrics::{
    Convention, PlaneMap, THESIS_THRESHOLD, focal_radius, peak, sub_peaks,
};
use fieldgap::acoustics::{Array, Excitation, Medium, PlaneGrid, Simulation, Simulator, Vec3};
use fieldgap::comparison::{
    Agreement, ComparedMap, Comparison, Discrepancy, Estimate, FieldFigures, FocalRadiusFigure,
    Levels, Mirror, Noise, NoiseSource, PeakLevel, PlaneComparison, PlaneLevels, Pose, Registering,
    Registration, TriedRegistration, Uncertain, UndeterminedCombination,
};
use fieldgap::level::{Budget, Kind, Line, level_db};
use fieldgap::report::{InputFile, ReportContext, SimulatedMap};

pub const FOCUS_M: [f64; 3] = [0.0175, -0.0225, 0.1];
const GAIN_V: f64 = 0.12;
const NOISE_V: f64 = 0.015;
const SHIFT_ERROR_M: f64 = 4e-5;

/// The thesis's set-up, scanned at some heights, against some simulators.
pub fn comparisons(simulators: &[Simulator], heights_mm: &[f64], step_mm: f64) -> Vec<Comparison> {
    simulators
        .iter()
        .map(|&simulator| {
            let planes: Vec<PlaneComparison> = heights_mm
                .iter()
                .map(|&z_mm| plane(simulator, z_mm * 1e-3, step_mm * 1e-3))
                .collect();
            let maps = || planes.iter().filter_map(|plane| plane.map.as_ref());
            let scan: Vec<f64> = maps().flat_map(|map| map.scan.clone()).collect();
            let simulation: Vec<f64> = maps().flat_map(|map| map.simulation.clone()).collect();
            let overall = agreement(&scan, &simulation);
            Comparison {
                scan_name: "thesis-focus".to_owned(),
                reading_unit: "V".to_owned(),
                simulator,
                points: overall.points,
                noise: Noise {
                    additive: NOISE_V,
                    multiplicative: 0.0,
                    source: NoiseSource::Repeats,
                },
                registration: registration(overall),
                planes,
                overall,
                levels: None,
            }
        })
        .collect()
}

/// The same with a receiver that hears 2 dB less at the first height and reads `V_PER_PA` volts per pascal; the level of the second height is unknown.
pub fn with_levels(mut comparison: Comparison) -> Comparison {
    let budget = Budget::new(vec![Line::decibels("receiver's sensitivity", Kind::B, 0.4)]);
    let first = &comparison.planes[0];
    let level = |volts: f64| {
        let rms_pa = volts / V_PER_PA * 10f64.powf(0.1);
        PeakLevel { rms_pa, level_db: level_db(rms_pa) }
    };
    let plane = PlaneLevels {
        focus: first.focus,
        z_m: first.z_m,
        scan: level(first.scan.peak.value),
        simulation: level(first.simulation.peak.value),
        gap_db: Uncertain { value: 0.0, standard_error: 0.1 },
        residual_rms_pa: level(first.agreement.residual_rms).rms_pa,
        reception_db: 2.0,
        expanded_db: budget.expanded_db(),
        budget,
    };
    comparison.levels =
        Some(Levels { rms_pa_per_reading: 1.0 / V_PER_PA, planes: vec![plane], notes: Vec::new() });
    comparison
}

/// Sensitivity of the receiver of [`with_levels`].
pub const V_PER_PA: f64 = 0.003;

pub fn context() -> ReportContext {
    ReportContext {
        title: "Thesis focus: scan against simulation".to_owned(),
        set_up: [
            ("Array", "square, 6 x 6 elements, pitch 10.5 mm"),
            ("Frequency", "40 kHz, modulated at 200 Hz"),
            ("Speed of sound", "343 m/s"),
            ("Focus", "(17.5, −22.5, 100) mm"),
        ]
        .map(|(label, value)| (label.to_owned(), value.to_owned()))
        .to_vec(),
        software: "fieldgap 0.1.0".to_owned(),
        inputs: ["scan.toml", "samples.csv"]
            .map(|name| InputFile { name: name.to_owned(), sha256: "0123456789abcdef".repeat(4) })
            .to_vec(),
        pages: Vec::new(),
        warnings: Vec::new(),
        pictures: Default::default(),
    }
}

fn simulation(simulator: Simulator) -> Simulation {
    Simulation {
        simulator,
        array: Array::square(6, 6, 10.5e-3).expect("not empty"),
        medium: Medium { speed_of_sound_m_s: 343.0 },
        frequency_hz: 40e3,
        excitation: Excitation::Focus(Vec3::from(FOCUS_M)),
    }
}

/// A plane of the corrected simulation, 70 mm wide.
pub fn simulated_map(z_m: f64) -> SimulatedMap {
    let grid = PlaneGrid::square(0.035, 0.005, z_m);
    let field = simulation(Simulator::Corrected).field(&grid.points());
    SimulatedMap {
        drive: 0,
        grid,
        amplitude: field.iter().map(|pressure| pressure.norm()).collect(),
        phase_rad: field.iter().map(|pressure| pressure.arg()).collect(),
        focus_m: Some(Vec3::from(FOCUS_M)),
    }
}

fn field(simulator: Simulator, grid: &PlaneGrid) -> Vec<f64> {
    simulation(simulator).magnitudes(&grid.points())
}

/// Noise that is the same every time: uniform, of the standard deviation one.
pub fn noise(index: usize) -> f64 {
    let scrambled = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (scrambled ^ (scrambled >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    ((mixed >> 11) as f64 / (1u64 << 53) as f64 - 0.5) * 12f64.sqrt()
}

fn plane(simulator: Simulator, z_m: f64, step_m: f64) -> PlaneComparison {
    let grid = PlaneGrid::square(0.035, step_m, z_m);
    let measured = field(Simulator::Corrected, &grid).into_iter().enumerate();
    let scan: Vec<f64> =
        measured.map(|(index, value)| (GAIN_V * value + NOISE_V * noise(index)).abs()).collect();
    // One gain for a simulator, the one that suits the focal height.
    let gain = if simulator == Simulator::AsWritten { 0.6 * GAIN_V } else { GAIN_V };
    let simulation: Vec<f64> = field(simulator, &grid).iter().map(|value| gain * value).collect();
    let phase_rad =
        self::simulation(simulator).field(&grid.points()).iter().map(|p| p.arg()).collect();
    let phase_rad = Some(phase_rad);
    let map = ComparedMap { x_m: grid.x_m, y_m: grid.y_m, scan, simulation, phase_rad };
    figured(z_m, map)
}

/// A plane with the figures of its maps.
pub fn figured(z_m: f64, map: ComparedMap) -> PlaneComparison {
    let scan = figures(&map, &map.scan, NOISE_V);
    let simulation = figures(&map, &map.simulation, 0.0);
    let target = Vec3::from(FOCUS_M);
    let shift = [0, 1].map(|axis| Uncertain {
        value: scan.peak_position_m[axis].value - simulation.peak_position_m[axis].value,
        standard_error: scan.peak_position_m[axis].standard_error,
    });
    let radius = |f: &FieldFigures| f.focal_radius.as_ref().and_then(|radius| radius.radius_m);
    let discrepancy = Discrepancy {
        peak_ratio: Uncertain {
            value: scan.peak.value / simulation.peak.value,
            standard_error: scan.peak.standard_error / simulation.peak.value,
        },
        peak_shift_m: shift,
        peak_distance_m: Uncertain {
            value: shift[0].value.hypot(shift[1].value),
            standard_error: SHIFT_ERROR_M,
        },
        focal_radius_m: radius(&scan)
            .zip(radius(&simulation))
            .map(|(a, b)| Uncertain { value: a.value - b.value, standard_error: a.standard_error }),
        sub_peaks: scan.sub_peaks.zip(simulation.sub_peaks).map(|(a, b)| a as i64 - b as i64),
    };
    PlaneComparison {
        focus: 0,
        z_m,
        target_m: Some(target),
        target_in_scan_m: Some(target),
        agreement: agreement(&map.scan, &map.simulation),
        points: map.scan.len(),
        phase: None,
        why_no_map: None,
        scan,
        simulation,
        discrepancy,
        map: Some(map),
    }
}

fn figures(map: &ComparedMap, values: &[f64], error: f64) -> FieldFigures {
    let map = PlaneMap::new(map.x_m.clone(), map.y_m.clone(), values.to_vec()).expect("a map");
    let radius = focal_radius(&map, THESIS_THRESHOLD, Convention::Corrected);
    let position_error = if error > 0.0 { SHIFT_ERROR_M } else { 0.0 };
    let at = |value| Uncertain { value, standard_error: position_error };
    let found = peak(&map);
    FieldFigures {
        peak: Uncertain {
            value: found.map_or(f64::NAN, |peak| peak.refined_value),
            standard_error: error,
        },
        peak_position_m: [
            at(found.map_or(f64::NAN, |peak| peak.refined_x_m)),
            at(found.map_or(f64::NAN, |peak| peak.refined_y_m)),
        ],
        peak_at_edge: found.is_some_and(|peak| peak.at_edge),
        focal_radius: radius.map(|radius| FocalRadiusFigure {
            radius_m: radius
                .radius_m
                .map(|value| Uncertain { value, standard_error: 3.0 * position_error }),
            sides_m: radius.half_widths_m,
        }),
        sub_peaks: found.map(|_| sub_peaks(&map, THESIS_THRESHOLD).len()),
    }
}

fn agreement(scan: &[f64], simulation: &[f64]) -> Agreement {
    let pairs: Vec<(f64, f64)> = scan
        .iter()
        .copied()
        .zip(simulation.iter().copied())
        .filter(|(s, _)| s.is_finite())
        .collect();
    let n = pairs.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / n;
    let (scan_mean, simulation_mean) = (mean(&|p| p.0), mean(&|p| p.1));
    let covariance = mean(&|p| (p.0 - scan_mean) * (p.1 - simulation_mean));
    let variances =
        mean(&|p| (p.0 - scan_mean).powi(2)) * mean(&|p| (p.1 - simulation_mean).powi(2));
    let own_gain = mean(&|p| p.0 * p.1) / mean(&|p| p.1 * p.1);
    let scan_rms = mean(&|p| p.0 * p.0).sqrt();
    let residual_rms = mean(&|p| (p.0 - p.1).powi(2)).sqrt();
    let own_residual_rms = mean(&|p| (p.0 - own_gain * p.1).powi(2)).sqrt();
    Agreement {
        correlation: covariance / variances.sqrt(),
        residual_rms_ratio: residual_rms / scan_rms,
        residual_rms_ratio_own_gain: own_residual_rms / scan_rms,
        gain_ratio: own_gain,
        residual_rms,
        scan_rms,
        points: pairs.len(),
    }
}

fn registration(overall: Agreement) -> Registration {
    let estimated = |value, standard_error| Estimate { value, standard_error, estimated: true };
    let held = |value| Estimate { value, standard_error: 0.0, estimated: false };
    let tried = |registering| TriedRegistration {
        registering,
        pose: Pose::default(),
        correlation: overall.correlation,
        residual_rms_ratio: overall.residual_rms_ratio,
    };
    Registration {
        requested: Registering::Auto,
        chosen: Registering::GainAndShift,
        why: "the whole pose explains no more than the gain and a small shift do".to_owned(),
        gain: estimated(GAIN_V, 0.0007),
        mirror: Mirror::None,
        turn_rad: held(0.0),
        step_ratio: held(1.0),
        shift_m: [estimated(1.2e-4, 4e-5), estimated(-0.8e-4, 4e-5), held(0.0)],
        receiver_face_m: None,
        tried: vec![tried(Registering::GainAndShift), tried(Registering::Pose)],
        undetermined: vec![UndeterminedCombination {
            parameters: vec!["shift_z".to_owned(), "step_ratio".to_owned()],
            explanation: "a scan 1 mm higher with steps 0.8 % longer would look the same."
                .to_owned(),
        }],
        phases: None,
    }
}
