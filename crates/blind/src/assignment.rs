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
    /// Three effects of the catalogue.
    Three,
    /// Six to ten small effects of the catalogue, of which one dominates.
    WholeBench,
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
    /// Three effects.
    pub triples: f64,
    /// Six to ten small effects, of which one dominates.
    pub whole_bench: f64,
    /// A cause that is not in the catalogue.
    pub unmodelled: f64,
}

impl Default for Shares {
    fn default() -> Self {
        Self { none: 0.1, pairs: 0.2, triples: 0.0, whole_bench: 0.0, unmodelled: 0.2 }
    }
}

impl Shares {
    /// One effect alone, in every scan.
    pub const SINGLE: Self =
        Self { none: 0.0, pairs: 0.0, triples: 0.0, whole_bench: 0.0, unmodelled: 0.0 };

    /// Those of laboratories by default.
    pub fn of_laboratories() -> Self {
        Self { none: 0.1, pairs: 0.15, triples: 0.1, whole_bench: 0.1, unmodelled: 0.2 }
    }

    /// The sum of all, which leaves the rest to one effect.
    pub fn sum(self) -> f64 {
        self.none + self.pairs + self.triples + self.whole_bench + self.unmodelled
    }
}

/// The causes of one scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Assignment {
    None,
    Effects(Vec<&'static str>),
    /// Many small effects.
    WholeBench,
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
    let (triples, whole) = (of(shares.triples), of(shares.whole_bench));
    let one = count.saturating_sub(none + pairs + triples + whole + unmodelled);
    let mut assignments = vec![Assignment::None; none];
    let mut singles = Rounds::new(ids.len());
    assignments.extend((0..one).map(|_| Assignment::Effects(vec![ids[singles.next(random)]])));
    for (sets, at_once) in [(pairs, 2), (triples, 3)] {
        let mut parts = Rounds::new(ids.len());
        assignments.extend((0..sets).map(|_| {
            let mut together: Vec<usize> = Vec::new();
            while together.len() < at_once {
                let mut next = parts.next(random);
                // Across two rounds the same effect may come twice in a row.
                while together.contains(&next) {
                    next = random.index(ids.len());
                }
                together.push(next);
            }
            together.sort_unstable();
            Assignment::Effects(together.into_iter().map(|number| ids[number]).collect())
        }));
    }
    assignments.extend((0..whole).map(|_| Assignment::WholeBench));
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
        // Half of them have one effect, a fifth two, a fifth one outside the catalogue, a tenth none.
        let scans = 20 * IDS.len();
        let assigned = assign(
            scans,
            Shares::default(),
            &IDS,
            &OUTSIDE,
            &mut RandomSequence::new(CounterRng::new(1)),
        );
        let count = |wanted: &dyn Fn(&Assignment) -> bool| {
            assigned.iter().filter(|assignment| wanted(assignment)).count()
        };
        assert_eq!(count(&|a| *a == Assignment::None), scans / 10);
        assert_eq!(count(&|a| matches!(a, Assignment::Unmodelled(_))), scans / 5);
        for id in IDS {
            assert_eq!(count(&|a| *a == Assignment::Effects(vec![id])), 10, "{id}");
        }
        for number in OUTSIDE {
            let times = count(&|a| *a == Assignment::Unmodelled(number));
            assert!(times.abs_diff(scans / 5 / OUTSIDE.len()) <= 1, "{number}: {times}");
        }
        let pairs = |a: &Assignment| matches!(a, Assignment::Effects(both) if both.len() == 2);
        assert_eq!(count(&pairs), scans / 5);
        assert_eq!(
            count(&|a| matches!(a, Assignment::Effects(b) if b.len() == 2 && b[0] == b[1])),
            0
        );
    }

    #[test]
    fn three_at_once_are_three_different_ones_and_whole_benches_have_their_share() {
        let mut random = RandomSequence::new(CounterRng::new(2));
        let shares = Shares::of_laboratories();
        let assigned = assign(500, shares, &IDS, &OUTSIDE, &mut random);
        let triples = assigned.iter().filter_map(|assignment| match assignment {
            Assignment::Effects(three) if three.len() == 3 => Some(three),
            _ => None,
        });
        let triples: Vec<_> = triples.collect();
        assert_eq!(triples.len(), 50);
        assert!(triples.iter().all(|t| t[0] != t[1] && t[1] != t[2] && t[0] != t[2]));
        let whole = assigned.iter().filter(|assignment| **assignment == Assignment::WholeBench);
        assert_eq!(whole.count(), 50);
    }
}
