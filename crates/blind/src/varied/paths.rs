//! Paths of the robot: planes, lines and volumes, in rows or in random order, in motion or with a stop at each place.

use super::super::random_sequence::RandomSequence;
use super::super::survey::{Stop, Survey, microseconds};
use super::{Size, wavelength_mm};
use fieldgap_acoustics::Vec3;
use fieldgap_records::FocusSection;

/// Products of elements and readings that give the size of a gap: enough for some percent, few enough to try sizes.
const GAP_PATHS: usize = 28_000;

/// Fewest and most readings that give the size of a gap.
const GAP_READINGS: (usize, usize) = (80, 800);

/// Numbers of readings of which one gives the size of a gap. A prime that does not divide a row comes to each of its places.
const ONE_IN: [usize; 16] = [1, 2, 3, 5, 7, 11, 13, 17, 23, 29, 37, 47, 61, 79, 101, 211];

/// Where readings are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Planes,
    OnePlane,
    VerticalPlane,
    Lines,
    Volume,
}

/// In which order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Raster,
    Serpentine,
    Random,
}

/// A path before its places are laid out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Path {
    pub shape: Shape,
    pub order: Order,
    flown: bool,
}

impl Shape {
    pub fn name(self) -> &'static str {
        match self {
            Self::Planes => "planes",
            Self::OnePlane => "single plane",
            Self::VerticalPlane => "vertical plane",
            Self::Lines => "lines",
            Self::Volume => "volume",
        }
    }
}

impl Order {
    pub fn name(self) -> &'static str {
        match self {
            Self::Raster => "raster",
            Self::Serpentine => "serpentine",
            Self::Random => "random",
        }
    }
}

impl Path {
    /// A path on which the effects with these ids can show: a lag needs motion, and play needs both directions along x.
    pub fn draw(ids: &[&'static str], random: &mut RandomSequence) -> Self {
        let turns = ids.iter().any(|id| ["lag", "backlash"].contains(id));
        let part = random.uniform(0.0, 1.0);
        let shape = match part {
            ..0.4 => Shape::Planes,
            ..0.6 => Shape::OnePlane,
            ..0.72 => Shape::VerticalPlane,
            ..0.84 if !turns => Shape::Lines,
            _ => Shape::Volume,
        };
        let order = match random.uniform(0.0, 1.0) {
            ..0.3 if !turns => Order::Raster,
            ..0.5 if !turns => Order::Random,
            _ => Order::Serpentine,
        };
        // A robot that goes to and fro at random stops at each place.
        let flown = (random.chance(0.5) || turns) && order != Order::Random;
        Self { shape, order, flown }
    }

    /// The stops of about so many readings.
    pub fn survey(
        self,
        size: &Size,
        foci: &[FocusSection],
        coded: bool,
        readings: usize,
        elements: usize,
        random: &mut RandomSequence,
    ) -> Survey {
        let dark = if random.chance(0.6) { 8 + random.index(57) } else { 0 };
        let again = if random.chance(0.6) { random.uniform(0.03, 0.08) } else { 0.0 };
        let each = (readings / foci.len()).max(12);
        let mut visits: Vec<(usize, Vec3)> = Vec::new();
        let mut row_length = 1;
        if coded {
            // All drives at each place in turn.
            let rows = self.rows(size, Vec3::new(0.0, 0.0, 1.3 * size.aperture_mm), each, random);
            let places = self.in_order(rows, random);
            row_length = foci.len();
            visits.extend(places.iter().flat_map(|&at| (0..foci.len()).map(move |n| (n, at))));
        } else {
            for (number, focus) in foci.iter().enumerate() {
                let FocusSection::Point(focus_mm) = focus else { continue };
                let rows = self.rows(size, *focus_mm, each, random);
                row_length = rows.first().map_or(1, Vec::len);
                let places = self.in_order(rows, random);
                visits.extend(places.into_iter().map(|at| (number, at)));
            }
        }
        let repeats = (again * visits.len() as f64).ceil() as usize;
        let chosen = random.distinct(repeats, visits.len());
        let repeated: Vec<_> = chosen.into_iter().map(|n| visits[n]).collect();
        visits.extend(repeated);
        let stops = self.timed(dark, &visits, random);
        let wanted = (GAP_PATHS / elements).clamp(GAP_READINGS.0, GAP_READINGS.1);
        let enough = |one_in: usize| visits.len() / one_in <= wanted;
        let even = |one_in: usize| one_in == 1 || !row_length.is_multiple_of(one_in);
        let gap_of_one_in =
            ONE_IN.into_iter().find(|&one_in| enough(one_in) && even(one_in)).unwrap_or(211);
        Survey { stops, flown: self.flown, gap_of_one_in, repeats }
    }

    /// Times of the dark readings, which end before zero, and of the driven ones.
    fn timed(
        self,
        dark: usize,
        visits: &[(usize, Vec3)],
        random: &mut RandomSequence,
    ) -> Vec<Stop> {
        let (reading_s, speed_mm_s) = if self.flown {
            (random.log_uniform(0.02, 0.1), random.uniform(10.0, 50.0))
        } else {
            (random.log_uniform(0.15, 1.5), 80.0)
        };
        let parked = visits.first().map_or(Vec3::zeros(), |visit| visit.1);
        let mut stops: Vec<Stop> = (0..dark)
            .map(|n| Stop {
                time_s: microseconds(reading_s * (n as f64 - dark as f64) - 1.0),
                focus: None,
                at_mm: parked,
            })
            .collect();
        let (mut time_s, mut before_mm): (f64, Option<Vec3>) = (0.0, None);
        for &(focus, at_mm) in visits {
            if let Some(before_mm) = before_mm {
                let way_s = (at_mm - before_mm).norm() / speed_mm_s;
                time_s += if self.flown { way_s.max(reading_s) } else { way_s + reading_s };
            }
            before_mm = Some(at_mm);
            stops.push(Stop { time_s: microseconds(time_s), focus: Some(focus), at_mm });
        }
        stops
    }

    fn in_order(self, mut rows: Vec<Vec<Vec3>>, random: &mut RandomSequence) -> Vec<Vec3> {
        if self.order == Order::Serpentine {
            rows.iter_mut().skip(1).step_by(2).for_each(|row| row.reverse());
        }
        let mut places = rows.concat();
        if self.order == Order::Random {
            random.shuffle(&mut places);
        }
        places
    }

    /// Rows of about so many places around the beam to a focus.
    fn rows(
        self,
        size: &Size,
        focus_mm: Vec3,
        count: usize,
        random: &mut RandomSequence,
    ) -> Vec<Vec<Vec3>> {
        let low_mm = (size.aperture_mm * random.uniform(0.7, 1.1)).max(60.0);
        let high_mm = low_mm * random.uniform(1.6, 2.4);
        let span_mm = size.aperture_mm * random.uniform(0.8, 1.5);
        // Around the axis, or around the focus.
        let centre = if random.chance(0.5) { Vec3::zeros() } else { focus_mm };
        let across = Across { centre, span_mm };
        let heights = |count: usize| -> Vec<f64> {
            let step = (high_mm - low_mm) / (count.max(2) - 1) as f64;
            (0..count).map(|n| tenth(low_mm + step * n as f64)).collect()
        };
        match self.shape {
            Shape::Planes => {
                let planes = 2 + random.index(4).min(count / 16);
                let heights = heights(planes);
                heights.into_iter().flat_map(|z_mm| across.plane(z_mm, count / planes)).collect()
            }
            Shape::OnePlane => across.plane(tenth(random.uniform(low_mm, high_mm)), count),
            Shape::Volume => {
                let layers = ((0.8 * count as f64).cbrt() as usize).max(3);
                let heights = heights(layers);
                heights.into_iter().flat_map(|z_mm| across.plane(z_mm, count / layers)).collect()
            }
            Shape::VerticalPlane => {
                let columns = ((count as f64).sqrt() as usize).max(4);
                let xs = across.places(columns);
                // Along x: only there does play show.
                let y_mm = tenth(centre.y);
                let row =
                    |z_mm: f64| xs.iter().map(|x| Vec3::new(x + centre.x, y_mm, z_mm)).collect();
                heights((count / columns).max(3)).into_iter().map(row).collect()
            }
            Shape::Lines => {
                let lines = 3 + random.index(4);
                let along = (count / lines).max(5);
                let aside_mm = 0.3 * span_mm;
                (0..lines)
                    .map(|line| {
                        let x_mm = tenth(focus_mm.x + random.uniform(-aside_mm, aside_mm));
                        let y_mm = tenth(focus_mm.y + random.uniform(-aside_mm, aside_mm));
                        let z_mm = tenth(random.uniform(low_mm, high_mm));
                        match line % 3 {
                            0 => heights(along)
                                .into_iter()
                                .map(|z_mm| Vec3::new(tenth(focus_mm.x), y_mm, z_mm))
                                .collect(),
                            1 => across
                                .places(along)
                                .into_iter()
                                .map(|x| Vec3::new(x + tenth(centre.x), y_mm, z_mm))
                                .collect(),
                            _ => across
                                .places(along)
                                .into_iter()
                                .map(|y| Vec3::new(x_mm, y + tenth(centre.y), z_mm))
                                .collect(),
                        }
                    })
                    .collect()
            }
        }
    }
}

/// The horizontal extent of a scan.
struct Across {
    centre: Vec3,
    span_mm: f64,
}

impl Across {
    /// So many places along one axis about zero. Steps are at most a wavelength: beyond it a scan shows no field.
    fn places(&self, count: usize) -> Vec<f64> {
        let gaps = (count.max(2) - 1) as f64;
        let step_mm = tenth((self.span_mm / gaps).min(wavelength_mm())).max(0.1);
        (0..count).map(|n| tenth(step_mm * (n as f64 - 0.5 * (count as f64 - 1.0)))).collect()
    }

    fn plane(&self, z_mm: f64, count: usize) -> Vec<Vec<Vec3>> {
        let columns = ((count as f64).sqrt() as usize).max(3);
        let rows = (count / columns).max(3);
        let (x_mm, y_mm) = (tenth(self.centre.x), tenth(self.centre.y));
        let xs = self.places(columns);
        let row = |y: f64| xs.iter().map(|x| Vec3::new(x + x_mm, y + y_mm, z_mm)).collect();
        self.places(rows).into_iter().map(row).collect()
    }
}

/// Rounded to a tenth of a millimetre.
fn tenth(mm: f64) -> f64 {
    (mm * 10.0).round() / 10.0
}
