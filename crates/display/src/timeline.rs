//! The tracks of a display joined into slots of whole carrier periods.

use std::num::NonZeroU32;

use super::error::DisplayError;
use super::track::Track;
use fieldgap_acoustics::Vec3;

/// Largest relative change of a loop duration to make another a multiple of it.
const LARGEST_STRETCH: f64 = 0.01;

/// Carrier periods of the single frame of a display that never changes.
const STILL_PERIODS: u32 = 40;

/// When several foci are driven.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FocusSchedule {
    /// All at the same time.
    Together,
    /// One after the other, each for this time, s.
    Alternate(f64),
}

/// A time interval in which nothing changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Slot {
    /// Duration, carrier periods.
    pub periods: NonZeroU32,
    /// Driven foci and their positions, m; at least one.
    pub foci: Vec<(usize, Vec3)>,
}

/// Joins tracks, at least one, for a carrier.
///
/// The loop is that of the longest track. The other tracks are stretched by at most one percent so that a whole number of
/// their loops fits.
///
/// # Errors
/// [`DisplayError::Incommensurable`] if that is not enough; [`DisplayError::TooShort`] if a loop is shorter than a period;
/// [`DisplayError::TooLong`] if it has more slots than `most`.
pub fn join(
    tracks: &[Track],
    schedule: FocusSchedule,
    carrier_hz: f64,
    most: usize,
) -> Result<Vec<Slot>, DisplayError> {
    let moving = || tracks.iter().enumerate().filter(|(_, track)| !track.is_still());
    let longest_s = moving().map(|(_, track)| track.loop_s()).reduce(f64::max);
    let (loop_s, turn_s) = match (schedule, longest_s) {
        (FocusSchedule::Together, None) => (f64::from(STILL_PERIODS) / carrier_hz, None),
        (FocusSchedule::Together, Some(longest_s)) => (longest_s, None),
        (FocusSchedule::Alternate(turn_s), longest_s) => {
            let round_s = turn_s * tracks.len() as f64;
            let loop_s = longest_s.unwrap_or(round_s).max(round_s);
            let rounds = (loop_s / round_s).round();
            (loop_s, Some(loop_s / rounds / tracks.len() as f64))
        }
    };
    let mut fitted = Vec::with_capacity(tracks.len());
    for (number, track) in tracks.iter().enumerate() {
        let times = (loop_s / track.loop_s()).round().max(1.0);
        let fits_s = loop_s / times;
        if !track.is_still() && (fits_s / track.loop_s() - 1.0).abs() > LARGEST_STRETCH {
            return Err(DisplayError::Incommensurable {
                focus: number,
                loop_s: track.loop_s(),
                longest_s: loop_s,
                would_do_s: fits_s,
            });
        }
        fitted.push(if track.is_still() { track.clone() } else { track.lasting(fits_s) });
    }

    let whole = (loop_s * carrier_hz).round();
    if whole < 1.0 {
        return Err(DisplayError::TooShort { loop_s });
    }
    let changes = changes(&fitted, turn_s, loop_s, carrier_hz, most)?;
    let mut slots: Vec<Slot> = Vec::with_capacity(changes.len());
    for (&begins, ends) in changes.iter().zip(changes.iter().skip(1).copied().chain([whole as u64]))
    {
        let Some(periods) = u32::try_from(ends - begins).ok().and_then(NonZeroU32::new) else {
            continue;
        };
        let middle_s = 0.5 * (begins + ends) as f64 / whole * loop_s;
        let is_driven = |number: usize| {
            turn_s.is_none_or(|turn_s| (middle_s / turn_s) as usize % tracks.len() == number)
        };
        let foci: Vec<(usize, Vec3)> = fitted
            .iter()
            .enumerate()
            .filter(|(number, _)| is_driven(*number))
            .map(|(number, track)| (number, track.at(middle_s)))
            .collect();
        match slots.last_mut() {
            Some(last) if last.foci == foci => {
                last.periods = last.periods.saturating_add(periods.get());
            }
            _ => slots.push(Slot { periods, foci }),
        }
    }
    Ok(slots)
}

/// The carrier periods at which something changes, ascending, from 0.
fn changes(
    tracks: &[Track],
    turn_s: Option<f64>,
    loop_s: f64,
    carrier_hz: f64,
    most: usize,
) -> Result<Vec<u64>, DisplayError> {
    let whole = (loop_s * carrier_hz).round();
    let mut changes = vec![0];
    let mut count = 0;
    let lasting = tracks.iter().filter(|track| !track.is_still());
    for track in lasting {
        let times = (loop_s / track.loop_s()).round() as usize;
        count = times.saturating_mul(track.pieces().len()).saturating_add(count);
        if count > 2 * most {
            return Err(DisplayError::TooLong { frames: count, most });
        }
        let mut at_s = 0.0;
        for piece in std::iter::repeat_n(track.pieces(), times).flatten() {
            at_s += piece.lasts_s;
            changes.push((at_s / loop_s * whole).round() as u64);
        }
    }
    if let Some(turn_s) = turn_s {
        let turns = (loop_s / turn_s).round();
        if turns > 2.0 * most as f64 {
            return Err(DisplayError::TooLong { frames: turns as usize, most });
        }
        changes.extend((1..turns as u64).map(|n| (n as f64 / turns * whole).round() as u64));
    }
    changes.retain(|&period| period < whole as u64);
    changes.sort_unstable();
    changes.dedup();
    if changes.len() > most {
        return Err(DisplayError::TooLong { frames: changes.len(), most });
    }
    Ok(changes)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::path::Path;
    use super::super::track::Pace;
    use super::*;

    fn track(text: &str, pace: Pace) -> Track {
        #[derive(serde::Deserialize)]
        struct File {
            path: Path,
        }
        Track::new(&toml::from_str::<File>(text).expect("valid").path, pace, 1e-3)
    }

    fn circle(radius_mm: f64, rate_hz: f64) -> Track {
        let text = format!("path.circle = {{ centre_mm = [0, 0, 100], radius_mm = {radius_mm} }}");
        track(&text, Pace::Rate(rate_hz))
    }

    fn periods(slots: &[Slot]) -> u64 {
        slots.iter().map(|slot| u64::from(slot.periods.get())).sum()
    }

    proptest! {
        #[test]
        fn loop_durations_are_exact_to_half_a_period(radius in 2.0..20.0f64, rate in 0.5..400.0f64) {
            let slots = join(&[circle(radius, rate)], FocusSchedule::Together, 40e3, 4096).expect("fits");
            prop_assert!((periods(&slots) as f64 - 40e3 / rate).abs() <= 0.5);
            // The focus of a slot is the track's position at the middle of the slot.
            let mut begin = 0.0;
            for slot in &slots {
                let middle_s = (begin + 0.5 * f64::from(slot.periods.get())) / periods(&slots) as f64 / rate;
                let angle = std::f64::consts::TAU * rate * middle_s;
                let truth = Vec3::new(angle.cos(), angle.sin(), 0.0) * radius * 1e-3 + Vec3::new(0.0, 0.0, 0.1);
                // A piece is represented by its centre, at most half a step away; a slot of one period may be longer.
                let a_period = std::f64::consts::TAU * radius * 1e-3 * rate / 40e3;
                prop_assert!((slot.foci[0].1 - truth).norm() <= 0.5e-3 + a_period);
                begin += f64::from(slot.periods.get());
            }
        }
    }

    #[test]
    fn a_fixed_display_has_one_slot() {
        let still = track("path.point_mm = [0, 0, 100]", Pace::Dwell(1.0));
        let other = track("path.point_mm = [20, 0, 100]", Pace::Dwell(1.0));
        let slots = join(&[still, other], FocusSchedule::Together, 40e3, 10).expect("fits");
        assert_eq!(slots.len(), 1);
        assert_eq!(slots[0].foci.len(), 2);
    }

    #[test]
    fn alternating_foci_are_driven_in_turn() {
        let places = [
            "path.point_mm = [0, 0, 100]",
            "path.point_mm = [20, 0, 100]",
            "path.point_mm = [0, 9, 100]",
        ];
        let tracks = places.map(|text| track(text, Pace::Dwell(1.0)));
        let slots = join(&tracks, FocusSchedule::Alternate(2.5e-3), 40e3, 10).expect("fits");
        let driven: Vec<(usize, u32)> =
            slots.iter().map(|slot| (slot.foci[0].0, slot.periods.get())).collect();
        assert_eq!(driven, [(0, 100), (1, 100), (2, 100)]);
        assert!(slots.iter().all(|slot| slot.foci.len() == 1));
        // On paths, foci keep moving while they are not driven.
        let slots = join(
            &[circle(10.0, 1.0), circle(20.0, 1.0)],
            FocusSchedule::Alternate(0.05),
            40e3,
            4096,
        )
        .expect("fits");
        assert_eq!(periods(&slots), 40_000);
        for (number, radius_m) in [(0, 0.01), (1, 0.02)] {
            let share: u64 = slots
                .iter()
                .filter(|slot| slot.foci[0].0 == number)
                .map(|slot| u64::from(slot.periods.get()))
                .sum();
            assert_eq!(share, 20_000, "focus {number}");
            assert!(
                slots.iter().filter(|slot| slot.foci[0].0 == number).all(|slot| (slot.foci[0]
                    .1
                    .xy()
                    .norm()
                    - radius_m)
                    .abs()
                    < 1e-12)
            );
        }
    }

    #[test]
    fn incommensurable_loops_are_refused() {
        assert!(
            join(&[circle(10.0, 1.0), circle(5.0, 2.01)], FocusSchedule::Together, 40e3, 4096)
                .is_ok()
        );
        let refusal =
            join(&[circle(10.0, 1.0), circle(5.0, 1.4)], FocusSchedule::Together, 40e3, 4096);
        insta::assert_snapshot!(refusal.expect_err("1 s and 0.71 s"));
        let refusal = join(&[circle(40.0, 1.0)], FocusSchedule::Together, 40e3, 100);
        insta::assert_snapshot!(refusal.expect_err("252 steps of a millimetre"));
        assert!(matches!(
            join(&[circle(1.0, 1e5)], FocusSchedule::Together, 40e3, 9),
            Err(DisplayError::TooShort { .. })
        ));
    }
}
