//! Places of people and limits of exposure, as rig files and plans state them.

use serde::Deserialize;
use toml::Spanned;

use super::limits::{Band, KnownLimit, Limit};
use fieldgap_input::{
    Exact, Fault, Finite, Frequency, Gap, Label, Place as Coordinate, Time, TomlSource,
};

/// The keys of a place; [`People::read`] checks them.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaceTable {
    name: Label,
    at_mm: Spanned<Exact<Coordinate, 3>>,
    within_mm: Spanned<Gap>,
}

/// The keys of a limit; [`People::read`] checks them.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitTable {
    known: Option<Spanned<String>>,
    name: Option<Label>,
    source: Option<Label>,
    db: Option<Spanned<Finite>>,
    from_hz: Option<Frequency>,
    to_hz: Option<Spanned<Frequency>>,
    minutes_a_day: Option<Time>,
}

/// A place where somebody's ears may be.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Name.
    pub name: String,
    /// Middle, array frame, mm.
    pub at_mm: [f64; 3],
    /// Radius of the ball about it in which the largest level is sought, mm.
    pub within_mm: f64,
}

/// Places of people, and limits of exposure, each with a name of its own.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct People {
    /// The places.
    pub places: Vec<Place>,
    /// The limits.
    pub limits: Vec<Limit>,
}

/// Largest radius of a place, mm: beyond it, the level of a room is meant.
const MOST_WITHIN_MM: f64 = 500.0;

/// Levels that a limit or a data sheet may have, dB: from hardly audible to the sound that would tear the air.
const LEVELS_DB: std::ops::RangeInclusive<f64> = 0.0..=194.0;

impl People {
    /// Checks the places and limits of `source`.
    ///
    /// # Errors
    /// A [`Fault`] at the first key that is missing, superfluous or out of range, or at a name that was given before.
    pub fn read(
        places: &[Spanned<PlaceTable>],
        limits: &[Spanned<LimitTable>],
        source: &TomlSource,
    ) -> Result<Self, Fault> {
        let mut people = Self::default();
        for table in places {
            let place = read_place(table, source)?;
            if people.places.iter().any(|other| other.name == place.name) {
                return Err(twice("place", &place.name, table.span(), source));
            }
            people.places.push(place);
        }
        for table in limits {
            let limit = read_limit(table, source)?;
            if people.limits.iter().any(|other| other.name == limit.name) {
                return Err(twice("limit", &limit.name, table.span(), source));
            }
            people.limits.push(limit);
        }
        Ok(people)
    }

    /// With the places and limits of `others`. Nothing is replaced or taken away, so that a plan from elsewhere cannot loosen what a rig states: of a
    /// limit that both state the fewer minutes a day hold, and whatever differs otherwise is added.
    pub fn with(&self, others: &Self) -> Self {
        let Self { mut places, mut limits } = self.clone();
        for place in &others.places {
            if !places.contains(place) {
                places.push(place.clone());
            }
        }
        for other in &others.limits {
            let same = |one: &&mut Limit| {
                (&one.name, &one.source, &one.bands) == (&other.name, &other.source, &other.bands)
            };
            match limits.iter_mut().find(same) {
                Some(one) => {
                    let both = one.minutes_a_day.into_iter().chain(other.minutes_a_day);
                    one.minutes_a_day = both.reduce(f64::min);
                }
                None => limits.push(other.clone()),
            }
        }
        Self { places, limits }
    }
}

fn twice(what: &str, name: &str, at: std::ops::Range<usize>, source: &TomlSource) -> Fault {
    source.fault(at, format!("there is a {what} `{name}` already"), "give each a name of its own")
}

/// The level of a limit or a data sheet, dB re 20 µPa rms.
///
/// # Errors
/// A [`Fault`] if no sound has it.
pub fn sound_level(db: &Spanned<Finite>, source: &TomlSource) -> Result<f64, Fault> {
    let value = db.get_ref().get();
    if LEVELS_DB.contains(&value) {
        return Ok(value);
    }
    Err(source.fault(
        db.span(),
        format!(
            "{value} dB is not a sound pressure level from {} to {} dB",
            LEVELS_DB.start(),
            LEVELS_DB.end()
        ),
        "give the level re 20 µPa rms",
    ))
}

fn read_place(table: &Spanned<PlaceTable>, source: &TomlSource) -> Result<Place, Fault> {
    let keys = table.get_ref();
    let at_mm = keys.at_mm.get_ref().map(Coordinate::get);
    if at_mm[2] <= 0.0 {
        return Err(source.fault(
            keys.at_mm.span(),
            format!("the place is at z = {} mm, behind the faces of the array", at_mm[2]),
            "the simulation says nothing of the sound behind an array; give a place with z above 0",
        ));
    }
    let within_mm = keys.within_mm.get_ref().get();
    if within_mm > MOST_WITHIN_MM {
        return Err(source.fault(
            keys.within_mm.span(),
            format!("{within_mm} mm is more than {MOST_WITHIN_MM} mm"),
            "state several places",
        ));
    }
    Ok(Place { name: keys.name.clone().into(), at_mm, within_mm })
}

fn read_limit(table: &Spanned<LimitTable>, source: &TomlSource) -> Result<Limit, Fault> {
    let keys = table.get_ref();
    let fault = |problem: &str| {
        source.fault(
            table.span(),
            problem,
            "a limit has `known`, or `name`, `source` and `db`; and perhaps `minutes_a_day`",
        )
    };
    let minutes_a_day = keys.minutes_a_day.map(Time::get);
    if let Some(known) = &keys.known {
        if keys.name.is_some()
            || keys.source.is_some()
            || keys.db.is_some()
            || keys.from_hz.is_some()
            || keys.to_hz.is_some()
        {
            return Err(fault("a known limit has its own name and levels"));
        }
        let found = KnownLimit::of(known.get_ref()).map_err(|unknown| {
            source.fault(known.span(), unknown.to_string(), "docs/levels.md names the documents")
        })?;
        return Ok(Limit { minutes_a_day, ..found.limit() });
    }
    let name = keys.name.clone().ok_or_else(|| fault("the limit has no `name`"))?;
    let of = keys
        .source
        .clone()
        .ok_or_else(|| fault("the limit has no `source`: the document that states it"))?;
    let db = keys.db.as_ref().ok_or_else(|| fault("the limit has no `db`"))?;
    let from_hz = keys.from_hz.map_or(0.0, Frequency::get);
    let to_hz = keys.to_hz.as_ref().map_or(f64::MAX, |to| to.get_ref().get());
    if let Some(to) = keys.to_hz.as_ref().filter(|_| to_hz <= from_hz) {
        return Err(source.fault(
            to.span(),
            "the band ends before it begins",
            "give `to_hz` above `from_hz`",
        ));
    }
    let bands = vec![Band { from_hz, to_hz, db: sound_level(db, source)? }];
    Ok(Limit { name: name.into(), source: of.into(), bands, minutes_a_day })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn people(places: &[(&str, f64)], limits: &[(f64, Option<f64>)]) -> People {
        let place = |&(name, z_mm): &(&str, f64)| Place {
            name: name.to_owned(),
            at_mm: [0.0, 0.0, z_mm],
            within_mm: 0.0,
        };
        let limit = |&(db, minutes_a_day): &(f64, Option<f64>)| Limit {
            name: "house rule".to_owned(),
            source: "a rule".to_owned(),
            bands: vec![Band { from_hz: 0.0, to_hz: 1e6, db }],
            minutes_a_day,
        };
        People {
            places: places.iter().map(place).collect(),
            limits: limits.iter().map(limit).collect(),
        }
    }

    #[test]
    fn others_add_and_tighten_and_never_loosen() {
        let rig = people(&[("head", 400.0)], &[(105.0, Some(60.0)), (100.0, None)]);
        let plan = people(
            &[("visitor", 800.0), ("head", 900.0), ("head", 400.0)],
            &[(190.0, None), (105.0, Some(30.0)), (100.0, Some(10.0))],
        );
        let joined = people(
            &[("head", 400.0), ("visitor", 800.0), ("head", 900.0)],
            &[(105.0, Some(30.0)), (100.0, Some(10.0)), (190.0, None)],
        );
        assert_eq!(rig.with(&plan), joined);
        // Joined once more, as the rounds of a scan do, it stays.
        assert_eq!(joined.with(&plan), joined);
        let looser = people(&[], &[(105.0, Some(600.0)), (100.0, None)]);
        assert_eq!(rig.with(&looser), rig);
        assert_eq!(rig.with(&People::default()), rig);
        assert_eq!(People::default().with(&plan), plan);
    }
}
