//! The scan that would separate two rivals: of some that a lab can make at once, the one in which they differ most after a refit.
//!
//! The expected readings of one rival stand for the scan, and the other rival is fitted to them. The square root of the remaining cost is
//! the number of standard deviations by which the whole scan would separate the two.

use fieldgap_acoustics::{Excitation, Simulation, Simulator, Vec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

use crate::effect_id::joined;
use crate::fit::joint_fit::{Fit, SEARCH, Start, fit};
use crate::limits::{POINTS_ALONG_A_PROPOSED_ROW, READINGS_OF_A_COMPARISON, SEPARATED_SIGMA};
use crate::model::effect::{Context, Effect, Timing};
use crate::model::forward_model::ForwardModel;
use crate::model::nuisance::Nuisance;
use crate::model::observations::{Observations, ObservedDrive, ObservedScan, Visit};
use crate::model::planes::{by_height, step_m};
use crate::model::residuals::Residuals;
use crate::result::NextMeasurement;
use crate::statistics::noise_scale::NoiseScale;

/// Speed of a slower scan over that of the one that was made.
const SLOWER: f64 = 1.0 / 3.0;

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
pub(crate) fn next_measurement(
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
    let few = observations.thinned(READINGS_OF_A_COMPARISON);
    let present =
        separation(&few, context, rivals) * (observations.len() as f64 / few.len() as f64).sqrt();
    let half_m = first.visits.iter().map(|visit| visit.at_m.x.abs()).fold(0.0, f64::max);
    let step = step_m(first).unwrap_or(2e-3);
    let whole = (2.0 * half_m / step + 1.0).round().max(2.0);
    let proposals = proposals(first, focus_m, &heights_mm, rivals);
    // The best is the one that separates most with each reading, so that a longer scan has to earn its time.
    let tell_apart: Vec<f64> = proposals
        .par_iter()
        .map(|proposal| {
            let scan = proposal.scan(observations, half_m);
            separation(&scan, context, rivals) / (scan.len() as f64).sqrt()
        })
        .collect();
    let proposals = tell_apart.into_iter().zip(proposals);
    let (each, best) = proposals.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let points = (best.heights_mm.len() * best.drives.len()) as f64 * whole * whole;
    let sigma = each * points.sqrt();
    let [one, other] = rivals.map(|fit| joined(&fit.ids(), " + "));
    let mut what = match sigma < SEPARATED_SIGMA {
        true => format!(
            "No scan considered separates {one} from {other}. The best is {}: they would then differ by {sigma:.1} standard \
             deviations of the whole scan's noise, each fitted again.",
            best.what
        ),
        false => format!(
            "Scan {}: {one} and {other} would then differ by {sigma:.0} standard deviations of the whole scan's noise, each \
             fitted again; in these data they differ by {present:.1}.",
            best.what
        ),
    };
    let shown: Vec<&str> =
        differing(rivals).filter_map(|effect| effect.facts().independent_check).collect();
    if !shown.is_empty() {
        what += &format!(" Without a scan, {}.", shown.join("; "));
    }
    Some(NextMeasurement {
        what,
        expected_sigma: sigma,
        present_sigma: present,
        plan: Some(best.plan(simulator, name, 2e3 * half_m, 1e3 * step)),
    })
}

/// The scans that a lab can make at once.
fn proposals(
    first: &ObservedDrive,
    focus_m: Vec3,
    heights_mm: &[f64],
    rivals: [&Fit; 2],
) -> Vec<Proposal> {
    let other_m = Vec3::new(-focus_m.x, -focus_m.y, 1.3 * focus_m.z);
    let focus = Excitation::Focus(focus_m);
    let halves = [Vec3::x(), Vec3::y()].map(|side| half_reversed(&first.believed, &focus, side));
    let random = [1, 2].map(|number| random_phases(first.believed.array.len(), number));
    // Only where the readings lag behind the motion does the speed of the robot matter.
    let is_flown = rivals
        .iter()
        .any(|fit| fit.instances.iter().any(|i| i.effect.facts().timing == Timing::Velocity));
    let speed_m_s = is_flown.then(|| speed_along_rows_m_s(first));
    let again = |what| Proposal {
        what,
        heights_mm: heights_mm.to_vec(),
        drives: vec![focus.clone()],
        raster: false,
        speed_m_s,
    };
    let mut proposals = vec![
        Proposal {
            heights_mm: heights_mm.iter().rev().copied().collect(),
            ..again(
                "the same planes from the highest to the lowest, which separates time from height",
            )
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
            ..again("the focus, and again with all elements in phase")
        },
        Proposal {
            drives: [focus.clone()].into_iter().chain(halves).collect(),
            ..again(
                "the focus, and again with the right and with the upper half of the elements reversed",
            )
        },
        Proposal {
            drives: [focus.clone()].into_iter().chain(random).collect(),
            ..again("the focus, and twice with random phases, which separates the elements")
        },
        Proposal { raster: true, ..again("every row in the same direction") },
    ];
    if let Some(speed_m_s) = speed_m_s {
        let speed_m_s = Some(SLOWER * speed_m_s);
        proposals.push(Proposal { speed_m_s, ..again("the same planes at a third of the speed") });
    }
    proposals
}

/// The effects that one of two fits has and the other has not.
fn differing([one, other]: [&Fit; 2]) -> impl Iterator<Item = &'static dyn Effect> {
    let not_of = |fit: &Fit, other: &Fit| {
        let others = other.ids();
        let effects = fit.instances.iter().map(|instance| instance.effect);
        effects.filter(|effect| !others.contains(&effect.id())).collect::<Vec<_>>()
    };
    not_of(one, other).into_iter().chain(not_of(other, one))
}

/// A drive whose elements on one side of the array's middle are reversed.
fn half_reversed(believed: &Simulation, drive: &Excitation, side: Vec3) -> Excitation {
    let phases_rad = drive.phases_rad(&believed.array, &believed.medium, believed.frequency_hz);
    let elements = believed.array.elements().iter();
    let reversed = elements.zip(phases_rad).map(|(element, phase_rad)| {
        if element.centre_m.dot(&side) > 0.0 { phase_rad + PI } else { phase_rad }
    });
    Excitation::Phases(reversed.collect())
}

/// Random phases, one set for each number.
fn random_phases(elements: usize, number: u64) -> Excitation {
    let mut draws = ChaCha8Rng::seed_from_u64(number);
    Excitation::Phases((0..elements).map(|_| draws.random_range(0.0..TAU)).collect())
}

/// The largest apparent speed of the robot along rows.
fn speed_along_rows_m_s(drive: &ObservedDrive) -> f64 {
    let even = drive.visits.iter().filter(|visit| visit.even);
    even.map(|visit| visit.velocity_m_s.x.abs()).fold(0.0, f64::max)
}

/// Standard deviations by which the second fit, refitted, misses the expected readings of the first.
fn separation(observations: &Observations, context: &Context, [one, other]: [&Fit; 2]) -> f64 {
    let mut synthetic = observations.clone();
    let nuisance = vec![one.nuisance[0]; synthetic.scans.len()];
    let mut readings = one.model(context).expected_readings(&synthetic, &nuisance).into_iter();
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
    let other = fit(&synthetic, context, start, SEARCH);
    let residuals = |model: ForwardModel<'_>, nuisance: &[Nuisance]| {
        let pressures = model.pressures(&synthetic, nuisance);
        model.residuals(&synthetic, &pressures, nuisance)
    };
    let [one, other] = [
        residuals(one.model(context), &nuisance),
        residuals(other.model(context), &other.nuisance),
    ];
    told_apart(&one, &other).sqrt()
}

/// Twice the Kullback-Leibler divergence of the second model from the first, whose residuals are zero: squared residuals and the terms of
/// a different variance (S. Kullback and R. A. Leibler, Ann. Math. Stat. 22, 79, 1951).
fn told_apart(one: &Residuals, other: &Residuals) -> f64 {
    let log_variance = |of: &Residuals, n: usize| of.log_variances.get(n).copied().unwrap_or(0.0);
    let of_reading = |(n, residual): (usize, &f64)| {
        let smaller = log_variance(one, n) - log_variance(other, n);
        residual * residual + smaller.exp() - 1.0 - smaller
    };
    other.scaled.iter().enumerate().map(of_reading).sum()
}

impl Proposal {
    /// The scan as it would be made, with few points.
    fn scan(&self, observations: &Observations, half_m: f64) -> Observations {
        let template = observations.first();
        let scatter = &observations.scans[0].scatter;
        let step_m = 2.0 * half_m / (POINTS_ALONG_A_PROPOSED_ROW - 1) as f64;
        let total = (self.drives.len()
            * self.heights_mm.len()
            * POINTS_ALONG_A_PROPOSED_ROW
            * POINTS_ALONG_A_PROPOSED_ROW) as f64;
        let speed = self.speed_m_s.unwrap_or(0.0);
        let mut number = 0;
        let drives = self
            .drives
            .iter()
            .enumerate()
            .map(|(focus, excitation)| {
                let mut visits = Vec::new();
                for z_mm in &self.heights_mm {
                    for row in 0..POINTS_ALONG_A_PROPOSED_ROW {
                        let back = row % 2 == 1 && !self.raster;
                        let x_direction = if back { -1.0 } else { 1.0 };
                        for column in 0..POINTS_ALONG_A_PROPOSED_ROW {
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
        let scale = NoiseScale::new(scatter.share, scatter.additive, averaged);
        let scan =
            ObservedScan { drives, scatter: scatter.clone(), averaged, scale, dark: Vec::new() };
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
            plan += "\n[[focus]]\n";
            plan += &match excitation {
                Excitation::Focus(focus_m) => {
                    let [x, y, z] = [focus_m.x, focus_m.y, focus_m.z].map(|m| tidy(1e3 * m));
                    format!("x_mm = {x:?}\ny_mm = {y:?}\nz_mm = {z:?}\n")
                }
                Excitation::Uniform => "phases = \"all-zero\"\n".to_owned(),
                Excitation::Phases(phases_rad) => {
                    let phases_rad: Vec<f64> =
                        phases_rad.iter().map(|phase| tidy(phase.rem_euclid(TAU))).collect();
                    format!("phases_rad = {phases_rad:?}\n")
                }
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
    use fieldgap_acoustics::{Array, Medium};
    use fieldgap_input::TomlSource;
    use fieldgap_records::{FocusSection, Plan};

    #[test]
    fn its_plan_is_one_that_a_scan_takes() {
        let proposal = Proposal {
            what: "the same planes at a third of the speed",
            heights_mm: vec![50.0, 100.0],
            drives: vec![
                Excitation::Focus(Vec3::new(17.5e-3, -22.5e-3, 0.1)),
                Excitation::Uniform,
                random_phases(36, 1),
            ],
            raster: false,
            speed_m_s: Some(0.04 * SLOWER),
        };
        let text = proposal.plan(Simulator::Piston, "scan", 70.0, 2.0);
        let plan = Plan::parse(TomlSource::new(Path::new("next.toml"), text.as_str()));
        let plan = plan.expect("a good plan");
        assert_eq!(plan.foci.len(), 3);
        let FocusSection::Phases(phases_rad) = &plan.foci[2] else { panic!("{:?}", plan.foci) };
        assert!(
            phases_rad.len() == 36 && phases_rad.iter().all(|phase| (0.0..TAU).contains(phase))
        );
        assert_eq!(plan.fly.map(|fly| fly.speed_mm_s.get()), Some(13.333));
    }

    #[test]
    fn another_mean_and_another_scatter_tell_two_suppositions_apart() {
        let residuals = |scaled: [f64; 2], log_variances: &[f64]| Residuals {
            scaled: scaled.to_vec(),
            log_variances: log_variances.to_vec(),
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
}
