//! The least value of a function of one positive number, by golden section (J. Kiefer, Proc. AMS 4, 502, 1953).

/// The least value of a function of a positive number and where it stands, over its logarithm, to half a percent. Minima more than a
/// factor of e apart are told from each other.
pub(super) fn least(from: f64, to: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let (low, high) = around_the_least(from.ln(), to.ln(), |x| f(x.exp()));
    by_golden_section(low, high, f)
}

/// What is within a step of the least of values an even step, at most one, apart.
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

fn by_golden_section(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let at = |low: f64, high: f64, share: f64| low + share * (high - low);
    let (mut x1, mut x2) = (at(low, high, 1.0 - GOLDEN), at(low, high, GOLDEN));
    let (mut f1, mut f2) = (f(x1.exp()), f(x2.exp()));
    while high - low > 5e-3 {
        if f1 < f2 {
            (high, x2, f2) = (x2, x1, f1);
            x1 = at(low, high, 1.0 - GOLDEN);
            f1 = f(x1.exp());
        } else {
            (low, x1, f1) = (x1, x2, f2);
            x2 = at(low, high, GOLDEN);
            f2 = f(x2.exp());
        }
    }
    let x = 0.5 * (low + high);
    (x.exp(), f(x.exp()))
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
