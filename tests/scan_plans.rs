//! The plans of the project.

use std::path::Path;

use fieldgap::acoustics::Simulator;
use fieldgap::records::{Plan, VisitKind};

fn plan(name: &str) -> Plan {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans").join(name);
    Plan::read(&path).unwrap_or_else(|fault| panic!("{fault}"))
}

#[test]
fn the_thesis_plan_scans_four_planes_of_36_by_36_points() {
    let plan = plan("thesis-focus.toml");
    assert_eq!(plan.simulator, Simulator::AsWritten);
    assert_eq!(plan.also, [Simulator::Corrected]);
    let visits = plan.visits();
    let of = |kind| visits.iter().filter(|visit| visit.kind == kind).collect::<Vec<_>>();
    assert_eq!(of(VisitKind::Dark).len(), 16);
    assert_eq!(of(VisitKind::Reference).len(), 1 + (4 * 36 * 36usize).div_ceil(400));
    let points = of(VisitKind::Point);
    assert_eq!(points.len(), 4 * 36 * 36);
    let mut heights_mm: Vec<i64> =
        points.iter().map(|visit| (visit.position_m.z * 1e3).round() as i64).collect();
    heights_mm.dedup();
    assert_eq!(heights_mm, [50, 100, 150, 200]);
    let reach_m = points.iter().map(|visit| visit.position_m.xy().amax()).fold(0.0, f64::max);
    assert!((reach_m - 0.035).abs() < 1e-12);
}

#[test]
fn the_withheld_effect_is_scanned_at_four_heights_and_diagnosed() {
    let plan = plan("withheld-effect.toml");
    assert!(plan.diagnose);
    assert!(plan.visits().len() < 1000);
}

#[test]
fn the_quick_look_is_small() {
    assert!(plan("quick-look.toml").visits().len() < 200);
}
