//! The counted rates and their targets.

use super::super::assignment::Category;
use super::super::parsed_diagnosis::ParsedVerdict;
use super::judged::Judged;
use super::rate::{Figure, Rate, Target};
use super::targets::Targets;

/// Gap from which nearly every cause should be named, in standard deviations of a reading's noise.
pub(super) const CLEAR: f64 = 0.5;

/// Ranges of the gap.
const BINS: [(f64, f64, &str); 4] = [
    (0.0, 0.12, "gap < 0.12 sigma"),
    (0.12, CLEAR, "gap 0.12 to 0.5 sigma"),
    (CLEAR, 2.0, "gap 0.5 to 2 sigma"),
    (2.0, f64::INFINITY, "gap > 2 sigma"),
];

/// Every rate.
pub(super) fn rates(judged: &[Judged<'_>], targets: Targets) -> Vec<Rate> {
    let mut rates = Vec::new();
    of_one(judged, &mut rates);
    of_two(judged, targets, &mut rates);
    of_three(judged, &mut rates);
    of_whole_bench(judged, &mut rates);
    of_none(judged, targets, &mut rates);
    of_unmodelled(judged, targets, &mut rates);
    rates
}

/// The median explained share of the gap where the cause was named exactly and the gap is clear.
pub(super) fn median_explained(judged: &[Judged<'_>]) -> Figure {
    let mut fractions: Vec<f64> = judged
        .iter()
        .filter(|one| one.is_exact() && one.answer.gap_sigma >= CLEAR)
        .filter_map(|one| one.diagnosis.explained_fraction)
        .collect();
    fractions.sort_by(f64::total_cmp);
    let of = fractions.len();
    let median = (of > 0).then(|| 0.5 * (fractions[(of - 1) / 2] + fractions[of / 2]));
    let what = "median explained fraction where named exactly, gap >= 0.5 sigma";
    Figure::new(what, median, of, Target::AtLeast(0.97))
}

fn of_one(judged: &[Judged<'_>], rates: &mut Vec<Rate>) {
    let exact_or_alternative = |one: &Judged<'_>| one.is_exact() || one.is_among_alternatives();
    for (least, most, bin) in BINS {
        let of = || sized(judged, Category::One, least, most);
        rates.push(Rate::of(format!("one effect, {bin}: named exactly"), of(), Judged::is_exact));
        let what = format!("one effect, {bin}: exactly or among two or three");
        rates.push(Rate::of(what, of(), exact_or_alternative));
        let what = format!("one effect, {bin}: explained with a wrong cause");
        rates.push(Rate::of(what, of(), Judged::is_wrong));
    }
    let clear = || sized(judged, Category::One, CLEAR, f64::INFINITY);
    rates.extend([
        Rate::of("one effect, gap >= 0.5 sigma: named exactly", clear(), Judged::is_exact)
            .with(Target::AtLeast(0.95)),
        Rate::of(
            "one effect, gap >= 0.5 sigma: exactly or among two or three",
            clear(),
            exact_or_alternative,
        )
        .with(Target::AtLeast(0.98)),
        Rate::of(
            "one effect, any gap: explained with a wrong cause",
            sized(judged, Category::One, 0.0, f64::INFINITY),
            Judged::is_wrong,
        )
        .with(Target::AtMost(0.01)),
    ]);
}

fn of_two(judged: &[Judged<'_>], targets: Targets, rates: &mut Vec<Rate>) {
    let pairs = || sized(judged, Category::Two, 0.0, f64::INFINITY);
    let smaller = |one: &Judged<'_>| {
        one.answer.gaps_alone_sigma.iter().copied().fold(f64::INFINITY, f64::min)
    };
    rates.extend([
        Rate::of(
            "two effects, each >= 0.5 sigma alone: both exactly",
            pairs().filter(|one| smaller(one) >= CLEAR),
            Judged::is_exact,
        ),
        Rate::of("two effects: both exactly", pairs(), Judged::is_exact).with(targets.pairs),
        Rate::of("two effects: both exactly or among two or three sets", pairs(), |one| {
            one.is_exact() || one.is_among_alternatives()
        }),
        Rate::of(
            "two effects, where explained: every named one true",
            pairs().filter(Judged::is_explained),
            Judged::names_only_truth,
        )
        .with(Target::AtLeast(0.95)),
    ]);
}

fn of_three(judged: &[Judged<'_>], rates: &mut Vec<Rate>) {
    let triples = || sized(judged, Category::Three, 0.0, f64::INFINITY);
    rates.extend([
        Rate::of("three effects: all exactly", triples(), Judged::is_exact),
        Rate::of("three effects: all exactly or among two or three sets", triples(), |one| {
            one.is_exact() || one.is_among_alternatives()
        }),
        Rate::of(
            "three effects, where explained: every named one true",
            triples().filter(Judged::is_explained),
            Judged::names_only_truth,
        )
        .with(Target::AtLeast(0.95)),
    ]);
}

fn of_whole_bench(judged: &[Judged<'_>], rates: &mut Vec<Rate>) {
    let all = || sized(judged, Category::WholeBench, 0.0, f64::INFINITY);
    let dominant_named = |one: &Judged<'_>| {
        one.answer.dominant.as_deref().is_some_and(|dominant| one.is_named(dominant))
    };
    rates.extend([
        Rate::of("whole bench: the dominant one named", all(), dominant_named),
        Rate::of("whole bench: every named one true", all(), Judged::invents_nothing),
        Rate::of("whole bench: the remaining share told", all(), Judged::tells_remainder),
        Rate::of("whole bench: all three", all(), Judged::is_whole_bench_right)
            .with(Target::AtLeast(0.9)),
    ]);
}

fn of_none(judged: &[Judged<'_>], targets: Targets, rates: &mut Vec<Rate>) {
    let none = sized(judged, Category::None, 0.0, f64::INFINITY);
    let alarms = Rate::of("no effect: false alarms", none, Judged::is_alarm);
    rates.push(alarms.with(targets.alarms));
}

fn of_unmodelled(judged: &[Judged<'_>], targets: Targets, rates: &mut Vec<Rate>) {
    let unexplained = |one: &Judged<'_>| one.diagnosis.verdict == ParsedVerdict::Unexplained;
    for (least, most, bin) in BINS {
        let of = || sized(judged, Category::Unmodelled, least, most);
        rates.push(Rate::of(format!("outside, {bin}: unexplained"), of(), unexplained));
        let what = format!("outside, {bin}: named with confidence");
        rates.push(Rate::of(what, of(), Judged::is_explained));
    }
    let all = || sized(judged, Category::Unmodelled, 0.0, f64::INFINITY);
    rates.extend([
        Rate::of("outside: unexplained", all(), unexplained).with(Target::AtLeast(0.85)),
        Rate::of("outside: named with confidence", all(), Judged::is_explained)
            .with(Target::AtMost(0.1)),
    ]);
    if let Some(target) = targets.outside_not_explained {
        let clear = sized(judged, Category::Unmodelled, CLEAR, f64::INFINITY);
        let not_explained = |one: &Judged<'_>| !one.is_explained();
        let what = "outside, gap >= 0.5 sigma: not explained";
        rates.push(Rate::of(what, clear, not_explained).with(target));
    }
}

fn sized<'a, 'b>(
    judged: &'b [Judged<'a>],
    category: Category,
    least: f64,
    most: f64,
) -> impl Iterator<Item = Judged<'a>> + 'b {
    judged.iter().copied().filter(move |one| {
        one.answer.category == category && (least..most).contains(&one.answer.gap_sigma)
    })
}
