//! Random parameters of each effect of the catalogue, as a function of its size.
//!
//! Size zero means no effect. The gap grows with the size, where possible in proportion. The simulator's defects (`phase-plane`,
//! `on-axis-unit`) are left out: a real set-up cannot have them.

use std::f64::consts::TAU;

use super::laboratory::Laboratory;
use super::parameters::Parameters;
use super::random_sequence::RandomSequence;
use fieldgap_acoustics::Vec3;

/// The parameters of an effect as a function of its size.
pub(super) enum Sizes {
    /// Any size from zero to the largest physical one.
    Any {
        /// The largest.
        largest: f64,
        /// The smallest: zero, unless a set-up has as much anyway.
        least: f64,
        /// The parameters at a size.
        at: Box<dyn Fn(f64) -> Parameters>,
    },
    /// Several random draws to choose from.
    OneOf(Vec<Parameters>),
}

/// Every id that can be drawn. (A level that settles, `warm-up`, is told as a `gain-drift` with its time constant, and is not drawn.)
pub(super) const IDS: [&str; 38] = [
    "sound-speed",
    "absorption",
    "flow",
    "temperature-gradient",
    "turbulence",
    "spreading",
    "directivity",
    "element-gain",
    "element-phase",
    "dead-elements",
    "polarity",
    "swapped-channels",
    "pitch",
    "array-tilt",
    "phase-quantisation",
    "drive-frequency",
    "offset",
    "rotation",
    "axis-scale",
    "skew",
    "backlash",
    "lag",
    "position-jitter",
    "receiver-directivity",
    "aperture",
    "saturation",
    "noise-floor",
    "clipping",
    "reflection",
    "standing-wave",
    "gain-drift",
    "lead-screw",
    "crosstalk",
    "wall",
    "scatterer",
    "temperature-drift",
    "bowed-array",
    "element-tilt",
];

/// Number of draws from which the nearest to the target gap is taken.
const DRAWS: usize = 6;

/// Steps per period of real drivers: a few bits of delay.
const STEPS: [i64; 8] = [3, 4, 5, 6, 8, 10, 12, 16];

/// Leads of common screws, mm per turn. Leads of 4 mm and less would alias with points 2 mm apart.
const LEADS_MM: [f64; 3] = [5.0, 8.0, 12.0];

/// Radius of the largest sphere in the field, mm: an object as large as a walnut.
const LARGEST_BALL_MM: f64 = 10.0;

/// Draws an effect. `id` is one of [`IDS`].
pub(super) fn draw(id: &str, laboratory: &Laboratory, random: &mut RandomSequence) -> Sizes {
    let count = laboratory.elements().len();
    let (peak_v, speed_m_s) = (laboratory.peak_v, laboratory.speed_m_s);
    let sign = random.sign();
    let angle_rad = random.angle_rad();
    let (sin, cos) = angle_rad.sin_cos();
    let direction = on_sphere(random);
    match id {
        "sound-speed" => any(0.03, move |size| one("c_m_s", speed_m_s * (1.0 + sign * size))),
        "absorption" => any(40.0, |size| one("db_per_m", size)),
        "flow" => any(12.0, move |size| of([("vx_m_s", size * cos), ("vy_m_s", size * sin)])),
        "temperature-gradient" => any(0.3, move |size| {
            let gradient = size * direction;
            of([("gx", gradient.x), ("gy", gradient.y), ("gz", gradient.z)])
        }),
        "turbulence" => any(3.0, |size| one("rad_per_sqrt_m", size)),
        "spreading" => any(1.0, move |size| one("exponent", 1.0 + sign * size)),
        "directivity" => any(0.4, move |size| one("width_ratio", (sign * size).exp())),
        "element-gain" => any(0.4, |size| one("spread", size)),
        "element-phase" => any(1.0, |size| one("spread_rad", size)),
        // An element that leans by more than half a radian has left its board.
        "element-tilt" => any(0.5, |size| one("spread_rad", size)),
        "dead-elements" | "polarity" => one_of(|| {
            // One to three, or up to one in twelve of a larger array.
            let how_many = 1 + random.index((count / 12).max(3));
            elements(&random.distinct(how_many, count))
        }),
        "swapped-channels" => one_of(|| elements(&random.distinct(2, count))),
        "pitch" => any(0.05, move |size| one("ratio", 1.0 + sign * size)),
        "array-tilt" => {
            any(0.12, move |size| of([("about_x_rad", size * cos), ("about_y_rad", size * sin)]))
        }
        "phase-quantisation" => Sizes::OneOf(
            STEPS.iter().map(|&steps| one("steps", toml::Value::Integer(steps))).collect(),
        ),
        "drive-frequency" => any(0.03, move |size| one("ratio", 1.0 + sign * size)),
        "offset" => any(5.0, move |size| {
            let shift_mm = size * direction;
            of([("x_mm", shift_mm.x), ("y_mm", shift_mm.y), ("z_mm", shift_mm.z)])
        }),
        "rotation" | "skew" => any(0.15, move |size| one("rad", sign * size)),
        "axis-scale" => {
            // One axis alone (a wrong motor or belt) as often as all three.
            let alone = Vec3::ith(random.index(3), sign);
            let direction = if random.chance(0.5) { alone } else { direction };
            any(0.06, move |size| {
                let ratio = Vec3::repeat(1.0) + size * direction;
                of([("x", ratio.x), ("y", ratio.y), ("z", ratio.z)])
            })
        }
        "backlash" => any(2.0, |size| one("mm", size)),
        "lag" => any(0.1, |size| one("s", size)),
        // Up to some tenths of a millimetre: the repeatability of good screws is 0.02 mm, that of slack belts 0.3 mm. x and y
        // have equal belts; z has a screw, which repeats better.
        "position-jitter" => {
            let z_over_xy = random.uniform(0.2, 1.0);
            any(0.5, move |size| of([("x_mm", size), ("y_mm", size), ("z_mm", z_over_xy * size)]))
        }
        // The loss is inversely proportional to the square of the angle.
        "receiver-directivity" => any(1.0, |size| one("half_angle_deg", 20.0 / size.sqrt())),
        // The loss is proportional to the square of the radius.
        "aperture" => any(1.0, |size| one("radius_mm", 5.0 * size.sqrt())),
        // The loss is proportional to the square of the ratio of a reading to this level.
        "saturation" => any(1.5, move |size| one("level", peak_v / size.sqrt())),
        // Powers add.
        "noise-floor" => any(0.04, move |size| one("level", peak_v * size.sqrt())),
        "clipping" => any(0.7, move |size| one("level", peak_v * (1.0 - size))),
        "reflection" => {
            // Above the highest reading, up to twice as high.
            let top_mm = laboratory.survey.corners_mm().1.z;
            let height_mm = random.uniform(top_mm + 15.0, 2.0 * top_mm);
            any(0.6, move |size| {
                let mut parameters = complex(size * cos, size * sin);
                parameters.insert("height_mm".to_owned(), height_mm.into());
                parameters
            })
        }
        "standing-wave" => any(0.3, move |size| complex(size * cos, size * sin)),
        "gain-drift" => {
            let over_s = laboratory.survey.lasts_s();
            any(0.4, move |size| of([("relative", sign * size), ("over_s", over_s)]))
        }
        "lead-screw" => {
            let axis = ["x", "y", "z"][random.index(3)];
            let lead_mm = LEADS_MM[random.index(LEADS_MM.len())];
            any(1.5, move |amplitude_mm| {
                let mut parameters = of([
                    ("amplitude_mm", amplitude_mm),
                    ("lead_mm", lead_mm),
                    ("phase_rad", angle_rad),
                ]);
                parameters.insert("axis".to_owned(), axis.into());
                parameters
            })
        }
        "crosstalk" => any(0.25, move |size| complex(size * cos, size * sin)),
        "wall" => {
            // Upright, or leaning by up to 30 degrees, and outside of array and scan: up to 20 cm beyond them.
            let lean = if random.chance(0.5) { 0.0 } else { random.uniform(-0.5, 0.5) };
            let azimuth_rad = random.angle_rad();
            let across = f64::sqrt(1.0 - lean * lean);
            let normal = Vec3::new(across * azimuth_rad.cos(), across * azimuth_rad.sin(), lean);
            let elements = laboratory.elements().elements().iter();
            let places_mm = elements.map(|element| element.centre_m * 1e3);
            let nearest_mm = places_mm
                .chain(laboratory.survey.driven().map(|stop| stop.at_mm))
                .map(|at_mm| at_mm.dot(&normal))
                .fold(f64::NEG_INFINITY, f64::max);
            let distance_mm = nearest_mm + random.uniform(15.0, 200.0);
            let baffle = random.chance(0.3);
            any(1.0, move |size| {
                let mut parameters = complex(size * cos, size * sin);
                parameters.insert("normal".to_owned(), vec![normal.x, normal.y, normal.z].into());
                parameters.insert("distance_mm".to_owned(), distance_mm.into());
                parameters.insert("baffle".to_owned(), baffle.into());
                parameters
            })
        }
        "scatterer" => {
            // Below the lowest reading, where the robot does not hit it, and clear of the elements.
            let low_mm = laboratory.survey.corners_mm().0.z;
            let z_mm = random.uniform(15.0, low_mm - LARGEST_BALL_MM - 4.0);
            let outermost = laboratory.elements().elements().iter();
            let half_mm = outermost.map(|e| e.centre_m.xy().norm() * 1e3).fold(10.0, f64::max);
            let aside_mm = 0.7 * half_mm;
            let (x_mm, y_mm) =
                (random.uniform(-aside_mm, aside_mm), random.uniform(-aside_mm, aside_mm));
            any(LARGEST_BALL_MM, move |radius_mm| {
                of([("x_mm", x_mm), ("y_mm", y_mm), ("z_mm", z_mm), ("radius_mm", radius_mm)])
            })
        }
        // A room warms by some kelvins an hour; a closed box with its amplifiers by some tens.
        "temperature-drift" => any(40.0, move |size| one("k_per_h", sign * size)),
        "bowed-array" => {
            // On a board of 60 mm a sag beyond 2 mm would be visible, and it grows with the square of the width.
            let elements = laboratory.elements().elements().iter();
            let rim_m = elements.map(|e| e.centre_m.xy().norm()).fold(0.02, f64::max);
            let largest_mm = 2.0 * (rim_m / 0.03).powi(2).min(8.0);
            any(largest_mm, move |sagitta_mm| one("sagitta_mm", sign * sagitta_mm))
        }
        _ => unreachable!("{id} is not an id that can be drawn"),
    }
}

fn on_sphere(random: &mut RandomSequence) -> Vec3 {
    let z = random.uniform(-1.0, 1.0);
    let (sin, cos) = random.uniform(0.0, TAU).sin_cos();
    let across = (1.0 - z * z).sqrt();
    Vec3::new(across * cos, across * sin, z)
}

fn any(largest: f64, at: impl Fn(f64) -> Parameters + 'static) -> Sizes {
    Sizes::Any { largest, least: 0.0, at: Box::new(at) }
}

fn one_of(mut drawn: impl FnMut() -> Parameters) -> Sizes {
    Sizes::OneOf((0..DRAWS).map(|_| drawn()).collect())
}

fn one(name: &str, value: impl Into<toml::Value>) -> Parameters {
    Parameters::from_iter([(name.to_owned(), value.into())])
}

fn of<const N: usize>(values: [(&str, f64); N]) -> Parameters {
    values.into_iter().map(|(name, value)| (name.to_owned(), value.into())).collect()
}

fn complex(re: f64, im: f64) -> Parameters {
    one("coefficient", vec![re, im])
}

fn elements(numbers: &[usize]) -> Parameters {
    one("elements", numbers.iter().map(|&number| number as i64).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::super::causes::Causes;
    use super::super::world::World;
    use super::*;
    use fieldgap_virtual_rig::counter_rng::CounterRng;

    #[test]
    fn every_draw_is_valid_and_a_large_one_changes_the_readings() {
        let laboratory = Laboratory::draw(&mut RandomSequence::new(CounterRng::new(2)));
        let chosen: Vec<usize> = (64..2000).step_by(97).collect();
        let none = Causes::none();
        let believed = World::new(&laboratory, &none, 1.0, CounterRng::new(1));
        let levels = |world: &World<'_>| -> Vec<f64> {
            let stops = &laboratory.survey.stops;
            let raw = world.phasors_v(&chosen);
            chosen.iter().zip(raw).map(|(&n, v)| world.noiseless_v(&stops[n], v).norm()).collect()
        };
        for id in IDS {
            for draw_number in 0..3 {
                let mut random = RandomSequence::new(CounterRng::new(draw_number));
                let parameters = match draw(id, &laboratory, &mut random) {
                    Sizes::Any { largest, at, .. } => at(largest),
                    Sizes::OneOf(drawn) => drawn[0].clone(),
                };
                let causes = Causes::of_catalogue(vec![(id, parameters)]);
                let world = World::new(&laboratory, &causes, 1.0, CounterRng::new(1));
                assert_ne!(levels(&world), levels(&believed), "{id}");
            }
        }
    }
}
