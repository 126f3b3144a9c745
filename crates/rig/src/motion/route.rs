//! A way round what stands between: straight where that is free, else over the top or beside.

use crate::space::RobotPosition;
use crate::travel::{Envelope, PathFault};

/// The places to go to one after the other, the last of them `to`: straight; else z first or last; else by one end of the
/// z axis or the other.
///
/// # Errors
/// What is in the straight way, where none of these is free.
pub fn route(
    envelope: &Envelope,
    from: RobotPosition,
    to: RobotPosition,
) -> Result<Vec<RobotPosition>, PathFault> {
    let blocked = match envelope.check_path(from, to) {
        Ok(()) => return Ok(vec![to]),
        Err(fault) => fault,
    };
    let by_height = |z_m: f64| vec![RobotPosition { z_m, ..from }, RobotPosition { z_m, ..to }, to];
    let (least_m, largest_m) = (envelope.travel.least_m[2], envelope.travel.largest_m[2]);
    [to.z_m, from.z_m, largest_m, least_m]
        .into_iter()
        .map(by_height)
        .find(|places| is_free(envelope, from, places))
        .map(|mut places| {
            places.dedup();
            places.retain(|place| *place != from || *place == to);
            places
        })
        .ok_or(blocked)
}

fn is_free(envelope: &Envelope, mut from: RobotPosition, places: &[RobotPosition]) -> bool {
    places.iter().all(|&place| {
        let free = envelope.check_path(from, place).is_ok();
        from = place;
        free
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::travel::tests::{envelope, mm};

    #[test]
    fn straight_where_it_is_free() {
        let (from, to) = (mm(0.0, 0.0, 100.0), mm(300.0, 300.0, 100.0));
        assert_eq!(route(&envelope(), from, to), Ok(vec![to]));
        assert_eq!(route(&envelope(), from, from), Ok(vec![from]));
    }

    #[test]
    fn it_rises_before_it_crosses_what_is_in_the_way() {
        let places = route(&envelope(), mm(0.0, 150.0, 0.0), mm(150.0, 150.0, 60.0));
        assert_eq!(places, Ok(vec![mm(0.0, 150.0, 60.0), mm(150.0, 150.0, 60.0)]));
    }

    #[test]
    fn between_two_low_places_it_goes_by_the_top() {
        let places = route(&envelope(), mm(50.0, 150.0, 0.0), mm(250.0, 150.0, 0.0));
        let by_the_top = [mm(50.0, 150.0, 250.0), mm(250.0, 150.0, 250.0), mm(250.0, 150.0, 0.0)];
        assert_eq!(places, Ok(by_the_top.to_vec()));
    }

    #[test]
    fn a_place_that_cannot_be_stood_at_has_no_way() {
        let fault = route(&envelope(), mm(0.0, 0.0, 0.0), mm(150.0, 150.0, 20.0));
        assert!(matches!(fault, Err(PathFault::KeepOut { .. })));
        let fault = route(&envelope(), mm(0.0, 0.0, 0.0), mm(150.0, 150.0, 251.0));
        assert!(matches!(fault, Err(PathFault::OutsideTravel { .. })));
    }

    fn place() -> impl Strategy<Value = RobotPosition> {
        (-1i32..=13, -1i32..=13, -1i32..=11)
            .prop_map(|(x, y, z)| mm(f64::from(x) * 25.0, f64::from(y) * 25.0, f64::from(z) * 25.0))
    }

    proptest! {
        #[test]
        fn every_leg_of_a_way_is_allowed_and_the_last_ends_there(from in place(), to in place()) {
            if let Ok(places) = route(&envelope(), from, to) {
                prop_assert!(is_free(&envelope(), from, &places));
                prop_assert_eq!(places.last(), Some(&to));
                prop_assert!(places.len() <= 3);
            }
        }
    }
}
