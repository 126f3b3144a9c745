//! What the sets of effects expect of readings that could still be taken.
//!
//! Each set that is still probable gives, for every possible reading, its mean, its scatter, and its derivatives by all that the fit left free.
//! With the covariance of these parameters a program can compute what the reading would tell, without this crate knowing the robot's time.

use nalgebra::DMatrix;

use fieldgap_acoustics::Vec3;

use crate::effect_id::EffectId;
use crate::fit::joint_fit::unknowns;
use crate::fit::problem::Problem;
use crate::model::effect::Context;
use crate::model::motion::Motion;
use crate::model::observations::{Observations, ObservedDrive, ObservedScan, Visit};
use crate::selection::scored_model::ScoredModel;

/// A reading that could be taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PossibleReading {
    /// Place, array frame, m.
    pub at_m: Vec3,
    /// Number of the record's drive.
    pub focus: usize,
    /// Whether the robot comes to it from smaller x.
    pub from_below: bool,
    /// The robot's velocity as it reads, array frame, m/s; zero at rest.
    pub velocity_m_s: Vec3,
}

/// What one set of effects expects of possible readings. Readings are on the scale on which they scatter by one.
#[derive(Debug, Clone)]
pub struct Outlook {
    /// The set; empty for the set-up as believed.
    pub effects: Vec<EffectId>,
    /// Its probability among all sets.
    pub probability: f64,
    /// The expected readings, in standard deviations of their noise.
    pub means: Vec<f64>,
    /// Variance of each reading about its mean with the parameters known: one, but for effects that change the scatter, and for what the
    /// set leaves unexplained.
    pub variances: Vec<f64>,
    /// Derivatives of the means: a row for each parameter, a column for each reading.
    pub slopes: DMatrix<f64>,
    /// Covariance of the parameters after the readings so far.
    pub covariance: DMatrix<f64>,
}

/// What a scored set expects of possible readings, taken after all others.
pub(crate) fn outlook(
    observations: &Observations,
    context: &Context,
    scored: &ScoredModel,
    probability: f64,
    possible: &[PossibleReading],
) -> Outlook {
    let (possible, order) = as_observations(observations, possible, 1.0);
    let fit = &scored.fit;
    let problem = Problem::new(&possible, context, &fit.instances, &fit.values);
    let unknowns =
        unknowns(&fit.instances, &fit.values, &fit.spreads, &fit.nuisance.of_first(), context);
    let numbers: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
    let evaluation = problem.evaluate(&numbers);
    let residuals = &evaluation.residuals;
    let visits: Vec<&Visit> =
        possible.scans[0].drives.iter().flat_map(|drive| &drive.visits).collect();
    let variance_of = |index: usize| {
        visits[index].variance * residuals.log_variances.get(index).map_or(1.0, |log| log.exp())
    };
    // A set that leaves more than noise expects as much of the next readings.
    let misfit = (fit.cost / observations.len() as f64).max(1.0);
    let silent = possible.scans[0].scale.of(0.0);
    let columns = match &fit.covariance {
        Some(_) => problem.columns(&numbers, &unknowns, 0..numbers.len(), &evaluation),
        None => Vec::new(),
    };
    let slope =
        |parameter: usize, index: usize| -columns[parameter][index] * variance_of(index).sqrt();
    Outlook {
        effects: fit.ids(),
        probability,
        means: order
            .iter()
            .map(|&index| silent - residuals.scaled[index] * variance_of(index).sqrt())
            .collect(),
        variances: order.iter().map(|&index| misfit * variance_of(index)).collect(),
        slopes: DMatrix::from_fn(columns.len(), order.len(), |parameter, reading| {
            slope(parameter, order[reading])
        }),
        covariance: match &fit.covariance {
            Some(covariance) => covariance * misfit,
            None => DMatrix::zeros(0, 0),
        },
    }
}

/// Possible readings as observations that read nothing, drive by drive; and where each stands among them. `progress` is the moment of the scan
/// at which they are taken, 0 at its first reading to 1 at its last.
pub(super) fn as_observations(
    observations: &Observations,
    possible: &[PossibleReading],
    progress: f64,
) -> (Observations, Vec<usize>) {
    let scan = &observations.scans[0];
    let mut order = vec![0; possible.len()];
    let mut before = 0;
    let mut drives = Vec::new();
    for drive in &scan.drives {
        let mut visits = Vec::new();
        let of_drive = possible.iter().enumerate().filter(|(_, one)| one.focus == drive.focus);
        for (index, one) in of_drive {
            order[index] = before + visits.len();
            let x_direction = if one.from_below { 1.0 } else { -1.0 };
            visits.push(Visit {
                number: index,
                at_m: one.at_m,
                motion: Motion::steady(one.velocity_m_s, x_direction),
                otherwise: None,
                begins: false,
                time_s: progress * scan.lasts_s(),
                progress,
                variance: variance_at(scan, one.velocity_m_s.norm()),
            });
        }
        before += visits.len();
        let readings = vec![0.0; visits.len()];
        if !visits.is_empty() {
            drives.push(ObservedDrive {
                focus: drive.focus,
                number: drive.number,
                believed: drive.believed.clone(),
                stabilised: vec![scan.scale.of(0.0); visits.len()],
                expected: Vec::new(),
                readings,
                visits,
                phases_rad: Vec::new(),
                believed_rad: Vec::new(),
            });
        }
    }
    // One at a time: what came before says how the level stands.
    let scan =
        ObservedScan { drives, dark: Vec::new(), phase: None, slow_level: None, ..scan.clone() };
    (Observations { scans: vec![scan] }, order)
}

/// Median variance of the readings of a scan that were taken at about this speed; one at rest or where there are none.
fn variance_at(scan: &ObservedScan, speed_m_s: f64) -> f64 {
    /// Share by which speeds that are alike differ.
    const ALIKE: f64 = 0.1;
    let visits = scan.drives.iter().flat_map(|drive| &drive.visits);
    let alike = visits.filter(|visit| {
        let differs = visit.motion.velocity_m_s().norm() - speed_m_s;
        visit.is_in_row() && speed_m_s > 0.0 && differs.abs() <= ALIKE * speed_m_s
    });
    let mut variances: Vec<f64> = alike.map(|visit| visit.variance).collect();
    variances.sort_by(f64::total_cmp);
    variances.get(variances.len() / 2).copied().unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::effect;
    use crate::effects::testing::{Bench, nuisance, visit};
    use crate::fit::joint_fit::Fit;
    use crate::model::effect::Choice;
    use crate::model::instance::Instance;
    use crate::model::nuisance::Nuisance;
    use fieldgap_acoustics::Excitation;

    /// Readings already taken with two drives: one each.
    fn observations(bench: &Bench) -> Observations {
        let focused = bench.believed().excitation.clone();
        bench.observations(&[focused, Excitation::Uniform].map(|drive| (drive, vec![visit().at_m])))
    }

    /// A warmer air than believed, known to so much.
    fn warm(ratio: f64, size: usize) -> ScoredModel {
        let fit = Fit {
            instances: vec![Instance {
                effect: effect(EffectId::SoundSpeed),
                choice: Choice::None,
            }],
            values: vec![vec![ratio]],
            spreads: vec![f64::NAN],
            cost: 8.0,
            covariance: Some(DMatrix::identity(size, size) * 0.25),
            ..Fit::of_nothing(vec![nuisance()])
        };
        ScoredModel { fit, log_evidence: 0.0, unseen: 0.0 }
    }

    const POSSIBLE: [(usize, [f64; 3]); 4] = [
        (1, [0.0, 0.0, 0.12]),
        (0, [0.005, 0.002, 0.09]),
        (1, [-0.01, 0.004, 0.08]),
        (0, [0.0, -0.012, 0.11]),
    ];

    #[test]
    fn readings_are_foretold_in_their_order_with_their_slopes() {
        let bench = Bench::new();
        let observations = observations(&bench);
        let possible: Vec<PossibleReading> = POSSIBLE
            .iter()
            .map(|&(focus, at_m)| PossibleReading {
                at_m: at_m.into(),
                focus,
                from_below: true,
                velocity_m_s: Vec3::zeros(),
            })
            .collect();
        let size = Nuisance::COUNT + 1;
        let of =
            |ratio: f64| outlook(&observations, &bench.context, &warm(ratio, size), 0.5, &possible);
        let told = of(1.01);
        // The model at each place by itself, with the drive of its own.
        let scale = &observations.scans[0].scale;
        let model = bench.model(EffectId::SoundSpeed, &[1.01]);
        for (number, (focus, at_m)) in POSSIBLE.into_iter().enumerate() {
            let drive = &observations.scans[0].drives[focus];
            let there = Visit { at_m: at_m.into(), ..visit() };
            let pressure = model.pressures_at(&drive.believed, &[there], &nuisance())[0];
            let scan = &observations.scans[0];
            let expected = scale.of(model.expected(&pressure, 1.0, 1.0, scan).reading);
            assert!((told.means[number] - expected).abs() < 1e-6, "{number}");
        }
        let step = 1e-4;
        let beside = [of(1.01 + step), of(1.01 - step)];
        for number in 0..POSSIBLE.len() {
            let quotient = (beside[0].means[number] - beside[1].means[number]) / (2.0 * step);
            let slope = told.slopes[(size - 1, number)];
            // A share of the largest slope, 72 for a change of the speed by one: where paths cancel the kernel's derivative is less exact.
            assert!((slope - quotient).abs() < 0.5, "{slope} {quotient}");
            assert!(quotient > 10.0, "{quotient}");
        }
        // It left four times the noise's chi-square, so that it is trusted half as well as its covariance says, and its readings as well.
        assert_eq!(told.variances, [4.0; 4]);
        assert_eq!(told.covariance[(0, 0)], 1.0);
    }
}
