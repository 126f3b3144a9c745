//! The scatter of readings about their mean, from dark readings and repeats.
//!
//! The model of a reading stands in [`Scatter`]'s module.

use fieldgap_acoustics::golden_section::least_positive;
use fieldgap_comparison::{DarkNoise, DarkReadings, PlaneNoise, USUAL_PROPORTIONAL_NOISE};

use crate::limits::{
    FEWEST_REPEATS, FLOOR_MARGIN, FLUCTUATION_POSSIBLE, FLUCTUATION_SHOWN, LEAST_ADDITIVE_NOISE,
    MOST_SHARE, NOISE_AGAINST_REPEATS, NOISE_SEARCH_FACTOR, ROUGHNESS_FACTOR, USUAL_ADDITIVE_NOISE,
};
use crate::model::observations::ObservedScan;
use crate::noise::fluctuating::fluctuating;
use crate::noise::repeats::{full_scale, pairs_beside};
use crate::statistics::fluctuation::Fluctuation;
use crate::statistics::median::median;
use crate::statistics::noise_scale::LEAST_SHARE;
use crate::statistics::reading_pairs::{Compression, Detector, Level, Pair, cost};
use crate::statistics::scatter::{Scatter, against_unusual};

/// Prior of the proportional noise, in nats.
fn against_share(share: f64) -> f64 {
    against_unusual(share, USUAL_PROPORTIONAL_NOISE)
}

/// Prior of the quadratures' noise where dark readings do not tell it, in nats.
fn against_additive(additive: f64, largest: f64) -> f64 {
    against_unusual(additive, USUAL_ADDITIVE_NOISE.get() * largest)
}

/// The least dark reading, or the floor that dark readings show, with a margin for their error.
fn most_floor(dark: &DarkReadings, known: f64, additive: f64) -> f64 {
    dark.least().max(known) * (1.0 + FLOOR_MARGIN) + FLOOR_MARGIN * additive
}

/// Judges the scatter of a scan, given what each reading should have been, drive by drive.
///
/// Dark readings give the additive part. Repeats give the proportional part, and a fluctuation by how their scatter depends on the
/// level. Without repeats the maps of dense planes give both, and else the fine structure of the residual along the rows an upper bound.
pub(crate) fn judge_scatter(scan: &ObservedScan, levels: &[Vec<Level>]) -> Scatter {
    // A converter with coarse steps makes every dark reading zero.
    let largest = scan.drives.iter().flat_map(|d| &d.readings).fold(0.0f64, |a, r| a.max(*r));
    let in_rows = roughness(scan, levels, false);
    let rough = in_rows.unwrap_or((USUAL_PROPORTIONAL_NOISE, USUAL_ADDITIVE_NOISE.get() * largest));
    let lowest = (LEAST_ADDITIVE_NOISE * largest).max(f64::MIN_POSITIVE);
    let dark = scan.dark_readings();
    let unknown = DarkNoise::without_floor(rough.1);
    let mut known = dark.as_ref().map_or(unknown, |dark| dark.noise(USUAL_PROPORTIONAL_NOISE));
    let mut after_all_noise = false;
    let pairs_by = |floor: f64, after_all_noise: bool| {
        pairs_beside(scan, levels, Detector { floor, after_all_noise })
    };
    let mut pairs = pairs_by(known.floor_after_noise(), false);
    let beside_floor = known.floor > 0.0 && scan.averaged == 1.0 && pairs.len() >= FEWEST_REPEATS;
    if let Some(dark) = dark.as_ref().filter(|_| beside_floor) {
        // Beside a floor, dark readings have proportional noise too, unless it comes in before the floor, so both parts are found from dark readings
        // and repeats together.
        let most_share = (ROUGHNESS_FACTOR.get() * rough.0).max(10.0 * LEAST_SHARE);
        let most = dark.floor_beside(0.0);
        // Additive part, proportional part that silence shows, and cost; silence has so much of the proportional part.
        let beside = |pairs: &[Pair], in_silence: f64| {
            let of = |additive: f64| {
                least_positive(LEAST_SHARE, most_share, |share| {
                    cost(pairs, share, additive, 0.0, Fluctuation::OfPaths)
                        + dark.cost(additive, in_silence * share)
                        + against_share(share)
                })
            };
            let (additive, cost) =
                least_positive(1e-3 * most, 0.7 * most, |additive| of(additive).1);
            (additive, in_silence * of(additive).0, cost)
        };
        let in_silence_too = beside(&pairs, 1.0);
        let before_floor = beside(&pairs_by(known.floor, true), 0.0);
        after_all_noise = before_floor.2 < in_silence_too.2;
        let (additive, share, _) = if after_all_noise { before_floor } else { in_silence_too };
        let evidence = dark.noise(share).evidence;
        let floor = dark.floor_beside(additive);
        known = DarkNoise { additive, floor, evidence, before_noise: false };
        pairs = pairs_by(known.floor, after_all_noise);
        let after = pairs_by(0.0, false);
        let (additive, of_after) =
            least_positive(1e-3 * floor, floor, |additive| of_steady(&after, additive));
        // Readings that scatter near the floor as they do elsewhere have a noise of their own, which silence lacks, unless they fluctuate.
        let fluctuating = best_fluctuation(&pairs, known.additive).2 + FLUCTUATION_SHOWN.get();
        let steady = of_steady(&pairs, known.additive) - FLUCTUATION_SHOWN.get();
        if of_after < steady.min(fluctuating) {
            known = DarkNoise { additive, before_noise: true, ..known };
            after_all_noise = false;
            pairs = after;
        }
    }
    if compresses(levels) && known.floor == 0.0 && pairs.len() >= FEWEST_REPEATS {
        // Which noise comes in before a detector that compresses, repeats tell.
        let other = pairs_by(0.0, true);
        let [after, before] = [&pairs, &other].map(|pairs| of_steady(pairs, known.additive));
        if before < after {
            after_all_noise = true;
            pairs = other;
        }
    }
    let additive = known.additive.max(lowest);
    let scatter = Scatter {
        share: rough.0,
        slow: None,
        additive,
        fluctuation: 0.0,
        cause: Fluctuation::OfPaths,
        prefers_fluctuation: 0.0,
        may_fluctuate: scan.scatter.may_fluctuate,
        most_turbulence: f64::INFINITY,
        most_jitter_mm: f64::INFINITY,
        floor: known.floor,
        floor_before_noise: known.before_noise,
        detector_after_all_noise: after_all_noise,
        most_floor: dark
            .as_ref()
            .map_or(f64::INFINITY, |dark| most_floor(dark, known.floor, additive)),
        floor_evidence: known.evidence,
        pairs: pairs.into(),
        told_by_map: false,
    };
    let pairs = &scatter.pairs;
    if pairs.len() < FEWEST_REPEATS {
        return match scan.map_noise.filter(|noise| !noise.is_bound) {
            Some(noise) => by_map(scan, scatter, noise, dark.is_some(), lowest),
            None => scatter,
        };
    }
    let of_silence = |additive: f64| match &dark {
        Some(dark) if known.floor == 0.0 => dark.cost_without_floor(additive),
        Some(_) => 0.0,
        None => against_additive(additive, largest),
    };
    let (steady_additive, steady_cost) = match known.floor == 0.0 {
        true => least_positive(
            additive / NOISE_SEARCH_FACTOR.get(),
            additive * NOISE_SEARCH_FACTOR.get(),
            |additive| of_steady(pairs, additive) + of_silence(additive),
        ),
        false => (additive, of_steady(pairs, additive)),
    };
    // What no dark reading tells is no sign of a fluctuation.
    let additive = if dark.is_some() { additive } else { steady_additive };
    let (fluctuation, cause, fluctuating_cost) = best_fluctuation(pairs, additive);
    let prefers_fluctuation = steady_cost - fluctuating_cost - of_silence(additive);
    let shown = if scatter.may_fluctuate { FLUCTUATION_POSSIBLE } else { FLUCTUATION_SHOWN.get() };
    if prefers_fluctuation > shown {
        let share = best_share(pairs, additive, fluctuation, cause).0;
        return Scatter { share, additive, fluctuation, cause, prefers_fluctuation, ..scatter }
            .with_limits();
    }
    // Effects that the model leaves out (a lag, a drift) make repeats differ too. The fine structure of the residual along the rows
    // is less sensitive to them and bounds the result.
    let in_rows = if after_all_noise { roughness(scan, levels, true) } else { in_rows };
    let most_share = in_rows.map_or(MOST_SHARE, |(share, _)| ROUGHNESS_FACTOR.get() * share);
    let steady_share = best_share(pairs, steady_additive, 0.0, Fluctuation::OfPaths).0;
    let (additive, share) = (steady_additive, steady_share.min(most_share));
    Scatter { share, additive, prefers_fluctuation, ..scatter }.with_limits()
}

/// The scatter with the noise that the maps show. Where dark readings tell the additive part, the proportional one is what the noise of all readings
/// has beyond it: maps tell the sum of both better than either.
fn by_map(
    scan: &ObservedScan,
    scatter: Scatter,
    noise: PlaneNoise,
    has_dark: bool,
    lowest: f64,
) -> Scatter {
    let (share, additive) = match has_dark {
        true => {
            let readings = || scan.drives.iter().flat_map(|drive| &drive.readings);
            let power = readings().map(|r| r * r).sum::<f64>() / scan.len().max(1) as f64;
            let beyond = noise.relative.powi(2) - scatter.additive.powi(2) / power;
            (beyond.max(0.0).sqrt(), scatter.additive)
        }
        false => (noise.multiplicative, noise.additive.max(lowest)),
    };
    Scatter { share: share.clamp(LEAST_SHARE, MOST_SHARE), additive, told_by_map: true, ..scatter }
}

/// The likeliest proportional part of repeats beside these other parts, and its cost, nats.
fn best_share(pairs: &[Pair], additive: f64, fluctuation: f64, cause: Fluctuation) -> (f64, f64) {
    least_positive(LEAST_SHARE, MOST_SHARE, |share| {
        cost(pairs, share, additive, fluctuation, cause) + against_share(share)
    })
}

/// The likeliest fluctuation of repeats beside this additive part, its cause and its cost, nats.
fn best_fluctuation(pairs: &[Pair], additive: f64) -> (f64, Fluctuation, f64) {
    let of = |cause: Fluctuation| {
        let cost = |fluctuation: f64| best_share(pairs, additive, fluctuation, cause).1;
        let (fluctuation, cost) = least_positive(0.01, 10.0, cost);
        (fluctuation, cause, cost)
    };
    let [first, others @ ..] = Fluctuation::ALL.map(of);
    others.into_iter().fold(first, |best, other| if other.2 < best.2 { other } else { best })
}

/// The cost of repeats beside this additive part and no fluctuation, nats.
fn of_steady(pairs: &[Pair], additive: f64) -> f64 {
    best_share(pairs, additive, 0.0, Fluctuation::OfPaths).1
}

/// The scatter of a scan at the maximum likelihood of all its readings, within the range that dark readings and repeats allow. Whether proportional noise comes in
/// before a detector that compresses, all readings tell better than repeats.
pub(crate) fn settled(scan: &ObservedScan, levels: &[Vec<Level>], judged: Scatter) -> Scatter {
    let Some(dark) = scan.dark_readings() else { return judged };
    let averaged_beside_floor = judged.floor > 0.0 && scan.averaged > 1.0;
    if judged.fluctuation > 0.0 || judged.pairs.len() < FEWEST_REPEATS || averaged_beside_floor {
        return judged;
    }
    let otherwise = (compresses(levels) && judged.floor == 0.0).then(|| {
        let after_all_noise = !judged.detector_after_all_noise;
        let pairs = pairs_beside(scan, levels, Detector { floor: 0.0, after_all_noise });
        let share = best_share(&pairs, judged.additive, 0.0, Fluctuation::OfPaths).0;
        let other = Scatter { share, pairs: pairs.into(), ..judged.clone() };
        Scatter { detector_after_all_noise: after_all_noise, ..other }
    });
    let of = |judged: Scatter| likeliest(scan, levels, judged, &dark);
    let (cost, scatter) = of(judged);
    let other = otherwise.map(of).filter(|(of_other, _)| *of_other < cost);
    other.map_or(scatter, |(_, other)| other)
}

/// Whether the detector compresses any of these levels.
fn compresses(levels: &[Vec<Level>]) -> bool {
    levels.iter().flatten().any(|level| level.compression != Compression::NONE)
}

/// The likeliest scatter by all readings, with its cost, nats.
fn likeliest(
    scan: &ObservedScan,
    levels: &[Vec<Level>],
    judged: Scatter,
    dark: &DarkReadings,
) -> (f64, Scatter) {
    let full_scale = full_scale(scan);
    let detector =
        Detector { floor: judged.floor, after_all_noise: judged.detector_after_all_noise };
    let mut known: Vec<Pair> = Vec::new();
    for (drive, levels) in scan.drives.iter().zip(levels) {
        for ((reading, level), visit) in drive.readings.iter().zip(levels).zip(&drive.visits) {
            if *reading >= full_scale {
                continue;
            }
            // The variance of a reading is half that of a difference of two.
            let difference = (2.0 / visit.variance).sqrt() * (reading - level.reading);
            known.push(Pair::new(*level, scan.averaged, detector, difference));
        }
    }
    let steady = |pairs: &[Pair], share: f64, additive: f64| {
        cost(pairs, share, additive, 0.0, Fluctuation::OfPaths)
    };
    let against = |share: f64, additive: f64| {
        let of_silence = match judged.floor > 0.0 {
            true => dark.cost(additive, judged.share_in_silence(share)),
            false => dark.cost_without_floor(additive),
        };
        steady(&judged.pairs, share, additive) + of_silence + against_share(share)
    };
    let of = |share: f64, additive: f64| steady(&known, share, additive) + against(share, additive);
    let least_against = against(judged.share, judged.additive);
    // The two limits depend on each other: beside a floor dark readings give a sum of both.
    let either = |at: f64, against: &dyn Fn(f64) -> f64| {
        least_positive(at / NOISE_SEARCH_FACTOR.get(), at * NOISE_SEARCH_FACTOR.get(), against).1
    };
    let limit = |factor: f64, against: &dyn Fn(f64) -> f64| {
        let mut limit = 1.0;
        while (0.02..50.0).contains(&limit)
            && against(limit) < least_against + NOISE_AGAINST_REPEATS
        {
            limit *= factor;
        }
        limit
    };
    const FINER: f64 = 1.06;
    let of_share =
        |factor: f64| either(judged.additive, &|additive| against(factor * judged.share, additive));
    let of_additive =
        |factor: f64| either(judged.share, &|share| against(share, factor * judged.additive));
    let shares = [1.0 / FINER, FINER].map(|factor| judged.share * limit(factor, &of_share));
    let additives =
        [1.0 / FINER, FINER].map(|factor| judged.additive * limit(factor, &of_additive));
    let best_share =
        |additive: f64| least_positive(shares[0], shares[1], |share| of(share, additive));
    let (additive, _) =
        least_positive(additives[0], additives[1], |additive| best_share(additive).1);
    let (share, cost) = best_share(additive);
    let steady = Scatter { share, additive, ..judged };
    let fluctuating = match steady.floor == 0.0 {
        true => fluctuating(&known, dark, &steady),
        false => None,
    };
    (cost, fluctuating.unwrap_or(steady).with_limits())
}

/// Proportional and additive part from third differences of the residual along evenly spaced visits: the mean square of these is 20
/// times the variance of white noise. `None` without such visits. Proportional noise may come in before the detector.
pub(crate) fn roughness(
    scan: &ObservedScan,
    levels: &[Vec<Level>],
    after_all_noise: bool,
) -> Option<(f64, f64)> {
    /// Share of a step by which steps of a row may differ.
    const UNEVEN: f64 = 0.1;
    let full_scale = full_scale(scan);
    let mut known: Vec<(f64, f64)> = Vec::new();
    for (drive, levels) in scan.drives.iter().zip(levels) {
        let beyond = |i: usize| drive.readings[i] - levels[i].reading;
        for i in 0..drive.visits.len().saturating_sub(3) {
            let velocity_m_s = drive.visits[i + 1].motion.velocity_m_s();
            let in_row = drive.visits[i + 1..i + 4].iter().all(|visit| {
                visit.is_in_row()
                    && (visit.motion.velocity_m_s() - velocity_m_s).norm()
                        <= 1e-3 * velocity_m_s.norm()
            });
            // Some readings of a row may have been left out.
            let step_m = |j: usize| drive.visits[j + 1].at_m - drive.visits[j].at_m;
            let first_m = step_m(i);
            let uneven = |j: usize| (step_m(j) - first_m).norm() > UNEVEN * first_m.norm();
            let even = in_row && !uneven(i + 1) && !uneven(i + 2);
            let seen = drive.readings[i..i + 4].iter().all(|&reading| reading < full_scale);
            if even && seen {
                let third = beyond(i + 3) - 3.0 * beyond(i + 2) + 3.0 * beyond(i + 1) - beyond(i);
                let scattered = |level: &Level| match after_all_noise {
                    true => level.reading * level.compression.of_logarithms,
                    false => level.reading,
                };
                let level = 0.5 * (scattered(&levels[i + 1]) + scattered(&levels[i + 2]));
                known.push((level * level, third * third / (20.0 * drive.visits[i].variance)));
            }
        }
    }
    if known.is_empty() {
        return None;
    }
    let readings = scan.drives.iter().flat_map(|drive| &drive.readings);
    let largest = readings.fold(0.0f64, |largest, r| largest.max(*r));
    Some(likeliest_by_medians(known, largest))
}

/// The likeliest share and additive part, from pairs of a squared level and a variance, each of one third difference.
///
/// Medians of groups of like levels are robust where a gap is rough. (Within a group of unlike levels the median would be far below the mean.)
/// A group tells its variance as so many squares of normal numbers do as stand in proportion to its size; few of them leave the usual noise.
fn likeliest_by_medians(mut known: Vec<(f64, f64)>, largest: f64) -> (f64, f64) {
    const GROUPS: usize = 8;
    /// Of the square of a normal number, over its mean.
    const MEDIAN: f64 = 0.455;
    /// Independent squares whose mean tells a variance as well as the median of one third difference's does: a median has 0.37 of the mean's
    /// information, and third differences overlap with a sum of squared correlations of 2.3.
    const INDEPENDENT: f64 = 0.37 / 2.3;
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    let groups: Vec<[f64; 3]> = known
        .chunks(known.len().div_ceil(GROUPS))
        .map(|group| {
            let level2 = median(group.iter().map(|(level2, _)| *level2).collect());
            let variance = median(group.iter().map(|(_, variance)| *variance).collect()) / MEDIAN;
            [INDEPENDENT * group.len() as f64, level2, variance]
        })
        .collect();
    let against = |share: f64, additive: f64| {
        let of_group = |[count, level2, variance]: &[f64; 3]| {
            let expected = share * share * level2 + additive * additive;
            0.5 * count * (expected.ln() + variance / expected)
        };
        groups.iter().map(of_group).sum::<f64>()
            + against_share(share)
            + against_additive(additive, largest)
    };
    let best_share =
        |additive: f64| least_positive(LEAST_SHARE, 1.0, |share| against(share, additive));
    let lowest = (LEAST_ADDITIVE_NOISE * largest).max(f64::MIN_POSITIVE);
    let (additive, _) =
        least_positive(lowest, largest.max(2.0 * lowest), |additive| best_share(additive).1);
    (best_share(additive).0, additive)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::likeliest_by_medians;

    /// Levels as in a focused field: few are large.
    #[test]
    fn both_parts_of_the_noise_are_found_where_few_levels_are_large() {
        const SHARE: f64 = 0.02;
        const ADDITIVE: f64 = 0.004;
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let known = (1..5000).map(|n| {
            let level = (f64::from(n) / 5000.0).powi(3);
            let normal: f64 = StandardNormal.sample(&mut random);
            let deviation = (SHARE * level).hypot(ADDITIVE);
            (level * level, (deviation * normal).powi(2))
        });
        let (share, additive) = likeliest_by_medians(known.collect(), 1.0);
        assert!((share / SHARE - 1.0).abs() < 0.1, "{share}");
        assert!((additive / ADDITIVE - 1.0).abs() < 0.06, "{additive}");
    }
}
