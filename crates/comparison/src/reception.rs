//! What a receiver hears of a sound field at a place: by the angles of arrival, its face, its place, and the air.
//!
//! The waves of the elements arrive from different angles. Each is heard by the receiver's response at its angle. The mean pressure over a
//! face is, for a plane wave, the response of a piston; so the sum of the waves with that response is also the averaging over the
//! face where the field is a focus.

use num_complex::Complex64;

use fieldgap_acoustics::transducer::OnAxis;
use fieldgap_acoustics::{Element, FieldKernel, PathLengths, Simulation, Simulator, Vec3};
use fieldgap_level::{Kind, Line, Sensitivity, level_db, usual};
use fieldgap_records::{MediumSection, ScanSetup};

/// The field at a place, wave by wave.
pub struct Reception {
    simulation: Simulation,
    medium: MediumSection,
    phases_rad: Vec<f64>,
    at_m: Vec3,
    /// The wave of each element at the place, and the unit vector along which it travels.
    waves: Vec<(Complex64, Vec3)>,
}

/// How a receiver hears directions.
enum Hearing<'a> {
    Point,
    Response(&'a dyn Fn(f64) -> f64),
    Face(f64),
}

impl Reception {
    /// The field of a drive at a place, array frame, m. The simulators of the thesis, whose laws hold near the array alone, are replaced by
    /// pistons. `None` if there is no such drive, or no sound at the place.
    pub fn at(setup: &ScanSetup, simulator: Simulator, focus: usize, at_m: Vec3) -> Option<Self> {
        let simulator = match simulator {
            Simulator::AsWritten | Simulator::Corrected => Simulator::Piston,
            other => other,
        };
        let simulation = setup.simulation(simulator, focus)?;
        let phases_rad = simulation.excitation.phases_rad(
            &simulation.array,
            &simulation.medium,
            simulation.frequency_hz,
        );
        let mut reception =
            Self { simulation, medium: setup.medium, phases_rad, at_m, waves: Vec::new() };
        let parts = reception.kernel(0.0, 0.0).contributions_at(&[at_m]);
        let along = |element: &Element| (at_m - element.centre_m).normalize();
        let elements = reception.simulation.array.elements();
        reception.waves = parts
            .iter()
            .zip(elements)
            .filter_map(|(part, element)| Some((*part.first()?, along(element))))
            .collect();
        let sound: Complex64 = reception.waves.iter().map(|(wave, _)| wave).sum();
        (sound.norm() > 0.0).then_some(reception)
    }

    /// The kernel in air that is warmer and wetter than stated; drives stay as they were.
    fn kernel(&self, warmer_c: f64, wetter_percent: f64) -> FieldKernel {
        let Simulation { array, frequency_hz, .. } = &self.simulation;
        let air = self.medium.changed(warmer_c, wetter_percent, *frequency_hz);
        FieldKernel::new(
            array,
            &self.phases_rad,
            self.simulation.transducer(),
            air.medium.wavenumber_rad_m(*frequency_hz),
            PathLengths::Observed,
        )
        .with_on_axis(OnAxis::Absorbed {
            amplitude: air.density_ratio,
            attenuation_np_m: air.attenuation_np_m,
        })
    }

    /// Level of the field at a displacement, m, in such air; relative to an unknown source.
    fn field_db(&self, displaced_m: Vec3, warmer_c: f64, wetter_percent: f64) -> f64 {
        let field = self.kernel(warmer_c, wetter_percent).at(&[self.at_m + displaced_m]);
        level_db(field.first().map_or(0.0, |pressure| pressure.norm()))
    }

    /// What a receiver hears over what a point would, dB, with its axis turned by angles about y and x, rad.
    fn heard_by_db(&self, hearing: &Hearing<'_>, [about_y, about_x]: [f64; 2]) -> f64 {
        let axis =
            Vec3::new(about_y.sin() * about_x.cos(), about_x.sin(), about_y.cos() * about_x.cos());
        let wavenumber = self.simulation.medium.wavenumber_rad_m(self.simulation.frequency_hz);
        let (mut heard, mut sound) = (Complex64::ZERO, Complex64::ZERO);
        for (wave, along) in &self.waves {
            let cosine = along.dot(&axis).clamp(-1.0, 1.0);
            let share = match hearing {
                Hearing::Point => 1.0,
                Hearing::Response(response) => response(cosine.acos()),
                Hearing::Face(radius_m) => {
                    piston(wavenumber * radius_m * (1.0 - cosine * cosine).sqrt())
                }
            };
            heard += share * wave;
            sound += wave;
        }
        20.0 * (heard.norm() / sound.norm()).log10()
    }

    /// What a receiver whose axis is that of the array hears over what a point would, dB.
    pub fn heard_db(&self, sensitivity: &Sensitivity) -> f64 {
        with_hearing(sensitivity, |hearing| self.heard_by_db(hearing, [0.0; 2]))
    }

    /// The sources of uncertainty that depend on the field.
    pub fn lines(&self, sensitivity: &Sensitivity) -> Vec<Line> {
        let stated = sensitivity.uncertainties();
        let mut lines = Vec::new();
        if let Some((_, u_db)) = sensitivity.response() {
            lines.push(Line::decibels("response over angle", Kind::B, u_db));
        }
        if let Some([radius_m, u_m]) = sensitivity.face_m() {
            let heard = |by_mm: f64| {
                let face = Hearing::Face((radius_m + by_mm * 1e-3).max(0.0));
                self.heard_by_db(&face, [0.0; 2])
            };
            lines.push(Line::of_model("averaging over the face", Kind::B, u_m * 1e3, "mm", heard));
        }
        let (u_rad, assumed) = or_usual(stated.tilt_rad, usual::TILT_RAD);
        let tilts = with_hearing(sensitivity, |hearing| {
            let about = |turned: fn(f64) -> [f64; 2]| {
                Line::of_model("", Kind::B, u_rad.to_degrees(), "°", |deg| {
                    self.heard_by_db(hearing, turned(deg.to_radians()))
                })
            };
            [about(|y| [y, 0.0]), about(|x| [0.0, x])]
        });
        let is_point = sensitivity.response().is_none() && sensitivity.face_m().is_none();
        let tilt = Line::joined("angle of incidence", &tilts).filter(|_| !is_point);
        lines.extend(tilt.map(|tilt| tilt.assumed_if(assumed)));
        let (u_m, assumed) = or_usual(stated.place_m, usual::PLACE_M);
        let along = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| {
            Line::of_model("", Kind::B, u_m * 1e3, "mm", |mm| {
                self.field_db(axis * mm * 1e-3, 0.0, 0.0)
            })
        });
        lines.extend(Line::joined("place", &along).map(|place| place.assumed_if(assumed)));
        let (u, assumed) = or_usual(stated.temperature_c, usual::TEMPERATURE_C);
        let warmer = |by_c: f64| self.field_db(Vec3::zeros(), by_c, 0.0);
        lines.push(
            Line::of_model("temperature of the air", Kind::B, u, "°C", warmer).assumed_if(assumed),
        );
        let (u, assumed) = or_usual(stated.humidity_percent, usual::HUMIDITY_PERCENT);
        let wetter = |percent: f64| self.field_db(Vec3::zeros(), 0.0, percent);
        lines
            .push(Line::of_model("relative humidity", Kind::B, u, "%", wetter).assumed_if(assumed));
        lines
    }
}

/// An uncertainty that was stated, or the usual one, and whether it is the latter.
fn or_usual(stated: Option<f64>, taken: f64) -> (f64, bool) {
    (stated.unwrap_or(taken), stated.is_none())
}

fn with_hearing<T>(sensitivity: &Sensitivity, of: impl FnOnce(&Hearing<'_>) -> T) -> T {
    match (sensitivity.response(), sensitivity.face_m()) {
        (Some((response, _)), _) => {
            of(&Hearing::Response(&|angle_rad| 10f64.powf(response.at_db(angle_rad) / 20.0)))
        }
        (None, Some([radius_m, _])) => of(&Hearing::Face(radius_m)),
        (None, None) => of(&Hearing::Point),
    }
}

/// Mean of a plane wave over a disc: 2 J1(x)/x, x = k b sin θ.
fn piston(x: f64) -> f64 {
    if x < 1e-6 { 1.0 } else { 2.0 * libm::j1(x) / x }
}

#[cfg(test)]
mod tests;
