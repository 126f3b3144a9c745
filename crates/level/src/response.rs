//! The response of a receiver over the angle of incidence.

/// Why two lists are not a response over angle.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoResponse {
    /// Unequal lengths, or fewer than two.
    #[error(
        "`response_angle_deg` has {angles} angles and `response_db` {levels} levels; give as many of each, at least two"
    )]
    Lengths {
        /// Angles given.
        angles: usize,
        /// Levels given.
        levels: usize,
    },
    /// The angles do not rise from 0 to at most 90 degrees.
    #[error("`response_angle_deg` must begin at 0 and rise to at most 90; {0} does not")]
    Angle(f64),
    /// The response on the axis is not zero.
    #[error("`response_db` is relative to the axis and must begin with 0, not with {0}")]
    OnAxis(f64),
}

/// Response relative to the axis, dB, linear between its angles and constant beyond the last.
#[derive(Debug, Clone, PartialEq)]
pub struct AngularResponse {
    angles_deg: Vec<f64>,
    levels_db: Vec<f64>,
}

impl AngularResponse {
    /// Takes angles from the axis, degrees, rising from 0, and levels relative to the axis, dB.
    ///
    /// # Errors
    /// [`NoResponse`] for the first number that does not fit.
    pub fn new(angles_deg: Vec<f64>, levels_db: Vec<f64>) -> Result<Self, NoResponse> {
        if angles_deg.len() != levels_db.len() || angles_deg.len() < 2 {
            let (angles, levels) = (angles_deg.len(), levels_db.len());
            return Err(NoResponse::Lengths { angles, levels });
        }
        if angles_deg[0] != 0.0 {
            return Err(NoResponse::Angle(angles_deg[0]));
        }
        if let Some(pair) =
            angles_deg.windows(2).find(|pair| !(pair[0] < pair[1] && pair[1] <= 90.0))
        {
            return Err(NoResponse::Angle(pair[1]));
        }
        if levels_db[0] != 0.0 {
            return Err(NoResponse::OnAxis(levels_db[0]));
        }
        Ok(Self { angles_deg, levels_db })
    }

    /// The angles, degrees, and the levels at them, dB.
    pub fn table(&self) -> (&[f64], &[f64]) {
        (&self.angles_deg, &self.levels_db)
    }

    /// Level at an angle from the axis (rad, 0 or above) relative to the axis, dB.
    pub fn at_db(&self, angle_rad: f64) -> f64 {
        let angle_deg = angle_rad.to_degrees();
        let above = self.angles_deg.partition_point(|known| *known <= angle_deg);
        let last = self.angles_deg.len() - 1;
        if above > last {
            return self.levels_db[last];
        }
        let [from, to] =
            [above.saturating_sub(1), above].map(|n| (self.angles_deg[n], self.levels_db[n]));
        let share = ((angle_deg - from.0) / (to.0 - from.0)).max(0.0);
        from.1 + share * (to.1 - from.1)
    }

    /// The largest angle of the table, rad.
    pub fn widest_rad(&self) -> f64 {
        self.angles_deg[self.angles_deg.len() - 1].to_radians()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_response_is_that_of_the_table_and_linear_between() {
        let response =
            AngularResponse::new(vec![0.0, 10.0, 30.0], vec![0.0, -0.5, -2.5]).expect("a table");
        for (deg, db) in
            [(0.0, 0.0), (5.0, -0.25), (10.0, -0.5), (20.0, -1.5), (30.0, -2.5), (80.0, -2.5)]
        {
            assert!((response.at_db(f64::to_radians(deg)) - db).abs() < 1e-9, "{deg}");
        }
    }

    #[test]
    fn what_is_no_table_is_refused() {
        let refused = |angles: &[f64], levels: &[f64]| {
            AngularResponse::new(angles.to_vec(), levels.to_vec()).expect_err("no table")
        };
        assert_eq!(refused(&[0.0], &[0.0]), NoResponse::Lengths { angles: 1, levels: 1 });
        assert_eq!(refused(&[0.0, 5.0], &[0.0]), NoResponse::Lengths { angles: 2, levels: 1 });
        assert_eq!(refused(&[1.0, 5.0], &[0.0, 0.0]), NoResponse::Angle(1.0));
        assert_eq!(refused(&[0.0, 5.0, 5.0], &[0.0; 3]), NoResponse::Angle(5.0));
        assert_eq!(refused(&[0.0, 95.0], &[0.0; 2]), NoResponse::Angle(95.0));
        assert_eq!(refused(&[0.0, 5.0], &[-1.0, 0.0]), NoResponse::OnAxis(-1.0));
    }

    proptest! {
        #[test]
        fn the_response_stays_between_its_levels(levels in prop::collection::vec(-20.0..3.0f64, 2..8), angle in 0.0..1.6f64) {
            let levels: Vec<f64> = std::iter::once(0.0).chain(levels).collect();
            let angles = (0..levels.len()).map(|n| 10.0 * n as f64).collect();
            let (least, most) = levels.iter().fold((0f64, 0f64), |(a, b), db| (a.min(*db), b.max(*db)));
            let db = AngularResponse::new(angles, levels).expect("a table").at_db(angle);
            prop_assert!((least..=most).contains(&db));
        }
    }
}
