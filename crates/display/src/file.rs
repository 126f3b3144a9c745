//! Display files.

use std::num::NonZeroU32;
use std::path::{Path as FilePath, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use super::modulation::Modulation;
use super::path::Path;
use super::timeline::FocusSchedule;
use super::track::{Pace, Swing, Track};
use fieldgap_acoustics::Simulator;
use fieldgap_acoustics::foci::Solver;
use fieldgap_acoustics::radiation::AIR_DENSITY_KG_M3;
use fieldgap_input::{
    Delay, Fault, Finite, Label, Length, NonNegative, OutOfRange, Positive, Rate, Speed, Time,
    TomlSource, literal,
};
use fieldgap_level::{Budget, Kind, Line, usual};

/// A display file.
#[derive(Debug, Clone)]
pub struct DisplayFile {
    /// Name of the display and of its results.
    pub name: String,
    /// The rig file, relative to this one.
    pub rig: PathBuf,
    /// Duration, s; `None`: until it is stopped.
    pub seconds: Option<Time>,
    /// When several foci are driven.
    pub foci: Foci,
    /// Largest step of a focus from frame to frame, mm.
    pub step_mm: Length,
    /// Solver for several simultaneous foci.
    pub solver: Solver,
    /// Most iterations of the solver.
    pub rounds: NonZeroU32,
    /// Modulation; `None`: a continuous wave.
    pub modulation: Option<Modulation>,
    /// The foci, at least one.
    pub focus: Vec<DisplayFocus>,
    /// Level of the elements.
    pub output: Output,
    /// Plane and number of pictures.
    pub picture: Picture,
    source: TomlSource,
}

/// `[[focus]]`: a path and the speed along it.
#[derive(Debug, Clone, PartialEq)]
pub struct DisplayFocus {
    /// The path.
    pub path: Path,
    /// Speed.
    pub pace: Pace,
    /// Sound pressure relative to the other simultaneous foci, above 0.
    pub level: Positive,
}

/// `foci = "together"` or `foci = { alternate_ms = 5.0 }`
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Foci {
    /// All at the same time.
    #[default]
    Together,
    /// One after the other, each for this time, ms.
    AlternateMs(Positive),
}

/// `[output]`: level and directivity of the elements.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Level of one element on its axis 300 mm away, dB re 20 µPa rms. The default is the data sheet's of the thesis's
    /// transducer (Murata MA40S4S: 120 dB at 10 V rms); 20 lg(V/10) more at another voltage.
    pub element_db_at_300_mm: Finite,
    /// Its standard uncertainty, dB; `None` if nobody stated one.
    pub element_u_db: Option<NonNegative>,
    /// Directivity of an element. Path lengths are exact for every simulator, also for `as-written`.
    pub simulator: Simulator,
    /// Density of air, kg/m³.
    pub air_density_kg_m3: Positive,
}

impl Output {
    /// Uncertainty of the level of a focus: that of the element's level, and that of the simulation by the program's own judgement. `None` if the former is
    /// unknown.
    pub fn level_budget(&self) -> Option<Budget> {
        let element = Line::decibels("level of the element", Kind::B, self.element_u_db?.get());
        let simulation = Line::decibels("simulation", Kind::B, usual::SIMULATION_DB);
        Some(Budget::new(vec![element, simulation.assumed_if(true)]))
    }
}

impl Default for Output {
    fn default() -> Self {
        Self {
            element_db_at_300_mm: Finite::new(120.0).expect("a literal"),
            element_u_db: None,
            simulator: Simulator::Piston,
            air_density_kg_m3: Positive::new(AIR_DENSITY_KG_M3).expect("above zero"),
        }
    }
}

/// Most steps of one focus: several times the frames of any controller.
const MOST_STEPS: f64 = 20_000.0;

/// Most foci of a display; with more than the elements of an array nothing is gained.
const MOST_FOCI: usize = 1000;

/// Most iterations of the solver, which converges within tens.
const MOST_ROUNDS: u32 = 10_000;

/// Most points of the plane of a picture: about its number of pixels.
const MOST_POINTS: f64 = 500_000.0;

/// Most pictures of a loop.
const MOST_PICTURES: u32 = 400;

/// `[picture]`: the plane that is drawn, and the number of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "PictureKeys")]
pub struct Picture {
    /// Height of the plane, mm; `None`: initial height of the first focus.
    pub z_mm: Option<Length>,
    /// Side length of the plane, centred on the axis, mm.
    pub size_mm: Length,
    /// Step of the plane, mm.
    pub step_mm: Length,
    /// Most pictures of one loop.
    pub frames: NonZeroU32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct PictureKeys {
    z_mm: Option<Length>,
    size_mm: Length,
    step_mm: Length,
    frames: NonZeroU32,
}

impl Default for PictureKeys {
    fn default() -> Self {
        Self {
            z_mm: None,
            size_mm: literal(80.0),
            step_mm: literal(1.0),
            frames: NonZeroU32::new(40).expect("above zero"),
        }
    }
}

impl Default for Picture {
    fn default() -> Self {
        PictureKeys::default().try_into().expect("the defaults are small")
    }
}

impl TryFrom<PictureKeys> for Picture {
    type Error = String;
    fn try_from(keys: PictureKeys) -> Result<Self, String> {
        let PictureKeys { z_mm, size_mm, step_mm, frames } = keys;
        let points = (size_mm.get() / step_mm.get() + 1.0).powi(2);
        if points > MOST_POINTS {
            return Err(format!(
                "a picture of {points:.3e} points is too fine; choose a larger step_mm for at most {MOST_POINTS} points"
            ));
        }
        if frames.get() > MOST_PICTURES {
            return Err(format!(
                "{frames} pictures of a loop are too many; at most {MOST_PICTURES} are possible"
            ));
        }
        Ok(Self { z_mm, size_mm, step_mm, frames })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DisplayKeys {
    name: Label,
    rig: PathBuf,
    seconds: Option<Time>,
    #[serde(default)]
    foci: Foci,
    #[serde(default = "one")]
    step_mm: Length,
    #[serde(default = "weighted")]
    solver: Solver,
    #[serde(default = "fifty")]
    rounds: Spanned<NonZeroU32>,
    modulation: Option<Spanned<Modulation>>,
    focus: Vec<Spanned<FocusKeys>>,
    #[serde(default)]
    output: Output,
    #[serde(default)]
    picture: Picture,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FocusKeys {
    path: Path,
    speed_mm_s: Option<Speed>,
    loops_per_s: Option<Rate>,
    dwell_ms: Option<Delay>,
    #[serde(default = "one")]
    level: Positive,
}

/// Default of 1: step in mm, or relative level.
fn one<T: TryFrom<f64, Error = OutOfRange>>() -> T {
    literal(1.0)
}

fn weighted() -> Solver {
    Solver::Weighted
}

fn fifty() -> Spanned<NonZeroU32> {
    Spanned::new(0..0, NonZeroU32::new(50).expect("above zero"))
}

impl DisplayFile {
    /// Reads a display file.
    ///
    /// # Errors
    /// A [`Fault`] at the line that is wrong.
    pub fn read(path: &FilePath) -> Result<Self, Fault> {
        Self::parse(TomlSource::read(path)?)
    }

    /// Reads a text as a display file.
    ///
    /// # Errors
    /// As [`DisplayFile::read`].
    pub fn parse(source: TomlSource) -> Result<Self, Fault> {
        let keys: DisplayKeys = source.parse()?;
        if keys.focus.is_empty() {
            let remedy = "add a table [[focus]] with a `path`";
            return Err(Fault::of_file(
                source.path(),
                "a display needs at least one focus",
                remedy,
            ));
        }
        if keys.focus.len() > MOST_FOCI {
            let problem = format!("has {} foci; at most {MOST_FOCI} are allowed", keys.focus.len());
            return Err(Fault::of_file(
                source.path(),
                problem,
                "remove some of the tables [[focus]]",
            ));
        }
        if keys.rounds.get_ref().get() > MOST_ROUNDS {
            let problem = format!("{} is more than {MOST_ROUNDS} rounds", keys.rounds.get_ref());
            return Err(source.fault(
                keys.rounds.span(),
                problem,
                "50 are enough for most displays",
            ));
        }
        let modulation = keys.modulation.as_ref().map(|modulation| *modulation.get_ref());
        let focus = keys
            .focus
            .into_iter()
            .map(|focus| {
                let span = focus.span();
                let focus = focus
                    .into_inner()
                    .section(modulation)
                    .map_err(|(problem, remedy)| source.fault(span.clone(), problem, remedy))?;
                let steps = focus.steps(modulation, keys.step_mm.get() * 1e-3);
                if steps > MOST_STEPS {
                    let problem = format!(
                        "a focus has {steps:.1e} steps in a loop; at most {MOST_STEPS:.0} are possible"
                    );
                    return Err(source.fault(span, problem, "make `step_mm` larger, or the path shorter"));
                }
                Ok(focus)
            })
            .collect::<Result<Vec<_>, Fault>>()?;
        let moves = |section: &DisplayFocus| !section.path.is_still();
        if let (Some(spanned), Some(Modulation::Spatiotemporal(_))) = (keys.modulation, modulation)
            && !focus.iter().any(moves)
        {
            return Err(source.fault(
                spanned.span(),
                "a spatiotemporal modulation needs a moving focus",
                "give a focus a path, or use am, fm, pwm or lateral",
            ));
        }
        Ok(Self {
            name: keys.name.into(),
            rig: keys.rig,
            seconds: keys.seconds,
            foci: keys.foci,
            step_mm: keys.step_mm,
            solver: keys.solver,
            rounds: keys.rounds.into_inner(),
            modulation,
            focus,
            output: keys.output,
            picture: keys.picture,
            source,
        })
    }

    /// Path of the display file.
    pub fn path(&self) -> &FilePath {
        self.source.path()
    }

    /// Path of the rig file that it names.
    pub fn rig_path(&self) -> PathBuf {
        self.path().parent().unwrap_or(FilePath::new("")).join(&self.rig)
    }

    /// The tracks of its foci.
    pub fn tracks(&self) -> Vec<Track> {
        let step_m = self.step_mm.get() * 1e-3;
        self.focus
            .iter()
            .map(|focus| {
                let track = Track::new(&focus.path, focus.pace, step_m);
                match swing(self.modulation) {
                    Some(swing) => track.swinging(swing, step_m),
                    None => track,
                }
            })
            .collect()
    }

    /// When its foci are driven.
    pub fn schedule(&self) -> FocusSchedule {
        match self.foci {
            Foci::Together => FocusSchedule::Together,
            Foci::AlternateMs(alternate_ms) => FocusSchedule::Alternate(alternate_ms.get() * 1e-3),
        }
    }
}

/// The oscillation that a modulation gives each focus.
fn swing(modulation: Option<Modulation>) -> Option<Swing> {
    let Some(Modulation::Lateral(lateral)) = modulation else { return None };
    Some(Swing {
        frequency_hz: lateral.frequency_hz.get(),
        amplitude_m: lateral.amplitude_mm.get() * 1e-3,
        along: lateral.along.unit(),
    })
}

impl DisplayFocus {
    /// How many steps its track has in a loop.
    fn steps(&self, modulation: Option<Modulation>, step_m: f64) -> f64 {
        Track::count(&self.path, self.pace, swing(modulation), step_m)
    }
}

impl FocusKeys {
    /// Returns problem and remedy if the keys contradict each other.
    fn section(
        self,
        modulation: Option<Modulation>,
    ) -> Result<DisplayFocus, (&'static str, &'static str)> {
        let Self { path, speed_mm_s, loops_per_s, dwell_ms, level } = self;
        let dwell_s = dwell_ms.map_or(0.0, |dwell_ms| dwell_ms.get() * 1e-3);
        let timed = speed_mm_s.is_some() || loops_per_s.is_some() || dwell_ms.is_some();
        let has_corners = matches!(path, Path::Line(_) | Path::Polygon(_));
        let pace = match (&path, modulation, speed_mm_s, loops_per_s) {
            (Path::PointMm(_), ..) if timed => {
                return Err((
                    "a fixed focus has no speed and no dwell time",
                    "remove these keys, or choose a path such as `line` or `points_mm`",
                ));
            }
            (Path::PointMm(_), ..) => Pace::Dwell(1.0),
            (_, Some(Modulation::Spatiotemporal(_)), ..) if timed => {
                return Err((
                    "a spatiotemporal modulation sets the speed along the path",
                    "remove `speed_mm_s`, `loops_per_s` and `dwell_ms`",
                ));
            }
            (_, Some(Modulation::Spatiotemporal(spatiotemporal)), ..) => {
                Pace::Rate(spatiotemporal.frequency_hz.get())
            }
            (Path::PointsMm(_), _, None, Some(rate)) if dwell_ms.is_none() => {
                Pace::Rate(rate.get())
            }
            (Path::PointsMm(_), _, None, None) if dwell_s > 0.0 => Pace::Dwell(dwell_s),
            (Path::PointsMm(_), ..) => {
                return Err((
                    "`points_mm` needs either `dwell_ms` above 0 or `loops_per_s`, and no speed",
                    "for example dwell_ms = 100.0",
                ));
            }
            (_, _, Some(speed), None) if dwell_ms.is_none() || has_corners => {
                Pace::Speed { speed_m_s: speed.get() * 1e-3, dwell_s }
            }
            (_, _, None, Some(rate)) if dwell_ms.is_none() => Pace::Rate(rate.get()),
            (_, _, Some(_), Some(_)) => {
                return Err(("both `speed_mm_s` and `loops_per_s` are given", "keep one of them"));
            }
            (_, _, None, None) => {
                return Err((
                    "a path needs `speed_mm_s` or `loops_per_s`",
                    "for example speed_mm_s = 100.0",
                ));
            }
            _ => {
                return Err((
                    "`dwell_ms` is the dwell time at the corners of a line or polygon and needs `speed_mm_s`",
                    "remove it, or add `speed_mm_s`",
                ));
            }
        };
        Ok(DisplayFocus { path, pace, level })
    }
}

#[cfg(test)]
mod tests;
