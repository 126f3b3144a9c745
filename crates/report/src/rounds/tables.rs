//! The numbers behind the pictures of a closed loop.

use std::collections::BTreeSet;

use maud::{Markup, html};

use super::super::html::table;
use super::figures::{information, name, verifications};
use super::set::{moved, searched};
use super::{LoopOfRounds, duration_s};
use fieldgap_closed_loop::{Cure, Purpose};
use fieldgap_records::RecordedSample;
use fieldgap_text::{ABSENT, fixed, percent};

/// Where and when each round measured.
pub(super) fn rounds(of: &LoopOfRounds<'_>) -> Markup {
    let begun_s = of.record.samples.first().map_or(0.0, |first| first.time_s);
    let rows = of.measured().map(|round| {
        let samples = of.samples(round);
        let silent = samples.iter().filter(|sample| sample.focus.is_none()).count();
        let ends = |axis: usize| {
            let along = samples.iter().map(|sample| sample.position_mm[axis]);
            let (low, high) =
                along.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), mm| (a.min(mm), b.max(mm)));
            format!("{} to {}", fixed(low, 0), fixed(high, 0))
        };
        let from_s = samples.first().map_or(0.0, |first| first.time_s) - begun_s;
        let flown = of.flown(round).filter(|flown| *flown).count();
        let counts = [samples.len(), silent].into_iter().chain(of.flies().then_some(flown));
        let first = std::iter::once(name(round)).chain(counts.map(|count| count.to_string()));
        let others = [
            numbers_of(samples),
            ends(0),
            ends(1),
            ends(2),
            minutes(from_s),
            minutes(duration_s(samples)),
            minutes(round.expected_s),
        ];
        first.chain(others).collect()
    });
    let counted = ["round", "readings", "silent"].into_iter().chain(of.flies().then_some("flown"));
    let columns =
        ["drives", "x (mm)", "y (mm)", "z (mm)", "begun (min)", "took (min)", "expected (min)"];
    let columns: Vec<&str> = counted.chain(columns).collect();
    table("Readings of each round, and times on the robot's clock", &columns, rows)
}

/// The drives that some readings used, as ranges.
fn numbers_of(samples: &[RecordedSample]) -> String {
    let used: BTreeSet<usize> = samples.iter().filter_map(|sample| sample.focus).collect();
    let mut ranges: Vec<(usize, usize)> = Vec::new();
    for drive in used {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == drive => *last = drive,
            _ => ranges.push((drive, drive)),
        }
    }
    let range = |(first, last): &(usize, usize)| match first == last {
        true => first.to_string(),
        false => format!("{first}\u{2013}{last}"),
    };
    ranges.iter().map(range).collect::<Vec<_>>().join(", ")
}

/// The drives, and how often each round used them.
pub(super) fn drives(of: &LoopOfRounds<'_>) -> Markup {
    let planned = of.rounds.first().map_or(0, |first| first.drives[0]);
    let rows = of.record.setup.foci.iter().enumerate().map(|(number, focus)| {
        let of_whom = if number < planned { "the plan" } else { "the loop" };
        let counts = of.measured().map(|round| {
            let samples = of.samples(round).iter();
            samples.filter(|sample| sample.focus == Some(number)).count().to_string()
        });
        let described = [number.to_string(), focus.to_string(), of_whom.to_owned()];
        described.into_iter().chain(counts).collect()
    });
    let counted = of.measured().map(|round| format!("round {}", round.round));
    let columns: Vec<String> =
        ["drive", "what", "of"].map(str::to_owned).into_iter().chain(counted).collect();
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    table("Readings of each drive in each round", &columns, rows)
}

/// The probability of each set after each round.
pub(super) fn probabilities(of: &LoopOfRounds<'_>) -> Markup {
    let after = searched(of.rounds).map(|round| format!("after {}", round.before));
    let columns: Vec<String> = std::iter::once("set".to_owned()).chain(after).collect();
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    let rows = moved(of.rounds).into_iter().map(|moved| {
        let cells = moved.probabilities.iter().map(|p| match *p {
            p if p > 0.0 && p < 5e-4 => "below 0.001".to_owned(),
            p => fixed(p, 3),
        });
        std::iter::once(moved.name).chain(cells).collect()
    });
    table("Probability of each set after so many readings", &columns, rows)
}

/// Expected and obtained information.
pub(super) fn bits(of: &LoopOfRounds<'_>) -> Markup {
    let rows = information(of).into_iter().map(|one| {
        let obtained = one.obtained.map_or(ABSENT.to_owned(), |bits| fixed(bits, 2));
        vec![one.round.round.to_string(), fixed(one.expected, 2), obtained]
    });
    table("Information about the cause", &["round", "expected (bits)", "obtained (bits)"], rows)
}

/// The gaps on fresh readings.
pub(super) fn gaps(of: &LoopOfRounds<'_>) -> Markup {
    let gap = |gap: f64, error: f64| {
        let [gap, error] = [gap, error].map(|ratio| fixed(100.0 * ratio, 2));
        format!("{gap} ± {error} %")
    };
    let absent = || ABSENT.to_owned();
    let rows = verifications(of).into_iter().map(|(round, test)| {
        let file = test.corrected;
        vec![
            round.round.to_string(),
            test.readings.to_string(),
            gap(test.gap_before, test.gap_before_error),
            file.map_or_else(absent, |file| gap(file.gap, file.gap_error)),
            gap(test.gap_after, test.gap_after_error),
            percent(test.noise),
            fixed(file.map_or(test.chi_square, |file| file.chi_square).sqrt(), 2),
            file.map_or_else(absent, |file| fixed(file.departure, 2)),
            if test.holds { "holds" } else { "taken back" }.to_owned(),
        ]
    });
    let columns = [
        "round",
        "readings",
        "gap as believed",
        "corrected set-up",
        "cause as fitted",
        "noise alone",
        "residual / noise",
        "file from fit (sigma)",
        "result",
    ];
    table("Gap on fresh readings alone, with standard errors", &columns, rows)
}

/// What was corrected in which file, and what was only accounted for.
pub(super) fn cure(cure: &Cure) -> Markup {
    let changes = cure.changes.iter().map(|change| {
        let value = |value: &Option<String>| value.clone().unwrap_or(ABSENT.to_owned());
        vec![change.key.clone(), value(&change.before), value(&change.after)]
    });
    html! {
        @match &cure.folder {
            Some(folder) => p { "Corrected in " code { (folder) "/scan.toml" } ": " (cure.corrected.join("; ")) "." },
            None => p { "No set-up file has a key for this cause: nothing was corrected in a file." },
        }
        @if !cure.changes.is_empty() {
            (table("Keys of the set-up that were changed", &["key", "before", "after"], changes))
        }
        @if !cure.accounted.is_empty() {
            p { "Only accounted for, as it was fitted:" }
            ul { @for one in &cure.accounted { li { (one.effect.as_cause()) ": " (one.why) "." } } }
        }
    }
}

/// Seconds as minutes.
pub(super) fn minutes(seconds: f64) -> String {
    fixed(seconds / 60.0, 2)
}

/// Time with the array driven, s: between readings that both were driven.
pub(super) fn sounding_s(samples: &[RecordedSample]) -> f64 {
    let driven = samples.windows(2).filter(|pair| pair.iter().all(|one| one.focus.is_some()));
    driven.map(|pair| pair[1].time_s - pair[0].time_s).sum()
}

/// What the readings of a round are for.
pub(super) fn purpose(purpose: Purpose) -> &'static str {
    match purpose {
        Purpose::First => "a first look, spread evenly",
        Purpose::Explore => "to tell the sets apart",
        Purpose::Verify => "fresh readings that test the named cause",
        Purpose::End => "the end",
    }
}
