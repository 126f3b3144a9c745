//! The stops of a scan: reported positions, times and foci.

use super::random_sequence::RandomSequence;
use fieldgap_acoustics::Vec3;

/// Time from one reading to the next, s.
const POINT_S: f64 = 0.11;
/// Time of the first dark reading, s. The first driven one is at zero.
const DARK_BEGINS_S: f64 = -8.0;
/// Number of dark readings before the array is driven.
const DARK: usize = 64;
/// Number of repeats at the end, which give the noise.
const REPEATS: usize = 240;
/// Points in a row, and rows in a plane.
const SIDE: usize = 36;
/// Step between points and between rows, mm.
const STEP_MM: f64 = 2.0;
/// Heights scanned with the first focus, mm. The simulators assume the far field of an element, which is right to a tenth of the
/// noise there. (At 50 mm its error is 0.3 % and more, which five thousand readings show.)
const HEIGHTS_MM: [f64; 4] = [80.0, 120.0, 160.0, 200.0];
/// Heights scanned with the second focus, mm.
const HEIGHTS_OF_SECOND_MM: [f64; 2] = [120.0, 160.0];

/// One reading to take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stop {
    /// Time, s.
    pub time_s: f64,
    /// The driven focus; `None`: dark.
    pub focus: Option<usize>,
    /// Reported position, mm.
    pub at_mm: Vec3,
}

/// A whole scan's stops, in the order of time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Survey {
    /// The stops.
    pub stops: Vec<Stop>,
    /// Whether the robot goes on while it reads; if not, it has come to rest at every stop.
    pub flown: bool,
    /// Of the driven readings one in this number gives the size of a gap.
    pub gap_of_one_in: usize,
    /// How many stops at the end repeat earlier ones.
    pub repeats: usize,
}

/// Readings of a plane at least, in the mean: a scan that changes its height more often has no planes.
const LEAST_OF_PLANE: usize = 16;

/// Of the driven readings of the bench one in this number is used. It gives the gap to some percent, and includes every height and row.
const ONE_IN: usize = 7;

impl Survey {
    /// Dark readings first, then plane by plane in serpentine rows, then the repeats.
    pub fn new(foci: usize, random: &mut RandomSequence) -> Self {
        let mut places = Vec::new();
        for focus in 0..foci {
            let heights_mm = if focus == 0 { &HEIGHTS_MM[..] } else { &HEIGHTS_OF_SECOND_MM[..] };
            for &z_mm in heights_mm {
                places.extend(plane(z_mm).map(|at_mm| (focus, at_mm)));
            }
        }
        let again: Vec<_> =
            random.distinct(REPEATS, places.len()).into_iter().map(|n| places[n]).collect();
        places.extend(again);
        let dark = (0..DARK).map(|n| Stop {
            time_s: microseconds(DARK_BEGINS_S + POINT_S * n as f64),
            focus: None,
            at_mm: Vec3::new(0.0, 0.0, 150.0),
        });
        let driven = places.into_iter().enumerate().map(|(n, (focus, at_mm))| Stop {
            time_s: microseconds(POINT_S * n as f64),
            focus: Some(focus),
            at_mm,
        });
        Self {
            stops: dark.chain(driven).collect(),
            flown: true,
            gap_of_one_in: ONE_IN,
            repeats: REPEATS,
        }
    }

    /// The driven stops.
    pub fn driven(&self) -> impl Iterator<Item = &Stop> {
        self.stops.iter().filter(|stop| stop.focus.is_some())
    }

    /// Lowest and highest corner of the box that the driven stops fill, mm.
    pub fn corners_mm(&self) -> (Vec3, Vec3) {
        let none = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        self.driven().fold(none, |(low, high), stop| (low.inf(&stop.at_mm), high.sup(&stop.at_mm)))
    }

    /// The time from the first driven reading to the last, s.
    pub fn lasts_s(&self) -> f64 {
        self.stops.last().map_or(0.0, |stop| stop.time_s)
    }

    /// Start of each plane, s, in order of time: the height or the drive is another from there on. Nothing of a scan
    /// without planes; the repeats are left out.
    pub fn planes_begin_s(&self) -> Vec<f64> {
        let planned = self.driven().count().saturating_sub(self.repeats);
        let mut begun = Vec::new();
        let mut before = None;
        for stop in self.driven().take(planned) {
            let plane = (stop.focus, stop.at_mm.z);
            if before != Some(plane) {
                begun.push(stop.time_s);
            }
            before = Some(plane);
        }
        if planned / begun.len().max(1) < LEAST_OF_PLANE { Vec::new() } else { begun }
    }
}

fn plane(z_mm: f64) -> impl Iterator<Item = Vec3> {
    let along = |n: usize| STEP_MM * (n as f64 - (SIDE as f64 - 1.0) / 2.0);
    (0..SIDE).flat_map(move |row| {
        (0..SIDE).map(move |n| {
            let column = if row % 2 == 0 { n } else { SIDE - 1 - n };
            Vec3::new(along(column), along(row), z_mm)
        })
    })
}

/// Rounded to whole microseconds, so that times are written without long decimals.
pub(super) fn microseconds(time_s: f64) -> f64 {
    (time_s * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_virtual_rig::counter_rng::CounterRng;

    fn survey(foci: usize) -> Survey {
        Survey::new(foci, &mut RandomSequence::new(CounterRng::new(1)))
    }

    #[test]
    fn rows_are_serpentine_and_time_increases() {
        let stops = survey(1).stops;
        assert_eq!(stops.len(), 64 + 4 * 1296 + 240);
        assert!(stops.windows(2).all(|pair| pair[1].time_s > pair[0].time_s));
        let driven = &stops[64..];
        assert_eq!(driven[0].at_mm, Vec3::new(-35.0, -35.0, 80.0));
        assert_eq!(driven[35].at_mm, Vec3::new(35.0, -35.0, 80.0));
        assert_eq!(driven[36].at_mm, Vec3::new(35.0, -33.0, 80.0));
        assert_eq!(driven[71].at_mm, Vec3::new(-35.0, -33.0, 80.0));
        assert_eq!(driven[0].time_s, 0.0);
    }

    #[test]
    fn a_second_focus_has_two_planes_and_repeats_are_of_visited_positions() {
        let survey = survey(2);
        let begins_s = survey.planes_begin_s();
        let at = |time_s: f64| survey.driven().find(|stop| stop.time_s == time_s);
        let heights: Vec<f64> =
            begins_s.iter().filter_map(|&time_s| Some(at(time_s)?.at_mm.z)).collect();
        assert_eq!(heights, [80.0, 120.0, 160.0, 200.0, 120.0, 160.0]);
        let driven = &survey.stops[64..];
        let (first, again) = driven.split_at(6 * 1296);
        assert!(again.iter().all(|stop| {
            first.iter().any(|other| (other.focus, other.at_mm) == (stop.focus, stop.at_mm))
        }));
    }
}
