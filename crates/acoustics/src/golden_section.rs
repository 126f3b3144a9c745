//! Golden-section search, and the golden ratio as a source of evenly spread fractions.

/// The smaller golden ratio, (√5 - 1)/2.
pub const RATIO: f64 = 0.618_033_988_749_894_9;

/// Where a golden-section search ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Minimum {
    /// The interval that holds the minimum, no wider than was asked for.
    pub interval: [f64; 2],
    /// The argument inside the interval with the smaller of the two values computed there.
    pub at: f64,
    /// The function's value at this argument.
    pub value: f64,
}

impl Minimum {
    /// The middle of the interval.
    pub fn middle(&self) -> f64 {
        0.5 * (self.interval[0] + self.interval[1])
    }
}

/// Narrows `interval` about the minimum of `function` until it is no wider than `width`, which is above zero.
///
/// The function must have one minimum in the interval; of several, one is found. Source: J. Kiefer, Proc. AMS 4, 502 (1953).
pub fn minimise(interval: [f64; 2], width: f64, function: impl Fn(f64) -> f64) -> Minimum {
    let [mut low, mut high] = interval;
    let evaluate = |x: f64| (x, function(x));
    let mut inner = [evaluate(high - RATIO * (high - low)), evaluate(low + RATIO * (high - low))];
    while high - low > width {
        if inner[0].1 < inner[1].1 {
            high = inner[1].0;
            inner = [evaluate(high - RATIO * (high - low)), inner[0]];
        } else {
            low = inner[0].0;
            inner = [inner[1], evaluate(low + RATIO * (high - low))];
        }
    }
    let (at, value) = if inner[0].1 < inner[1].1 { inner[0] } else { inner[1] };
    Minimum { interval: [low, high], at, value }
}

/// Width of the interval of logarithms at which a search ends: half a percent of the number.
const LOGARITHM_WIDTH: f64 = 5e-3;

/// The minimum of a function of a positive number: its place, to half a percent, and its value. The global minimum is found if minima
/// are more than a factor of e apart.
pub fn least_positive(from: f64, to: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let (low, high) = around_the_least(from.ln(), to.ln(), |x| f(x.exp()));
    let x = minimise([low, high], LOGARITHM_WIDTH, |x| f(x.exp())).middle();
    (x.exp(), f(x.exp()))
}

/// An interval about the least of values on an even grid with a step of at most one.
fn around_the_least(low: f64, high: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let steps = (high - low).ceil().max(1.0);
    if steps <= 2.0 {
        return (low, high);
    }
    let step = (high - low) / steps;
    let at = |number: usize| low + step * number as f64;
    let costs: Vec<f64> = (0..=steps as usize).map(|number| f(at(number))).collect();
    let best =
        (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).expect("there are some");
    (at(best.saturating_sub(1)), at((best + 1).min(costs.len() - 1)))
}

/// A fraction in [0, 1) for each index: the multiples of the golden ratio without their whole parts.
///
/// Any run of indices spreads its fractions evenly (the three-distance theorem). Items chosen by `even_fraction(index) < share`
/// are therefore spread evenly over all items, and the choice follows no period of a grid.
pub fn even_fraction(index: usize) -> f64 {
    (index as f64 * RATIO).fract()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_minimum_at_an_end_is_found() {
        for (slope, end) in [(1.0, 1.0), (-1.0, 3.0)] {
            let found = minimise([1.0, 3.0], 1e-3, |x| slope * x);
            assert!((found.at - end).abs() < 1e-3, "{found:?}");
        }
    }

    #[test]
    fn the_lower_of_two_minima_is_found_wherever_it_lies() {
        for lowest in [-3.0, -1.0, 1.0, 4.0] {
            let f = |x: f64| {
                let x: f64 = x.ln();
                // Two wells, one of which goes less deep.
                (x - lowest).powi(2).min((x - 2.5).powi(2) + 0.5)
            };
            let (x, cost) = least_positive(1e-2, 1e3, f);
            assert!((x.ln() - lowest).abs() < 5e-3 && cost < 1e-4, "{lowest}: {x} {cost}");
        }
    }

    proptest! {
        #[test]
        fn a_search_finds_the_minimum_of_a_parabola(lowest in 0.0..10.0f64, curvature in 0.1..10.0f64) {
            let found = minimise([0.0, 10.0], 1e-4, |x| curvature * (x - lowest).powi(2) + 2.0);
            prop_assert!((found.at - lowest).abs() < 1e-4, "{:?}", found);
            prop_assert!((found.middle() - lowest).abs() < 1e-4, "{:?}", found);
            prop_assert!(found.interval[1] - found.interval[0] <= 1e-4);
            prop_assert!((found.value - 2.0).abs() < 1e-6);
        }

        #[test]
        fn fractions_are_spread_evenly(first in 0usize..100_000, share in 0.05..0.95f64) {
            let count = 1000;
            let chosen = (first..first + count).filter(|&index| even_fraction(index) < share).count();
            prop_assert!((chosen as f64 / count as f64 - share).abs() < 0.01, "{}", chosen);
        }
    }
}
