//! One planned move: a straight line with a trapezoidal speed profile.

use nalgebra::Vector3;

use fieldgap_input::{Exact, Speed};

/// Speed against time over a given distance, from rest to rest: constant acceleration, constant speed,
/// constant deceleration; without the middle part if the distance is too short to reach full speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    distance_mm: f64,
    acceleration_mm_s2: f64,
    peak_mm_s: f64,
    accelerating_s: f64,
    cruising_s: f64,
}

impl Profile {
    /// The profile over `distance_mm` (not negative) with at most the given acceleration and speed (both positive).
    pub fn new(distance_mm: f64, acceleration_mm_s2: f64, feed_mm_s: f64) -> Self {
        let reachable_mm_s = (acceleration_mm_s2 * distance_mm).sqrt();
        let peak_mm_s = feed_mm_s.min(reachable_mm_s);
        let accelerating_s = peak_mm_s / acceleration_mm_s2;
        let cruising_s = if peak_mm_s > 0.0 {
            ((distance_mm - peak_mm_s * accelerating_s) / peak_mm_s).max(0.0)
        } else {
            0.0
        };
        Self { distance_mm, acceleration_mm_s2, peak_mm_s, accelerating_s, cruising_s }
    }

    /// How long the move takes.
    pub fn duration_s(&self) -> f64 {
        2.0 * self.accelerating_s + self.cruising_s
    }

    /// The distance covered `elapsed_s` after the start; clamped to the ends of the move.
    pub fn travelled_mm(&self, elapsed_s: f64) -> f64 {
        let duration_s = self.duration_s();
        if elapsed_s <= 0.0 {
            0.0
        } else if elapsed_s < self.accelerating_s {
            0.5 * self.acceleration_mm_s2 * elapsed_s * elapsed_s
        } else if elapsed_s < self.accelerating_s + self.cruising_s {
            self.peak_mm_s * (elapsed_s - 0.5 * self.accelerating_s)
        } else if elapsed_s < duration_s {
            let left_s = duration_s - elapsed_s;
            self.distance_mm - 0.5 * self.acceleration_mm_s2 * left_s * left_s
        } else {
            self.distance_mm
        }
    }

    /// The speed `elapsed_s` after the start.
    pub fn speed_mm_s(&self, elapsed_s: f64) -> f64 {
        let left_s = self.duration_s() - elapsed_s;
        (self.acceleration_mm_s2 * elapsed_s.min(left_s).max(0.0)).min(self.peak_mm_s)
    }

    /// When `travelled_mm` is covered: the inverse of [`Profile::travelled_mm`].
    pub fn elapsed_s(&self, travelled_mm: f64) -> f64 {
        let ramp_mm = 0.5 * self.peak_mm_s * self.accelerating_s;
        if travelled_mm <= 0.0 {
            0.0
        } else if travelled_mm < ramp_mm {
            (2.0 * travelled_mm / self.acceleration_mm_s2).sqrt()
        } else if travelled_mm <= self.distance_mm - ramp_mm && self.peak_mm_s > 0.0 {
            travelled_mm / self.peak_mm_s + 0.5 * self.accelerating_s
        } else {
            let left_mm = (self.distance_mm - travelled_mm).max(0.0);
            self.duration_s() - (2.0 * left_mm / self.acceleration_mm_s2).sqrt()
        }
    }
}

/// The speed along a path at which no axis goes faster than it can, mm/s.
pub fn feed_within(path_mm: Vector3<f64>, feed_mm_s: f64, max_feed_mm_s: Exact<Speed, 3>) -> f64 {
    let distance_mm = path_mm.norm();
    (0..3).fold(feed_mm_s, |feed_mm_s, axis| {
        let share = path_mm[axis].abs() / distance_mm;
        let limit_mm_s = max_feed_mm_s[axis].get();
        if share > 0.0 { feed_mm_s.min(limit_mm_s / share) } else { feed_mm_s }
    })
}

/// A straight move of the tool head, with its place in virtual time.
///
/// Each move starts and ends at rest. Real planners carry speed through junctions; a scan that dwells at every
/// point sees no difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedMove {
    from_mm: Vector3<f64>,
    to_mm: Vector3<f64>,
    profile: Profile,
    starts_s: f64,
    ends_s: f64,
}

impl PlannedMove {
    /// A move from `from_mm` to `to_mm` that starts at `starts_s`.
    pub fn new(
        from_mm: Vector3<f64>,
        to_mm: Vector3<f64>,
        acceleration_mm_s2: f64,
        feed_mm_s: f64,
        starts_s: f64,
    ) -> Self {
        let profile = Profile::new((to_mm - from_mm).norm(), acceleration_mm_s2, feed_mm_s);
        Self { from_mm, to_mm, profile, starts_s, ends_s: starts_s + profile.duration_s() }
    }

    /// The position at `time_s`; before the start and after the end, that of the start and the end.
    pub fn position_mm(&self, time_s: f64) -> Vector3<f64> {
        if time_s >= self.ends_s {
            return self.end_mm();
        }
        self.along(self.profile.travelled_mm(time_s - self.starts_s))
    }

    /// The velocity at `time_s`; zero before the start and after the end.
    pub fn velocity_mm_s(&self, time_s: f64) -> Vector3<f64> {
        if time_s <= self.starts_s || time_s >= self.ends_s {
            return Vector3::zeros();
        }
        let direction = (self.to_mm - self.from_mm) / self.profile.distance_mm;
        direction * self.profile.speed_mm_s(time_s - self.starts_s)
    }

    /// The start position.
    pub fn start_mm(&self) -> Vector3<f64> {
        self.from_mm
    }

    /// The end position: the target, unless the move was cut short.
    pub fn end_mm(&self) -> Vector3<f64> {
        self.along(self.profile.travelled_mm(self.ends_s - self.starts_s))
    }

    /// When the move starts.
    pub fn starts_s(&self) -> f64 {
        self.starts_s
    }

    /// When the tool head comes to rest.
    pub fn ends_s(&self) -> f64 {
        self.ends_s
    }

    /// Ends the move at once at `time_s` (an endstop, a quick stop).
    pub fn cut_at(&mut self, time_s: f64) {
        self.ends_s = time_s.clamp(self.starts_s, self.ends_s);
    }

    /// When the tool head has covered the given fraction (0 to 1) of the line.
    pub fn time_at_fraction_s(&self, fraction: f64) -> f64 {
        self.starts_s + self.profile.elapsed_s(fraction * self.profile.distance_mm)
    }

    fn along(&self, travelled_mm: f64) -> Vector3<f64> {
        let distance_mm = self.profile.distance_mm;
        if travelled_mm >= distance_mm {
            self.to_mm
        } else {
            self.from_mm + (self.to_mm - self.from_mm) * (travelled_mm / distance_mm)
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_long_move_takes_the_distance_over_the_feed_plus_one_ramp() {
        let profile = Profile::new(100.0, 1000.0, 80.0);
        assert!((profile.duration_s() - (100.0 / 80.0 + 80.0 / 1000.0)).abs() < 1e-12);
    }

    #[test]
    fn the_slowest_axis_sets_the_speed_of_a_path() {
        let max = [100.0, 100.0, 10.0].map(|mm_s| Speed::new(mm_s).expect("a speed"));
        assert_eq!(feed_within(Vector3::new(5.0, 0.0, 0.0), 80.0, max.into()), 80.0);
        let diagonal = feed_within(Vector3::new(3.0, 0.0, 4.0), 80.0, max.into());
        assert!((diagonal - 12.5).abs() < 1e-12, "z does 10 mm/s: {diagonal}");
    }

    #[test]
    fn a_short_move_never_reaches_its_feed() {
        let profile = Profile::new(2.0, 1000.0, 80.0);
        assert!((profile.duration_s() - 2.0 * (2.0_f64 / 1000.0).sqrt()).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn motion_is_continuous_within_its_line_and_as_long_as_the_closed_form_says(
            distance in 0.0..400.0f64, acceleration in 10.0..5000.0f64, feed in 0.1..500.0f64,
        ) {
            let profile = Profile::new(distance, acceleration, feed);
            let duration = profile.duration_s();
            let closed = if feed * feed >= acceleration * distance {
                2.0 * (distance / acceleration).sqrt()
            } else {
                distance / feed + feed / acceleration
            };
            prop_assert!((duration - closed).abs() <= 1e-9 * (1.0 + closed));
            let steps = 500;
            let mut last = 0.0;
            for i in 0..=steps {
                let now = profile.travelled_mm(duration * f64::from(i) / f64::from(steps));
                prop_assert!(now >= last - 1e-9 && now <= distance + 1e-9);
                let most = feed.min((acceleration * distance).sqrt()) * duration / f64::from(steps);
                prop_assert!(now - last <= most * (1.0 + 1e-6) + 1e-9);
                last = now;
            }
            prop_assert!((last - distance).abs() < 1e-9 * (1.0 + distance));
        }

        #[test]
        fn time_and_distance_are_each_others_inverse(
            distance in 0.01..400.0f64, acceleration in 10.0..5000.0f64, feed in 0.1..500.0f64,
            fraction in 0.0..1.0f64,
        ) {
            let profile = Profile::new(distance, acceleration, feed);
            let there = profile.travelled_mm(profile.elapsed_s(fraction * distance));
            prop_assert!((there - fraction * distance).abs() < 1e-6 * (1.0 + distance));
        }

        #[test]
        fn a_move_stays_on_its_line_and_a_cut_one_stays_where_it_was_cut(
            from in prop::array::uniform3(-200.0..200.0f64), to in prop::array::uniform3(-200.0..200.0f64),
            at in 0.0..1.0f64,
        ) {
            let (from, to) = (Vector3::from(from), Vector3::from(to));
            let mut planned = PlannedMove::new(from, to, 800.0, 60.0, 5.0);
            let time = 5.0 + at * (planned.ends_s() - 5.0);
            let there = planned.position_mm(time);
            let detour = (there - from).norm() + (to - there).norm() - (to - from).norm();
            prop_assert!(detour.abs() < 1e-9 * (1.0 + (to - from).norm()));
            planned.cut_at(time);
            prop_assert!((planned.position_mm(time + 10.0) - there).norm() < 1e-9);
        }
    }
}
