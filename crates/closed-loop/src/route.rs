//! The order of the readings of a round: a short way past all places.
//!
//! From each place to the nearest that is left, then shortened by reversing stretches (2-opt: G. A. Croes, Oper. Res. 6, 791, 1958). Ways
//! that are not free count as longer than any other; a place that no free way reaches is left out.

use fieldgap_acoustics::Vec3;

/// Time that stands for a way that is not free, s: longer than any route.
const BLOCKED_S: f64 = 1e6;

/// Rounds of shortening at most: the gain of a further one is below a percent.
const ROUNDS: usize = 8;

/// Indices of `places_m` in the order of a short way from `start_m`, and none that only a blocked way reaches. `seconds` gives the time of
/// a way, `None` if it is not free.
pub fn route(
    start_m: Vec3,
    places_m: &[Vec3],
    seconds: impl Fn(Vec3, Vec3) -> Option<f64>,
) -> Vec<usize> {
    let cost = |from_m: Vec3, to_m: Vec3| seconds(from_m, to_m).unwrap_or(BLOCKED_S);
    let mut left: Vec<usize> = (0..places_m.len()).collect();
    let mut order = Vec::with_capacity(left.len());
    let mut at_m = start_m;
    while !left.is_empty() {
        let nearest = (0..left.len())
            .min_by(|&a, &b| {
                let [a, b] = [a, b].map(|index| cost(at_m, places_m[left[index]]));
                a.total_cmp(&b)
            })
            .expect("some are left");
        let next = left.remove(nearest);
        at_m = places_m[next];
        order.push(next);
    }
    shorten(start_m, places_m, &mut order, &cost);
    let mut at_m = start_m;
    order.retain(|&index| {
        let reached = seconds(at_m, places_m[index]).is_some();
        if reached {
            at_m = places_m[index];
        }
        reached
    });
    order
}

fn shorten(
    start_m: Vec3,
    places_m: &[Vec3],
    order: &mut [usize],
    cost: &impl Fn(Vec3, Vec3) -> f64,
) {
    let n = order.len();
    for _ in 0..ROUNDS {
        let mut shorter = false;
        for i in 0..n {
            let before_m = if i == 0 { start_m } else { places_m[order[i - 1]] };
            for j in i + 1..n {
                let (first_m, last_m) = (places_m[order[i]], places_m[order[j]]);
                let mut gained = cost(before_m, first_m) - cost(before_m, last_m);
                if let Some(&after) = order.get(j + 1) {
                    gained += cost(last_m, places_m[after]) - cost(first_m, places_m[after]);
                }
                if gained > 1e-9 {
                    order[i..=j].reverse();
                    shorter = true;
                }
            }
        }
        if !shorter {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn length_m(start_m: Vec3, places_m: &[Vec3], order: &[usize]) -> f64 {
        let mut at_m = start_m;
        let ways = order.iter().map(|&index| {
            let way = (places_m[index] - at_m).norm();
            at_m = places_m[index];
            way
        });
        ways.sum()
    }

    #[test]
    fn places_on_a_line_are_passed_in_order() {
        let places_m: Vec<Vec3> =
            [5, 1, 4, 2, 3].map(|x| Vec3::new(f64::from(x), 0.0, 0.0)).to_vec();
        let order = route(Vec3::zeros(), &places_m, |a, b| Some((a - b).norm()));
        assert_eq!(order, [1, 3, 4, 2, 0]);
    }

    #[test]
    fn a_place_behind_a_wall_is_left_out() {
        let places_m = [Vec3::x(), Vec3::new(3.0, 0.0, 0.0), Vec3::new(1.5, 0.0, 0.0)];
        let free = |a: Vec3, b: Vec3| ((a.x < 2.0) == (b.x < 2.0)).then(|| (a - b).norm());
        assert_eq!(route(Vec3::zeros(), &places_m, free), [0, 2]);
    }

    proptest::proptest! {
        #[test]
        fn every_place_is_passed_once_on_a_way_no_longer_than_as_given(
            places in proptest::collection::vec((-50.0..50.0, -50.0..50.0, 50.0..150.0), 1..40),
        ) {
            let places_m: Vec<Vec3> = places.into_iter().map(|(x, y, z)| Vec3::new(x, y, z)).collect();
            let order = route(Vec3::zeros(), &places_m, |a, b| Some((a - b).norm()));
            let mut sorted = order.clone();
            sorted.sort_unstable();
            proptest::prop_assert_eq!(sorted, (0..places_m.len()).collect::<Vec<_>>());
            let as_given: Vec<usize> = (0..places_m.len()).collect();
            let [short, long] = [&order, &as_given].map(|order| length_m(Vec3::zeros(), &places_m, order));
            proptest::prop_assert!(short <= long + 1e-9);
            // No stretch is shorter backwards.
            for i in 0..order.len() {
                for j in i + 1..order.len() {
                    let mut other = order.clone();
                    other[i..=j].reverse();
                    let other = length_m(Vec3::zeros(), &places_m, &other);
                    proptest::prop_assert!(short <= other + 1e-6, "{short} {other}");
                }
            }
        }
    }
}
