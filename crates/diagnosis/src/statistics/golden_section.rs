//! The minimum of a function of one positive number, by golden section over its logarithm.

use fieldgap_acoustics::golden_section;

/// Width of the interval of logarithms at which a search ends: half a percent of the number.
const LOGARITHM_WIDTH: f64 = 5e-3;

/// The minimum of a function of a positive number: its place, to half a percent, and its value. The global minimum is found if minima
/// are more than a factor of e apart.
pub(crate) fn least(from: f64, to: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let (low, high) = around_the_least(from.ln(), to.ln(), |x| f(x.exp()));
    let x = golden_section::minimise([low, high], LOGARITHM_WIDTH, |x| f(x.exp())).middle();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lower_of_two_minima_is_found_wherever_it_lies() {
        for lowest in [-3.0, -1.0, 1.0, 4.0] {
            let f = |x: f64| {
                let x: f64 = x.ln();
                // Two wells, one of which goes less deep.
                (x - lowest).powi(2).min((x - 2.5).powi(2) + 0.5)
            };
            let (x, cost) = least(1e-2, 1e3, f);
            assert!((x.ln() - lowest).abs() < 5e-3 && cost < 1e-4, "{lowest}: {x} {cost}");
        }
    }
}
