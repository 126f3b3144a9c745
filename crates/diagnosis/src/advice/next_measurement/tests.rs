use std::path::Path;

use super::*;
use fieldgap_acoustics::{Array, Medium};
use fieldgap_input::TomlSource;
use fieldgap_records::{FocusSection, Plan, RecordedSample, RecordedScan, ScanSetup, Shape};

use crate::effect_id::EffectId;
use crate::effects::{effect, testing};
use crate::limits::FEWEST_READINGS;
use crate::model::instance::Instance;
use crate::preparation::Prepared;

/// A recorded scan beside the axis, at these heights, with these steps and points along x; 36 mm along y.
fn recorded(heights_mm: &[f64], step_m: f64, columns: usize) -> Prepared {
    let source = "format = 1\nname = \"scan\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n\n[array]\n\
        frequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\n\
        spacing_mm = 0.0\n\n[medium]\nspeed_of_sound_m_s = 343.0\n\n[simulator]\nmodel = \"piston\"\n\n[[focus]]\n\
        x_mm = 10.0\ny_mm = 5.0\nz_mm = 100.0\n";
    let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), source));
    let setup = setup.expect("a good set-up");
    let rows = (36e-3 / step_m) as usize + 1;
    let places: Vec<Vec3> = heights_mm
        .iter()
        .flat_map(|z_mm| {
            (0..rows).flat_map(move |row| {
                (0..columns).map(move |column| {
                    let (x_m, y_m) = (column as f64 * step_m, row as f64 * step_m);
                    Vec3::new(x_m - 5e-3, y_m - 10e-3, 1e-3 * z_mm)
                })
            })
        })
        .collect();
    let simulation = setup.simulation(Simulator::Piston, 0).expect("one focus");
    let readings = simulation.magnitudes(&places);
    let sample = |(number, (at_m, reading)): (usize, (&Vec3, f64))| {
        RecordedSample::measured(0.5 * number as f64, Some(0), *at_m, reading, None)
    };
    let samples = places.iter().zip(readings).enumerate().map(sample).collect();
    Prepared::of(&[RecordedScan { setup, samples }], None, false).expect("comparable")
}

/// A fit of one effect where its search begins.
fn fit_of(id: EffectId, context: &Context) -> Fit {
    let effect = effect(id);
    let values = effect.starts(context).into_iter().next().unwrap_or_else(|| effect.neutral());
    Fit {
        instances: vec![Instance { effect, choice: effect.choices()[0].clone() }],
        values: vec![values],
        spreads: vec![f64::NAN],
        ..Fit::of_nothing(Vec::new())
    }
}

#[test]
fn every_proposal_for_every_effect_can_be_measured_and_diagnosed() {
    // Usual, of one height, of two points along x and of four, of more heights than anyone repeats.
    let many: Vec<f64> = (0..12).map(|number| 50.0 + 10.0 * f64::from(number)).collect();
    let scans = [
        recorded(&[50.0, 100.0, 150.0], 4e-3, 10),
        recorded(&[100.0], 2e-3, 19),
        recorded(&[80.0, 120.0], 18e-3, 2),
        recorded(&[80.0, 120.0], 9e-3, 4),
        recorded(&many, 4e-3, 10),
    ];
    for prepared in &scans {
        let first = prepared.observations.first();
        let extent = Extent::of(&prepared.observations).expect("an area");
        let travel = |along: fn(&Vec3) -> f64| {
            let places = || first.visits.iter().map(|visit| 1e3 * along(&visit.at_m));
            (places().fold(f64::INFINITY, f64::min), places().fold(0.0, f64::max))
        };
        let nothing = Fit::of_nothing(Vec::new());
        for id in EffectId::ALL {
            let one = fit_of(*id, &prepared.context);
            let focus_m = first.believed.excitation.focus_m().expect("a focus");
            for proposal in proposals(first, focus_m, &extent, [&one, &nothing]) {
                for wanted in [1.0, 3000.0, f64::INFINITY] {
                    let grid = extent.grid(proposal.planes(), wanted);
                    let text = proposal.plan(Simulator::Piston, "scan", &extent, grid);
                    let plan = Plan::parse(TomlSource::new(Path::new("next.toml"), text.as_str()));
                    let plan = plan.unwrap_or_else(|fault| panic!("{id}: {fault}\n{text}"));
                    let mut readings = 0;
                    for region in &plan.regions {
                        let Shape::Planes(planes) = &region.shape else { panic!("{text}") };
                        for (axis, (from, to)) in
                            [(planes.x, travel(|at| at.x)), (planes.y, travel(|at| at.y))]
                        {
                            assert!(axis.count >= POINTS_ALONG_A_PROPOSED_ROW, "{id}: {text}");
                            let last = axis.at_mm(axis.count - 1);
                            assert!(axis.at_mm(0) > from - 0.01 && last < to + 0.01, "{text}");
                        }
                        let (lowest, highest) = travel(|at| at.z);
                        let mut heights = planes.z_mm.iter();
                        assert!(heights.all(|z| (lowest - 0.01..highest + 0.01).contains(z)));
                        assert!(lowest == highest || planes.z_mm.len() > 1, "{id}: {text}");
                        let foci = region.foci.len();
                        readings += planes.x.count * planes.y.count * planes.z_mm.len() * foci;
                    }
                    assert!(readings >= FEWEST_READINGS, "{id}: {readings} in {text}");
                    assert_eq!(readings, proposal.planes() * grid.points(), "{text}");
                    let scatters = effect(*id).scatters_repeats();
                    assert!(plan.regions.len() == 2 || !scatters, "{id}: {text}");
                }
            }
        }
    }
}

#[test]
fn a_scan_of_a_line_is_not_extended_to_a_plane() {
    let prepared = recorded(&[80.0, 120.0], 2e-3, 1);
    assert_eq!(Extent::of(&prepared.observations), None);
}

#[test]
fn a_proposal_states_its_readings_and_its_duration() {
    let prepared = recorded(&[50.0, 100.0, 150.0], 4e-3, 10);
    let Prepared { observations, context, .. } = &prepared;
    let nuisance = Fit::of_nothing(vec![testing::nuisance()]);
    let one = Fit { nuisance: nuisance.nuisance.clone(), ..fit_of(EffectId::SoundSpeed, context) };
    let one = Fit { values: vec![vec![0.02; one.values[0].len()]], ..one };
    let rivals = [&one, &nuisance];
    let next =
        next_measurement(observations, context, rivals, Simulator::Piston, "scan", Some(0.5));
    let next = next.expect("a proposal");
    assert!(next.readings >= FEWEST_READINGS, "{next:?}");
    assert_eq!(next.duration_s, Some(0.5 * (next.readings + DARK_READINGS) as f64));
    assert!(next.what.contains(&format!("{} readings; at the pace", next.readings)), "{next:?}");
    let unknown = next_measurement(observations, context, rivals, Simulator::Piston, "scan", None);
    let unknown = unknown.expect("a proposal");
    assert!(unknown.duration_s.is_none() && !unknown.what.contains("pace"), "{unknown:?}");
    assert_eq!(duration(45.0), "about 45 s");
    assert_eq!(duration(1500.0), "about 25 min");
    assert_eq!(duration(9000.0), "about 2.5 h");
}

#[test]
fn its_plan_keeps_drives_and_speed() {
    let prepared = recorded(&[50.0, 100.0], 4e-3, 10);
    let extent = Extent::of(&prepared.observations).expect("an area");
    let proposal = Proposal {
        what: "the same planes at a third of the speed".to_owned(),
        heights_mm: vec![50.0, 100.0],
        drives: vec![
            Excitation::Focus(Vec3::new(17.5e-3, -22.5e-3, 0.1)),
            Excitation::Uniform,
            random_phases(36, 1),
        ],
        passes: 1,
        raster: false,
        speed_m_s: Some(0.04 * SLOWER),
        slower: 1.0 / SLOWER,
    };
    let text = proposal.plan(Simulator::Piston, "scan", &extent, extent.grid(6, 1.0));
    let plan = Plan::parse(TomlSource::new(Path::new("next.toml"), text.as_str()));
    let plan = plan.expect("a good plan");
    assert_eq!(plan.foci.len(), 3);
    let FocusSection::Phases(phases_rad) = &plan.foci[2] else { panic!("{:?}", plan.foci) };
    assert!(phases_rad.len() == 36 && phases_rad.iter().all(|phase| (0.0..TAU).contains(phase)));
    assert_eq!(plan.fly.map(|fly| fly.speed_mm_s.get()), Some(13.333));
}

#[test]
fn another_mean_and_another_scatter_tell_two_suppositions_apart() {
    let residuals = |scaled: [f64; 2], log_variances: &[f64]| Residuals {
        scaled: scaled.to_vec(),
        log_variances: log_variances.to_vec(),
        ..Residuals::default()
    };
    let one = residuals([0.0; 2], &[-0.7, 0.3]);
    assert_eq!(told_apart(&one, &one), 0.0);
    assert_eq!(told_apart(&one, &residuals([3.0, 4.0], &[-0.7, 0.3])), 25.0);
    // Two normal laws of variances v and w: v/w - 1 - ln(v/w), whichever is the larger.
    let plain = residuals([0.0; 2], &[]);
    let by_law = |ratio: f64| ratio - 1.0 - ratio.ln();
    let expected = by_law((-0.7f64).exp()) + by_law(0.3f64.exp());
    assert!((told_apart(&one, &plain) - expected).abs() < 1e-12);
}

#[test]
fn half_of_the_elements_are_reversed_and_no_other() {
    let drive = Excitation::Focus(Vec3::new(0.0, 0.0, 0.1));
    let believed = Simulation {
        array: Array::square(4, 4, 10e-3).expect("not empty"),
        excitation: drive.clone(),
        frequency_hz: 40e3,
        medium: Medium { speed_of_sound_m_s: 343.0 },
        simulator: Simulator::Piston,
    };
    let before = drive.phases_rad(&believed.array, &believed.medium, believed.frequency_hz);
    let Excitation::Phases(after) = half_reversed(&believed, &drive, Vec3::y()) else {
        panic!("phases")
    };
    for ((element, before), after) in believed.array.elements().iter().zip(before).zip(after) {
        let turn = if element.centre_m.y > 0.0 { PI } else { 0.0 };
        assert_eq!(after, before + turn);
    }
}
