//! The causes of each scan of a set: a given share of each category, all causes equally often, in random order.

use serde::{Deserialize, Serialize};

use super::random_sequence::RandomSequence;

/// The kind of cause of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Category {
    /// Noise alone.
    None,
    /// One effect of the catalogue.
    One,
    /// Two effects of the catalogue.
    Two,
    /// A cause that is not in the catalogue.
    #[serde(rename = "outside")]
    Unmodelled,
}

/// Shares of the categories, 0 to 1. All other scans have one effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// Noise alone.
    pub none: f64,
    /// Two effects.
    pub pairs: f64,
    /// A cause that is not in the catalogue.
    pub unmodelled: f64,
}

impl Default for Shares {
    fn default() -> Self {
        Self { none: 0.1, pairs: 0.2, unmodelled: 0.2 }
    }
}

/// The causes of one scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Assignment {
    None,
    Effects(Vec<&'static str>),
    /// By its index in [`UNMODELLED`](super::unmodelled::UNMODELLED).
    Unmodelled(usize),
}

/// Assigns `count` scans, of effects with these ids and of these unmodelled causes, by their index.
pub(super) fn assign(
    count: usize,
    shares: Shares,
    ids: &[&'static str],
    outside: &[usize],
    random: &mut RandomSequence,
) -> Vec<Assignment> {
    let of = |share: f64| (share * count as f64).round() as usize;
    let (none, pairs, unmodelled) = (of(shares.none), of(shares.pairs), of(shares.unmodelled));
    let one = count.saturating_sub(none + pairs + unmodelled);
    let mut assignments = vec![Assignment::None; none];
    let mut singles = Rounds::new(ids.len());
    assignments.extend((0..one).map(|_| Assignment::Effects(vec![ids[singles.next(random)]])));
    let mut halves = Rounds::new(ids.len());
    assignments.extend((0..pairs).map(|_| {
        let first = halves.next(random);
        let mut second = halves.next(random);
        // Across two rounds the same effect may come twice in a row.
        while second == first {
            second = random.index(ids.len());
        }
        let mut both = [first, second];
        both.sort_unstable();
        Assignment::Effects(both.map(|number| ids[number]).to_vec())
    }));
    let mut unmodelled_causes = Rounds::new(outside.len());
    let mut next = || outside[unmodelled_causes.next(random)];
    assignments.extend((0..unmodelled).map(|_| Assignment::Unmodelled(next())));
    assignments.truncate(count);
    random.shuffle(&mut assignments);
    assignments
}

/// Numbers in rounds: each once a round, every round in another random order.
struct Rounds {
    of: usize,
    remaining: Vec<usize>,
}

impl Rounds {
    fn new(of: usize) -> Self {
        Self { of, remaining: Vec::new() }
    }

    fn next(&mut self, random: &mut RandomSequence) -> usize {
        if self.remaining.is_empty() {
            self.remaining = (0..self.of).collect();
            random.shuffle(&mut self.remaining);
        }
        self.remaining.pop().expect("it was filled above")
    }
}

#[cfg(test)]
mod tests {
    use super::super::catalogue::IDS;
    use super::*;
    use fieldgap_virtual_rig::counter_rng::CounterRng;

    const OUTSIDE: [usize; 7] = [0, 2, 3, 5, 8, 11, 12];

    #[test]
    fn all_effects_are_equally_often_and_the_shares_are_kept() {
        let assigned = assign(
            620,
            Shares::default(),
            &IDS,
            &OUTSIDE,
            &mut RandomSequence::new(CounterRng::new(1)),
        );
        let count = |wanted: &dyn Fn(&Assignment) -> bool| {
            assigned.iter().filter(|assignment| wanted(assignment)).count()
        };
        assert_eq!(count(&|a| *a == Assignment::None), 62);
        assert_eq!(count(&|a| matches!(a, Assignment::Unmodelled(_))), 124);
        for id in IDS {
            assert_eq!(count(&|a| *a == Assignment::Effects(vec![id])), 10, "{id}");
        }
        for number in OUTSIDE {
            let times = count(&|a| *a == Assignment::Unmodelled(number));
            assert!(times.abs_diff(124 / OUTSIDE.len()) <= 1, "{number}: {times}");
        }
        assert!(count(&|a| matches!(a, Assignment::Effects(both) if both.len() == 2)) == 124);
        assert_eq!(
            count(&|a| matches!(a, Assignment::Effects(b) if b.len() == 2 && b[0] == b[1])),
            0
        );
    }
}
