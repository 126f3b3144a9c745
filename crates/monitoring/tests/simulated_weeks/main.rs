//! Weeks of runs in a laboratory whose fields are computed from vibrating pistons, with noise, and compared as a campaign does.
//!
//! The protocol was fixed before its outcome was seen: 12 cells, a round every six hours, a day of baseline, a temperature swing of
//! 2 °C between day and night, a level that walks within ±1 %, homing that repeats to 0.05 mm, noise of 1 %, and a mean gap of 15 to
//! 20 % from effects that nobody modelled.

mod laboratory;
mod week;

use rayon::prelude::*;

use week::{changed_week, quiet_week};

/// Readings of a scan are the square of this.
const SIDE: usize = 17;

/// Number of weeks in which the growth was found within a round of 12 runs, and all delays in order.
fn found(seeds: std::ops::Range<u64>, side: usize) -> (usize, Vec<Option<usize>>) {
    let delay_of = |seed| {
        let delay = changed_week(seed, side);
        println!("changed week {seed}, {} readings: found after {delay:?} runs", side * side);
        delay
    };
    let mut delays: Vec<Option<usize>> = seeds.into_par_iter().map(delay_of).collect();
    delays.sort_by_key(|delay| delay.unwrap_or(usize::MAX));
    (delays.iter().flatten().filter(|delay| **delay <= 12).count(), delays)
}

/// False alarms and runs in weeks without a change.
fn false_alarms(seeds: std::ops::Range<u64>, side: usize) -> (usize, usize) {
    let week_of = |seed| {
        let week = quiet_week(seed, side);
        let alarms: Vec<_> = week.iter().filter(|alarms| !alarms.is_empty()).collect();
        println!("quiet week {seed}: {} alarms in {} runs, {alarms:?}", alarms.len(), week.len());
        (alarms.len(), week.len())
    };
    let weeks: Vec<(usize, usize)> = seeds.into_par_iter().map(week_of).collect();
    weeks.into_iter().fold((0, 0), |(alarms, runs), (a, r)| (alarms + a, runs + r))
}

#[test]
fn a_growth_of_the_gap_is_found_in_a_few_weeks() {
    let (in_time, delays) = found(1000..1002, SIDE);
    assert_eq!(in_time, 2, "{delays:?}");
}

#[test]
fn a_quiet_week_raises_no_more_alarms_than_stated() {
    // With one false alarm in 1,000 runs, more than two in 288 come by chance in 1 of 300 weeks; the seed is fixed.
    let (alarms, runs) = false_alarms(2000..2001, SIDE);
    assert!(alarms <= 2, "{alarms} in {runs}");
}

/// A growth of 5 % is found within a round in at least 95 of 100 weeks. How many within three runs is printed.
#[test]
#[ignore = "many minutes"]
fn a_growth_of_the_gap_is_found_within_a_round() {
    let (in_time, delays) = found(20_000..20_100, SIDE);
    let in_three = delays.iter().flatten().filter(|delay| **delay <= 3).count();
    println!("{in_time} of 100, {in_three} within three runs; {delays:?}");
    assert!(in_time >= 95, "{in_time}: {delays:?}");
}

/// At most one false alarm in 1,000 runs, from 10,080 runs.
#[test]
#[ignore = "many minutes"]
fn false_alarms_are_at_most_one_in_a_thousand_runs() {
    let (alarms, runs) = false_alarms(25_000..25_035, SIDE);
    println!("{alarms} in {runs}");
    assert!(runs >= 10_000 && alarms * 1000 <= runs, "{alarms} in {runs}");
}

/// From which size of scan on the growth is found.
#[test]
#[ignore = "many minutes; prints a table"]
fn larger_scans_find_the_growth_sooner() {
    let rates: Vec<usize> = [5, 7, 9, 13]
        .into_iter()
        .map(|side| {
            let (in_time, delays) = found(100..140, side);
            let median = delays[delays.len() / 2];
            println!("{} readings: {in_time} of 40, median {median:?}, {delays:?}", side * side);
            in_time
        })
        .collect();
    assert!(rates.first() < rates.last(), "{rates:?}");
}
