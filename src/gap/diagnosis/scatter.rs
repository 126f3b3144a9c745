//! How readings scatter about their mean: from silence and from points that were visited again.
//!
//! A level m reads |m + b (n₁ + i n₂)| (1 + a n₀) with standard normal n, so that silence reads Rayleigh's distribution and a
//! strong signal scatters by √(a² m² + b²). A floor that the detector adds in power makes √(reading² + floor²) of it before
//! the share in proportion comes in: quadrature noise is the smaller beside a floor, and the share is not.

use std::sync::Arc;

use super::observations::ObservedScan;

/// The scatter of one reading.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scatter {
    /// In proportion to the level.
    pub share: f64,
    /// Each quadrature of what does not depend on the level, in the reading's unit.
    pub additive: f64,
    /// Random phase over one metre of path that the repeats ask for, rad.
    pub turbulence: f64,
    /// The most of it that the repeats allow.
    pub most_turbulence: f64,
    /// Floor that silence shows, in the reading's unit.
    pub floor: f64,
    /// The largest floor that silence allows: nothing can read less than the floor.
    pub most_floor: f64,
    /// By how much silence prefers that floor to none, in nats.
    pub floor_evidence: f64,
    /// Visits that came again to a point, with what they differed by.
    pub pairs: Arc<[Pair]>,
}

impl Default for Scatter {
    fn default() -> Self {
        Self {
            share: 0.02,
            additive: 0.0,
            turbulence: 0.0,
            most_turbulence: f64::INFINITY,
            floor: 0.0,
            most_floor: f64::INFINITY,
            floor_evidence: 0.0,
            pairs: Arc::new([]),
        }
    }
}

/// Below this the scatter's share is not told from none, and the transform below loses digits.
const LEAST_SHARE: f64 = 1e-4;

/// The additive part is taken for no less than this of the largest reading: what is lower is below any converter's step.
const LEAST_ADDITIVE: f64 = 1e-4;

impl Scatter {
    /// Whether there are repeats enough to tell it, whatever the readings should have been.
    pub fn is_told_by_repeats(&self) -> bool {
        self.pairs.len() >= ENOUGH
    }

    /// Standard deviation at a level.
    pub fn at(&self, level: f64) -> f64 {
        let share = self.share * level;
        (share * share + self.additive * self.additive).sqrt()
    }

    /// The scale on which readings scatter by one everywhere, but for a floor: ∫ dm / √(a² m² + b²) = asinh(a m / b) / a.
    pub fn stabilised(&self, reading: f64) -> f64 {
        let share = self.share.max(LEAST_SHARE);
        let x = share * reading / self.additive;
        // asinh of what is not negative; the library's minds the last digits near zero, at twice the time.
        (x + (x * x + 1.0).sqrt()).ln() / share
    }

    /// By how much the repeats speak against turbulence of so much, in nats, from the one that suits them best.
    pub fn against_turbulence(&self, turbulence: f64) -> f64 {
        let of = |turbulence| cost(&self.pairs, self.share, self.additive, turbulence);
        (of(turbulence) - of(self.turbulence)).max(0.0)
    }

    fn with_most_turbulence(self) -> Self {
        /// Nats against it at which turbulence is out of the question.
        const TOO_MUCH: f64 = 15.0;
        /// Where the search for it begins, rad over √m, and the factor of its steps.
        const FROM: f64 = 0.01;
        const FACTOR: f64 = 1.25;
        let mut most_turbulence = self.turbulence.max(FROM);
        while most_turbulence < 100.0 && self.against_turbulence(most_turbulence) < TOO_MUCH {
            most_turbulence *= FACTOR;
        }
        Self { most_turbulence, ..self }
    }

    /// Slope of that scale.
    pub fn slope(&self, reading: f64) -> f64 {
        1.0 / self.at(reading)
    }

    /// Mean reading of a level with quadrature noise of standard deviation `quadrature`: between Rayleigh's mean at no
    /// level and m + q²/2m far above the noise (a rational fit to Rice's mean, right to 2.5 % of q).
    pub fn mean_reading(level: f64, quadrature: f64) -> f64 {
        let q2 = quadrature * quadrature;
        let m2 = level * level;
        if q2 == 0.0 {
            return level;
        }
        (m2 + q2 * (1.0 + 0.5708 / (1.0 + 0.434 * m2 / q2))).sqrt()
    }
}

/// Silent readings or pairs of visits fewer than this tell nothing.
const ENOUGH: usize = 8;

/// What silence says: quadrature noise, floor, and the evidence for the floor.
///
/// Of r² = floor² + b² (n₁² + n₂²) the excess over the floor is exponential with mean 2 b²: the floor's likelihood is greatest
/// just below the least reading.
pub(super) fn of_silence(silent: &[f64]) -> Option<(f64, f64, f64)> {
    if silent.len() < ENOUGH {
        return None;
    }
    let n = silent.len() as f64;
    let squares: Vec<f64> = silent.iter().map(|reading| reading * reading).collect();
    let mean = squares.iter().sum::<f64>() / n;
    let least = squares.iter().copied().fold(f64::INFINITY, f64::min);
    let excess = mean - least;
    // Of n exponential numbers the least stands 1/n of the mean above zero.
    let evidence = n * (mean / excess.max(1e-12 * mean)).ln() - 1.0;
    /// Nats that a floor must gain before it is taken for one: one number is fitted, over some decades.
    const ENOUGH_EVIDENCE: f64 = 7.0;
    if evidence > ENOUGH_EVIDENCE {
        let power = excess * n / (n - 1.0);
        let floor = (least - power / n).max(0.0).sqrt();
        return Some(((0.5 * power).sqrt(), floor, evidence));
    }
    Some(((0.5 * mean).sqrt(), 0.0, 0.0))
}

/// The least silent reading, and some more, as it is read with an error itself.
fn most_floor(silent: &[f64], additive: f64) -> f64 {
    const SOME_MORE: f64 = 0.1;
    match silent.len() >= ENOUGH {
        true => {
            silent.iter().copied().fold(f64::INFINITY, f64::min) * (1.0 + SOME_MORE)
                + SOME_MORE * additive
        }
        false => f64::INFINITY,
    }
}

/// The level that a reading had before a floor was added in power.
pub(super) fn without_floor(reading: f64, floor: f64) -> f64 {
    (reading * reading - floor * floor).max(0.0).sqrt()
}

/// What a reading should have been, and what turbulence of one rad over √m would scatter of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Level {
    /// In the reading's unit, any floor included.
    pub reading: f64,
    /// What it changes by for a change of what the floor was added to: one without a floor.
    pub beside_floor: f64,
    /// Mean square, in the unit squared.
    pub speckle: f64,
}

impl Level {
    /// Of a reading that holds a floor.
    pub fn new(reading: f64, floor: f64, speckle: f64) -> Self {
        let beside_floor = without_floor(reading, floor) / reading.max(f64::MIN_POSITIVE);
        Self { reading, beside_floor, speckle }
    }
}

/// What two visits of one point differ by beyond what they should.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair {
    level: Level,
    difference: f64,
}

/// Judges the scatter of a scan, given what each reading should have been, drive by drive.
///
/// The additive part is silence's; the share is told by visits that came again to a point, the turbulence by
/// the way in which their scatter depends on the level. Where no point was visited again, the fine structure
/// of the residual along the rows stands for both: an upper bound.
pub(super) fn judge(scan: &ObservedScan, levels: &[Vec<Level>]) -> Scatter {
    let (additive, floor, floor_evidence) = match of_silence(&scan.silent) {
        Some((additive, floor, evidence)) => (Some(additive), floor, evidence),
        None => (None, 0.0, 0.0),
    };
    let pairs = pairs(scan, levels);
    let rough = roughness(scan, levels);
    // A converter with coarse steps reads silence as nothing at all.
    let largest = scan.drives.iter().flat_map(|d| &d.readings).fold(0.0f64, |a, r| a.max(*r));
    let lowest = (LEAST_ADDITIVE * largest).max(f64::MIN_POSITIVE);
    let additive = additive.unwrap_or(rough.1).max(lowest);
    let scatter = Scatter {
        share: rough.0,
        additive,
        turbulence: 0.0,
        most_turbulence: f64::INFINITY,
        floor,
        most_floor: most_floor(&scan.silent, additive),
        floor_evidence,
        pairs: pairs.into(),
    };
    let pairs = &scatter.pairs;
    if pairs.len() < ENOUGH {
        return scatter;
    }
    let (share, steady_cost) = least(LEAST_SHARE, 1.0, |share| cost(pairs, share, additive, 0.0));
    let both =
        |turbulence: f64| least(LEAST_SHARE, 1.0, |share| cost(pairs, share, additive, turbulence));
    let (turbulence, turbulent_cost) = least(0.01, 10.0, |turbulence| both(turbulence).1);
    /// Nats that turbulence must gain before scatter is put down to it.
    const ENOUGH_EVIDENCE: f64 = 8.0;
    if steady_cost - turbulent_cost > ENOUGH_EVIDENCE {
        let share = both(turbulence).0;
        return Scatter { share, turbulence, ..scatter }.with_most_turbulence();
    }
    // Repeats also differ by what the model of them leaves out (a lag, a drift); the residual's fine structure along
    // the rows does less so, if it is rougher than the noise by less.
    /// By how much the fine structure may underestimate the noise.
    const DOUBT: f64 = 2.0;
    let share = share.min(DOUBT * rough.0);
    Scatter { share, ..scatter }.with_most_turbulence()
}

/// The scatter of a scan, share and additive part moved to where all its readings, silence and repeats together are
/// likeliest, as far as silence and repeats allow.
pub(super) fn settled(scan: &ObservedScan, levels: &[Vec<Level>], judged: Scatter) -> Scatter {
    /// Factor by which silence and repeats may be off: some sixty silent readings tell a deviation to 6 %.
    const DOUBT: f64 = 1.15;
    if judged.turbulence > 0.0 || judged.pairs.len() < ENOUGH || scan.silent.len() < ENOUGH {
        return judged;
    }
    let mut told: Vec<Pair> = Vec::new();
    for (drive, levels) in scan.drives.iter().zip(levels) {
        for (reading, level) in drive.readings.iter().zip(levels) {
            // A reading scatters by half of what a difference of two does.
            let difference = 2f64.sqrt() * (reading - level.reading);
            told.push(Pair { level: *level, difference });
        }
    }
    let silence: f64 = scan.silent.iter().map(|r| without_floor(*r, judged.floor).powi(2)).sum();
    let of_silence = |additive: f64| {
        let variance = additive * additive;
        scan.silent.len() as f64 * variance.ln() + 0.5 * silence / variance
    };
    let of = |share: f64, additive: f64| {
        cost(&told, share, additive, 0.0)
            + cost(&judged.pairs, share, additive, 0.0)
            + of_silence(additive)
    };
    let best_share = |additive: f64| {
        least(judged.share / DOUBT, judged.share * DOUBT, |share| of(share, additive))
    };
    let (additive, _) =
        least(judged.additive / DOUBT, judged.additive * DOUBT, |additive| best_share(additive).1);
    let share = best_share(additive).0;
    Scatter { share, additive, ..judged }.with_most_turbulence()
}

fn pairs(scan: &ObservedScan, levels: &[Vec<Level>]) -> Vec<Pair> {
    /// Nanometres within which two visits are of one point.
    const SAME_NM: f64 = 1e4;
    let mut pairs = Vec::new();
    for (drive, levels) in scan.drives.iter().zip(levels) {
        let mut seen = std::collections::HashMap::new();
        for (index, visit) in drive.visits.iter().enumerate() {
            let cell: [i64; 3] = visit.at_m.map(|m| (m * 1e9 / SAME_NM).round() as i64).into();
            if let Some(before) = seen.insert(cell, index) {
                let beyond = |i: usize| drive.readings[i] - levels[i].reading;
                pairs.push(Pair {
                    level: levels[index],
                    difference: beyond(index) - beyond(before),
                });
            }
        }
    }
    pairs
}

/// Negative logarithm of the likelihood of pairs, each a difference of two readings.
fn cost(pairs: &[Pair], share: f64, additive: f64, turbulence: f64) -> f64 {
    pairs
        .iter()
        .map(|pair| {
            let Level { reading, beside_floor, speckle } = pair.level;
            let (m2, beside2) = (reading * reading, beside_floor * beside_floor);
            let q2 = additive * additive + 0.5 * turbulence * turbulence * speckle;
            // Near a null the magnitude scatters less than its quadratures do.
            let quadrature = q2 * (1.0 - 0.5708 / (1.0 + 0.434 * beside2 * m2 / q2));
            let variance = 2.0 * (share * share * m2 + beside2 * quadrature);
            0.5 * (variance.ln() + pair.difference * pair.difference / variance)
        })
        .sum()
}

/// The least value of a function of a positive number and where it stands, by golden section over its logarithm.
fn least(from: f64, to: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let (mut low, mut high) = (from.ln(), to.ln());
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let at = |low: f64, high: f64, share: f64| low + share * (high - low);
    let (mut x1, mut x2) = (at(low, high, 1.0 - GOLDEN), at(low, high, GOLDEN));
    let (mut f1, mut f2) = (f(x1.exp()), f(x2.exp()));
    while high - low > 5e-3 {
        if f1 < f2 {
            (high, x2, f2) = (x2, x1, f1);
            x1 = at(low, high, 1.0 - GOLDEN);
            f1 = f(x1.exp());
        } else {
            (low, x1, f1) = (x1, x2, f2);
            x2 = at(low, high, GOLDEN);
            f2 = f(x2.exp());
        }
    }
    let x = 0.5 * (low + high);
    (x.exp(), f(x.exp()))
}

/// Share and additive part as the residual's third differences along evenly spaced visits tell them: their square is 20
/// times the variance of white noise.
fn roughness(scan: &ObservedScan, levels: &[Vec<Level>]) -> (f64, f64) {
    let mut told: Vec<(f64, f64)> = Vec::new();
    for (drive, levels) in scan.drives.iter().zip(levels) {
        let beyond = |i: usize| drive.readings[i] - levels[i].reading;
        for i in 0..drive.visits.len().saturating_sub(3) {
            let even = (i + 2..i + 4).all(|j| {
                let (a, b) = (&drive.visits[j], &drive.visits[i + 1]);
                (a.velocity_m_s - b.velocity_m_s).norm() <= 1e-3 * b.velocity_m_s.norm()
            });
            if even {
                let third = beyond(i + 3) - 3.0 * beyond(i + 2) + 3.0 * beyond(i + 1) - beyond(i);
                let level = 0.5 * (levels[i + 1].reading + levels[i + 2].reading);
                told.push((level * level, third * third / 20.0));
            }
        }
    }
    if told.is_empty() {
        let default = Scatter::default();
        let readings = scan.drives.iter().flat_map(|drive| &drive.readings);
        let largest = readings.fold(0.0f64, |largest, r| largest.max(*r));
        return (default.share, 5e-3 * largest);
    }
    told.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (low, high) = told.split_at(told.len() / 2);
    // Medians, as a gap is rough in some places: of the square of a normal number, 0.455 times its mean.
    let middle = |part: &[(f64, f64)]| {
        let mut variances: Vec<f64> = part.iter().map(|(_, variance)| *variance).collect();
        variances.sort_by(f64::total_cmp);
        let levels = part.iter().map(|(level, _)| level).sum::<f64>() / part.len().max(1) as f64;
        (levels, variances.get(variances.len() / 2).copied().unwrap_or(0.0) / 0.455)
    };
    let ((low_level, low), (high_level, high)) = (middle(low), middle(high));
    let share = ((high - low) / (high_level - low_level).max(f64::MIN_POSITIVE)).max(0.0).sqrt();
    let additive = (low - share * share * low_level).max(1e-4 * low).sqrt();
    (share.max(1e-3), additive)
}
