//! The scan that would tell two rivals apart: of some that a lab can make at once, the one in which they differ most after
//! each has been fitted anew.
//!
//! A rival's expected readings stand for the scan that is not yet made, and the other rival is fitted to them: the root of the
//! cost that it cannot get rid of is the number of standard deviations by which the whole scan would tell them apart.

use super::NextMeasurement;
use super::effects::Context;
use super::fit::{Fit, SEARCH, Start, fit};
use super::gap_size::expected;
use super::observations::{Observations, ObservedDrive, ObservedScan, Visit};
use super::residual_tests::{by_height, step_m};
use super::scale::Scale;
use crate::acoustics::{Excitation, Simulator, Vec3};

/// Points along a row and rows of a plane in the scans that are tried out: what they tell is scaled to a whole one.
const SIDE: usize = 15;

/// Speed of a slower scan over that of the one that was made.
const SLOWER: f64 = 1.0 / 3.0;

/// Readings over which the scan that was made is judged.
const FEW: usize = 1500;

/// A scan that could be made.
struct Proposal {
    what: &'static str,
    heights_mm: Vec<f64>,
    drives: Vec<Excitation>,
    /// Every row in the same direction.
    raster: bool,
    /// Speed along the rows; nothing for a robot that stops at each point.
    speed_m_s: Option<f64>,
}

/// Proposes the scan that separates two fits best; `None` where the array is driven without a focus.
pub(super) fn next_measurement(
    observations: &Observations,
    context: &Context,
    rivals: [&Fit; 2],
    simulator: Simulator,
    name: &str,
) -> Option<NextMeasurement> {
    let first = observations.first();
    let focus_m = first.believed.excitation.focus_m()?;
    let heights_mm: Vec<f64> = by_height(first)
        .iter()
        .map(|plane| (1e6 * first.visits[plane[0]].at_m.z).round() / 1e3)
        .collect();
    let few = observations.thinned(FEW);
    let present =
        separation(&few, context, rivals) * (observations.len() as f64 / few.len() as f64).sqrt();
    let half_m = first.visits.iter().map(|visit| visit.at_m.x.abs()).fold(0.0, f64::max);
    let step = step_m(first).unwrap_or(2e-3);
    let whole = (2.0 * half_m / step + 1.0).round().max(2.0);
    let other_m = Vec3::new(-focus_m.x, -focus_m.y, 1.3 * focus_m.z);
    let focus = Excitation::Focus(focus_m);
    // Only where the readings trail the motion does it matter that, and how fast, the robot flies.
    let is_flown = rivals.iter().any(|fit| fit.ids().contains(&"lag"));
    let speed_m_s = is_flown.then(|| speed_along_rows_m_s(first));
    let again = |what| Proposal {
        what,
        heights_mm: heights_mm.clone(),
        drives: vec![focus.clone()],
        raster: false,
        speed_m_s,
    };
    let mut proposals = vec![
        Proposal {
            heights_mm: heights_mm.iter().rev().copied().collect(),
            ..again("the same planes from the highest to the lowest, so that time and height part")
        },
        Proposal {
            heights_mm: vec![75.0, 110.0, 145.0, 180.0, 215.0, 250.0],
            ..again("more heights, from 75 to 250 mm")
        },
        Proposal {
            drives: vec![focus.clone(), Excitation::Focus(other_m)],
            ..again("a second focus on the other side, higher up")
        },
        Proposal {
            drives: vec![focus.clone(), Excitation::Uniform],
            ..again("the focus, and once more with all elements in phase")
        },
        Proposal { raster: true, ..again("every row in the same direction") },
    ];
    if let Some(speed_m_s) = speed_m_s {
        let speed_m_s = Some(SLOWER * speed_m_s);
        proposals.push(Proposal { speed_m_s, ..again("the same planes at a third of the speed") });
    }
    let (sigma, best) = proposals
        .into_iter()
        .map(|proposal| {
            let scan = proposal.scan(observations, half_m);
            let points = (proposal.heights_mm.len() * proposal.drives.len()) as f64 * whole * whole;
            let share = points / scan.len() as f64;
            (separation(&scan, context, rivals) * share.sqrt(), proposal)
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    let both = |ids: Vec<&str>| ids.join(" + ");
    let what = format!(
        "Scan {}: {} and {} would then differ by {sigma:.0} standard deviations of the whole scan's noise, each fitted \
         anew; in these data they differ by {present:.1}.",
        best.what,
        both(rivals[0].ids()),
        both(rivals[1].ids())
    );
    Some(NextMeasurement {
        what,
        expected_sigma: sigma,
        present_sigma: present,
        plan: Some(best.plan(simulator, name, 2e3 * half_m, 1e3 * step)),
    })
}

/// How fast the robot went along rows, or seems to have, at the most.
fn speed_along_rows_m_s(drive: &ObservedDrive) -> f64 {
    let even = drive.visits.iter().filter(|visit| visit.even);
    even.map(|visit| visit.velocity_m_s.x.abs()).fold(0.0, f64::max)
}

/// By how many standard deviations the second of two fits misses what the first expects, at its best.
fn separation(observations: &Observations, context: &Context, [one, other]: [&Fit; 2]) -> f64 {
    let mut synthetic = observations.clone();
    let nuisance = vec![one.nuisance[0]; synthetic.scans.len()];
    let mut readings = expected(&synthetic, &one.supposed(context), &nuisance).into_iter();
    for scan in &mut synthetic.scans {
        for drive in &mut scan.drives {
            drive.readings = readings.by_ref().take(drive.visits.len()).collect();
        }
        scan.set_scatter(scan.scatter.clone());
    }
    let start = Start {
        instances: other.instances.clone(),
        values: other.values.clone(),
        spreads: other.spreads.clone(),
        nuisance: Some(vec![other.nuisance[0]; synthetic.scans.len()]),
    };
    fit(&synthetic, context, start, SEARCH).cost.max(0.0).sqrt()
}

impl Proposal {
    /// The scan as it would be made, with few points.
    fn scan(&self, observations: &Observations, half_m: f64) -> Observations {
        let template = observations.first();
        let scatter = &observations.scans[0].scatter;
        let step_m = 2.0 * half_m / (SIDE - 1) as f64;
        let total = (self.drives.len() * self.heights_mm.len() * SIDE * SIDE) as f64;
        let speed = self.speed_m_s.unwrap_or(0.0);
        let mut number = 0;
        let drives = self
            .drives
            .iter()
            .enumerate()
            .map(|(focus, excitation)| {
                let mut visits = Vec::new();
                for z_mm in &self.heights_mm {
                    for row in 0..SIDE {
                        let back = row % 2 == 1 && !self.raster;
                        let x_direction = if back { -1.0 } else { 1.0 };
                        for column in 0..SIDE {
                            let x_m = x_direction * (column as f64 * step_m - half_m);
                            let y_m = row as f64 * step_m - half_m;
                            visits.push(Visit {
                                number,
                                at_m: Vec3::new(x_m, y_m, 1e-3 * z_mm),
                                velocity_m_s: Vec3::x() * x_direction * speed,
                                x_direction,
                                even: true,
                                progress: number as f64 / total,
                            });
                            number += 1;
                        }
                    }
                }
                let mut believed = template.believed.clone();
                believed.excitation = excitation.clone();
                let readings = vec![0.0; visits.len()];
                ObservedDrive {
                    focus,
                    believed,
                    stabilised: readings.clone(),
                    readings,
                    visits,
                    otherwise: Vec::new(),
                }
            })
            .collect();
        let averaged = observations.scans[0].averaged;
        let scale = Scale::new(scatter.share, scatter.additive, averaged);
        let scan =
            ObservedScan { drives, scatter: scatter.clone(), averaged, scale, silent: Vec::new() };
        Observations { scans: vec![scan] }
    }

    fn plan(&self, simulator: Simulator, name: &str, size_mm: f64, step_mm: f64) -> String {
        let tidy = |value: f64| (value * 1e3).round() / 1e3;
        let order = if self.raster { "raster" } else { "serpentine" };
        let mut plan = format!(
            "# {}.\nname = \"{name}-next\"\norder = \"{order}\"\n\n[simulator]\nmodel = \"{simulator}\"\n",
            self.what
        );
        for excitation in &self.drives {
            plan += &match excitation.focus_m() {
                Some(focus_m) => {
                    let [x, y, z] = [focus_m.x, focus_m.y, focus_m.z].map(|m| tidy(1e3 * m));
                    format!("\n[[focus]]\nx_mm = {x:?}\ny_mm = {y:?}\nz_mm = {z:?}\n")
                }
                None => "\n[[focus]]\nphases = \"all-zero\"\n".to_owned(),
            };
        }
        if let Some(speed_m_s) = self.speed_m_s {
            plan += &format!("\n[fly]\nspeed_mm_s = {:?}\n", tidy(1e3 * speed_m_s));
        }
        plan += "\n[dark]\nbefore = 32\nafter = 32\n";
        let heights: Vec<String> =
            self.heights_mm.iter().map(|z_mm| format!("{:?}", tidy(*z_mm))).collect();
        plan += &format!(
            "\n[[plane]]\nz_mm = [{}]\ncentre_mm = [0.0, 0.0]\nsize_mm = [{size:?}, {size:?}]\nstep_mm = {:?}\n",
            heights.join(", "),
            tidy(step_mm),
            size = tidy(size_mm),
        );
        plan
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::input::TomlSource;
    use crate::scan::Plan;

    #[test]
    fn its_plan_is_one_that_a_scan_takes() {
        let proposal = Proposal {
            what: "the same planes at a third of the speed",
            heights_mm: vec![50.0, 100.0],
            drives: vec![Excitation::Focus(Vec3::new(17.5e-3, -22.5e-3, 0.1)), Excitation::Uniform],
            raster: false,
            speed_m_s: Some(0.04 * SLOWER),
        };
        let text = proposal.plan(Simulator::Piston, "scan", 70.0, 2.0);
        let plan = Plan::parse(TomlSource::new(Path::new("next.toml"), text.as_str()));
        let plan = plan.expect("a good plan");
        assert_eq!(plan.foci.len(), 2);
        assert_eq!(plan.fly.map(|fly| fly.speed_mm_s.get()), Some(13.333));
    }
}
