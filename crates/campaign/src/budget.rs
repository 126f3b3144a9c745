//! `[budget]`: what a campaign may use.

use serde::{Deserialize, Serialize};

use fieldgap_input::Positive;

/// The most that a campaign may use; without a key there is no limit.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// Time since the campaign began, h.
    pub hours: Option<Positive>,
    /// Time with the array driven, min, over all rigs.
    pub emitting_min: Option<Positive>,
    /// Path length of all robots, m.
    pub way_m: Option<Positive>,
}

/// What was used, or what a cell is going to use.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Use {
    /// Time, s.
    pub time_s: f64,
    /// Time with the array driven, s.
    pub emitting_s: f64,
    /// Path length, m.
    pub way_m: f64,
}

impl std::ops::Add for Use {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            time_s: self.time_s + other.time_s,
            emitting_s: self.emitting_s + other.emitting_s,
            way_m: self.way_m + other.way_m,
        }
    }
}

impl Budget {
    /// What would exceed the budget after `next`, in words; `None` if nothing would.
    pub fn refuses(&self, used: Use, next: Use) -> Option<String> {
        let after = used + next;
        let parts = [
            (self.hours, after.time_s / 3600.0, used.time_s / 3600.0, "h since the beginning"),
            (
                self.emitting_min,
                after.emitting_s / 60.0,
                used.emitting_s / 60.0,
                "min with the array driven",
            ),
            (self.way_m, after.way_m, used.way_m, "m of robot path"),
        ];
        let exceeded = parts.into_iter().find_map(|(limit, after, used, unit)| {
            let limit = limit?.get();
            (after > limit).then_some((limit, used, unit))
        });
        exceeded.map(|(limit, used, unit)| {
            format!("the budget of {limit} {unit} does not suffice for the next cell ({used:.1} are used)")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_that_would_exceed_the_budget_is_refused() {
        let budget: Budget = toml::from_str("emitting_min = 10\nway_m = 5.0").expect("TOML");
        let used = Use { time_s: 1e6, emitting_s: 570.0, way_m: 1.0 };
        assert_eq!(budget.refuses(used, Use { emitting_s: 30.0, ..Use::default() }), None);
        let reason =
            budget.refuses(used, Use { emitting_s: 31.0, ..Use::default() }).expect("refused");
        assert_eq!(
            reason,
            "the budget of 10 min with the array driven does not suffice for the next cell (9.5 are used)"
        );
        assert!(budget.refuses(used, Use { way_m: 4.1, ..Use::default() }).is_some());
        assert_eq!(Budget::default().refuses(used, used), None);
    }
}
