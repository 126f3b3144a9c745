//! Synthetic passages without physics: a bump that reaches one side before the other.

use proptest::prelude::*;

use super::*;

const RATE_HZ: f64 = 250.0;

/// Pseudo-random noise with a standard deviation of about 1.
fn noise_at(n: u64, channel: u64) -> f64 {
    let mut bits =
        n.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ channel.wrapping_mul(0xd1b5_4a32_d192_ed03);
    (0..4)
        .map(|_| {
            bits ^= bits >> 33;
            bits = bits.wrapping_mul(0xff51_afd7_ed55_8ccd);
            bits ^= bits >> 29;
            (bits >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        })
        .sum::<f64>()
        * 3f64.sqrt()
}

/// Swipes detected in 1.5 s of rest, a bump on each side with the lag `lag_s`, and another 1.5 s of rest.
fn swipes(lag_s: f64, width_s: f64, heights: [f64; 4], noise: f64) -> Vec<Swipe> {
    let mut detector = SwipeDetector::new(RATE_HZ);
    let duration_s = 3.0 + 6.0 * width_s + lag_s.abs();
    (0..(duration_s * RATE_HZ) as u64)
        .filter_map(|n| {
            let time_s = n as f64 / RATE_HZ;
            let middle_s = 1.5 + 3.0 * width_s;
            let bump = |at_s: f64| (-((time_s - at_s) / width_s).powi(2)).exp();
            let volts = std::array::from_fn(|channel| {
                let side = if channel < 2 { -0.5 } else { 0.5 };
                0.3 + heights[channel] * bump(middle_s + side * lag_s)
                    + noise * noise_at(n, channel as u64)
            });
            detector.take(time_s, volts)
        })
        .collect()
}

proptest! {
    #[test]
    fn the_side_that_changes_first_gives_the_direction(
        width_s in 0.06..0.8f64, share in 0.2..0.9f64, rightwards: bool,
        heights in prop::array::uniform4(prop_oneof![-0.2..-0.05f64, 0.05..0.4f64]),
    ) {
        let lag_s = if rightwards { share } else { -share } * width_s;
        let found = swipes(lag_s, width_s, heights, 1e-3);
        prop_assert_eq!(found.len(), 1, "{:?}", found);
        let direction = if rightwards { Direction::Right } else { Direction::Left };
        prop_assert_eq!(found[0].direction, direction);
        prop_assert!((found[0].lag_s - lag_s.abs()).abs() < 0.25 * lag_s.abs() + 0.01, "{:?} {}", found, lag_s);
    }

    #[test]
    fn any_readings_are_accepted(readings in prop::collection::vec(prop::array::uniform4(any::<f64>()), 0..600)) {
        let mut detector = SwipeDetector::new(RATE_HZ);
        for (n, volts) in readings.into_iter().enumerate() {
            detector.take(n as f64 / RATE_HZ, volts);
        }
    }
}

#[test]
fn a_change_on_both_sides_at_once_is_no_swipe() {
    assert_eq!(swipes(0.0, 0.3, [0.2, 0.1, 0.15, 0.2], 1e-3), []);
}

#[test]
fn a_change_on_one_side_only_is_no_swipe() {
    assert_eq!(swipes(0.1, 0.3, [0.2, 0.1, 0.0, 0.0], 1e-3), []);
}

#[test]
fn noise_alone_is_no_swipe() {
    let mut detector = SwipeDetector::new(RATE_HZ);
    let swipes = (0..500_000u64).filter_map(|n| {
        let volts = std::array::from_fn(|channel| 0.3 + 0.01 * noise_at(n, channel as u64));
        detector.take(n as f64 / RATE_HZ, volts)
    });
    assert_eq!(swipes.count(), 0, "in 2000 s");
}
