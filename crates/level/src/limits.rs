//! Limits of exposure to airborne ultrasound, and what a level with its uncertainty says of them.

use serde::Serialize;

/// A limit in a band of frequencies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Band {
    /// Lowest frequency, Hz.
    pub from_hz: f64,
    /// Highest frequency, Hz.
    pub to_hz: f64,
    /// Largest level in it, dB re 20 µPa rms.
    pub db: f64,
}

/// A limit of exposure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limit {
    /// Name.
    pub name: String,
    /// Where it comes from.
    pub source: String,
    /// The levels; between the bands there is no limit.
    pub bands: Vec<Band>,
    /// Longest time with the array driven in a day, minutes; `None` if the limit has none.
    pub minutes_a_day: Option<f64>,
}

/// A limit that the program knows, with where its numbers were read.
///
/// The numbers of ACGIH, of IRPA/INIRC (1984) and of Health Canada's Safety Code 24 could not be read in these documents, so that they
/// are not among them: whoever must keep them enters them from the document.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KnownLimit {
    /// The consensus of recommendations for work.
    Howard2004,
    /// The United Kingdom's advice for the public.
    Agnir2010,
}

/// A name that no known limit has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a known limit; known are {names}, and any other is given by `name` and `db`", names = KnownLimit::names())]
pub struct UnknownLimit(String);

/// Edges of the third-octave band about the 25 kHz band's lower and the 50 kHz band's upper end, Hz: 10^4.35 and 10^4.75 (IEC 61260).
const FROM_25_KHZ: f64 = 22_387.0;
const TO_50_KHZ: f64 = 56_234.0;
/// Lower edge of the third-octave band of 20 kHz, Hz: 10^4.25.
const FROM_20_KHZ: f64 = 17_783.0;
/// Ultrasound in air beyond this is not sounded by arrays, Hz. The advice has no upper end.
const NO_END: f64 = 1e7;

impl KnownLimit {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Howard2004, Self::Agnir2010];

    /// The name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Howard2004 => "howard-2004",
            Self::Agnir2010 => "agnir-2010",
        }
    }

    fn names() -> String {
        Self::ALL.map(|known| format!("`{}`", known.id())).join(", ")
    }

    /// The limit of a name.
    ///
    /// # Errors
    /// [`UnknownLimit`]
    pub fn of(id: &str) -> Result<Self, UnknownLimit> {
        Self::ALL
            .into_iter()
            .find(|known| known.id() == id)
            .ok_or_else(|| UnknownLimit(id.to_owned()))
    }

    /// Its numbers.
    pub fn limit(self) -> Limit {
        let (name, source, levels) = match self {
            // 75 dB at 20 kHz, 110 dB at 25, 31.5, 40 and 50 kHz, in third-octave bands.
            Self::Howard2004 => (
                "work, 110 dB at 25 to 50 kHz",
                "consensus of recommendations for work, C. Q. Howard, C. H. Hansen and A. C. Zander, J. Occup. Health Safety - Aust. NZ 21, 253 (2004)",
                [(FROM_20_KHZ, FROM_25_KHZ, 75.0), (FROM_25_KHZ, TO_50_KHZ, 110.0)],
            ),
            // 70 dB at 20 kHz, 100 dB at 25 kHz and above.
            Self::Agnir2010 => (
                "public, 100 dB from 25 kHz",
                "advice for the general public, Advisory Group on Non-ionising Radiation, Health Protection Agency, UK (2010)",
                [(FROM_20_KHZ, FROM_25_KHZ, 70.0), (FROM_25_KHZ, NO_END, 100.0)],
            ),
        };
        Limit {
            name: name.to_owned(),
            source: source.to_owned(),
            bands: levels.map(|(from_hz, to_hz, db)| Band { from_hz, to_hz, db }).to_vec(),
            minutes_a_day: None,
        }
    }
}

/// What a level with its expanded uncertainty says of a limit (as in JCGM 106:2012, with the uncertainty as the guard band).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Standing {
    /// Below, also with the uncertainty added.
    Within,
    /// The level is below, but with its uncertainty it may be above.
    NotShown,
    /// Above.
    Above,
}

impl std::fmt::Display for Standing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Within => "within",
            Self::NotShown => "not shown",
            Self::Above => "ABOVE",
        })
    }
}

impl Limit {
    /// The largest level at a frequency, dB; `None` if the limit has no band there.
    pub fn at_db(&self, frequency_hz: f64) -> Option<f64> {
        let holds = |band: &&Band| (band.from_hz..=band.to_hz).contains(&frequency_hz);
        self.bands.iter().filter(holds).map(|band| band.db).reduce(f64::min)
    }
}

impl Standing {
    /// That of a level with its expanded uncertainty, against the largest level. What is no number is never within.
    pub fn of(level_db: f64, expanded_db: f64, limit_db: f64) -> Self {
        if level_db + expanded_db <= limit_db {
            Self::Within
        } else if level_db <= limit_db {
            Self::NotShown
        } else {
            Self::Above
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_limits_hold_in_their_bands() {
        let at = |known: KnownLimit, khz: f64| known.limit().at_db(khz * 1e3);
        assert_eq!(
            [20.0, 25.0, 40.0, 50.0, 63.0].map(|khz| at(KnownLimit::Howard2004, khz)),
            [Some(75.0), Some(110.0), Some(110.0), Some(110.0), None]
        );
        assert_eq!(
            [16.0, 20.0, 25.0, 40.0, 100.0].map(|khz| at(KnownLimit::Agnir2010, khz)),
            [None, Some(70.0), Some(100.0), Some(100.0), Some(100.0)]
        );
        for known in KnownLimit::ALL {
            assert_eq!(KnownLimit::of(known.id()), Ok(known));
        }
        let unknown = KnownLimit::of("acgih").expect_err("not known");
        assert!(unknown.to_string().contains("`howard-2004`, `agnir-2010`"), "{unknown}");
    }

    #[test]
    fn the_uncertainty_guards_the_limit() {
        assert_eq!(Standing::of(105.0, 3.0, 110.0), Standing::Within);
        assert_eq!(Standing::of(107.0, 3.0, 110.0), Standing::Within);
        assert_eq!(Standing::of(108.0, 3.0, 110.0), Standing::NotShown);
        assert_eq!(Standing::of(110.1, 3.0, 110.0), Standing::Above);
        assert_eq!(Standing::of(f64::NAN, 3.0, 110.0), Standing::Above);
        assert_eq!(Standing::of(90.0, f64::NAN, 110.0), Standing::NotShown);
        assert!(Standing::Above > Standing::NotShown && Standing::NotShown > Standing::Within);
    }
}
