//! What each scan of a set is to hold: so many of each category, every cause as often as another, in no order.

use serde::{Deserialize, Serialize};

use super::catalogue::IDS;
use super::dice::Dice;
use super::outside::OUTSIDE;

/// What kind of truth a scan has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Category {
    /// Nothing but noise.
    None,
    /// One effect of the catalogue.
    One,
    /// Two effects of the catalogue.
    Two,
    /// A cause that the catalogue does not have.
    Outside,
}

/// Shares of the categories, 0 to 1; the rest of the scans has one effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// Nothing but noise.
    pub none: f64,
    /// Two effects.
    pub pairs: f64,
    /// Outside the catalogue.
    pub outside: f64,
}

impl Default for Shares {
    fn default() -> Self {
        Self { none: 0.1, pairs: 0.2, outside: 0.2 }
    }
}

/// What one scan is to hold.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Assignment {
    None,
    Effects(Vec<&'static str>),
    /// By its place in [`OUTSIDE`].
    Outside(usize),
}

/// Assigns `count` scans.
pub(super) fn assign(count: usize, shares: Shares, dice: &mut Dice) -> Vec<Assignment> {
    let of = |share: f64| (share * count as f64).round() as usize;
    let (none, pairs, outside) = (of(shares.none), of(shares.pairs), of(shares.outside));
    let one = count.saturating_sub(none + pairs + outside);
    let mut assignments = vec![Assignment::None; none];
    let mut singles = InTurn::new(IDS.len());
    assignments.extend((0..one).map(|_| Assignment::Effects(vec![IDS[singles.next(dice)]])));
    let mut halves = InTurn::new(IDS.len());
    assignments.extend((0..pairs).map(|_| {
        let first = halves.next(dice);
        let mut second = halves.next(dice);
        // Across two rounds the same effect may come twice in a row.
        while second == first {
            second = dice.index(IDS.len());
        }
        let mut both = [first, second];
        both.sort_unstable();
        Assignment::Effects(both.map(|number| IDS[number]).to_vec())
    }));
    let mut strange = InTurn::new(OUTSIDE.len());
    assignments.extend((0..outside).map(|_| Assignment::Outside(strange.next(dice))));
    assignments.truncate(count);
    dice.shuffle(&mut assignments);
    assignments
}

/// Numbers in turn, each once a round, every round in another order.
struct InTurn {
    of: usize,
    left: Vec<usize>,
}

impl InTurn {
    fn new(of: usize) -> Self {
        Self { of, left: Vec::new() }
    }

    fn next(&mut self, dice: &mut Dice) -> usize {
        if self.left.is_empty() {
            self.left = (0..self.of).collect();
            dice.shuffle(&mut self.left);
        }
        self.left.pop().expect("it was filled above")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_virtual_rig::luck::Luck;

    #[test]
    fn every_effect_comes_as_often_as_another_and_the_shares_are_kept() {
        let assigned = assign(620, Shares::default(), &mut Dice::new(Luck::new(1)));
        let count = |wanted: &dyn Fn(&Assignment) -> bool| {
            assigned.iter().filter(|assignment| wanted(assignment)).count()
        };
        assert_eq!(count(&|a| *a == Assignment::None), 62);
        assert_eq!(count(&|a| matches!(a, Assignment::Outside(_))), 124);
        for id in IDS {
            assert_eq!(count(&|a| *a == Assignment::Effects(vec![id])), 10, "{id}");
        }
        for number in 0..OUTSIDE.len() {
            let times = count(&|a| *a == Assignment::Outside(number));
            assert!(times.abs_diff(124 / OUTSIDE.len()) <= 1, "{number}: {times}");
        }
        assert!(count(&|a| matches!(a, Assignment::Effects(both) if both.len() == 2)) == 124);
        assert_eq!(
            count(&|a| matches!(a, Assignment::Effects(b) if b.len() == 2 && b[0] == b[1])),
            0
        );
    }
}
