//! `[exposure]`: places of people, limits, and the level of the array's elements.

use std::path::PathBuf;

use serde::Deserialize;
use toml::Spanned;

use super::source::DataSheet;
use fieldgap_acoustics::Vec3;
use fieldgap_input::{
    Exact, Fault, Finite, Frequency, Gap, Label, NonNegative, Place as Coordinate, Positive, Time,
    TomlSource,
};
use fieldgap_level::{Band, KnownLimit, Limit};

/// The keys of `[exposure]`; [`Exposure::read`] checks them.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExposureTable {
    place: Vec<Spanned<PlaceTable>>,
    #[serde(default)]
    limit: Vec<Spanned<LimitTable>>,
    source: Option<Spanned<SourceTable>>,
    model_u_db: Option<Spanned<NonNegative>>,
    temperature_u_c: Option<NonNegative>,
    humidity_u_percent: Option<NonNegative>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaceTable {
    name: Label,
    at_mm: Spanned<Exact<Coordinate, 3>>,
    within_mm: Spanned<Gap>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitTable {
    known: Option<Spanned<String>>,
    name: Option<Label>,
    source: Option<Label>,
    db: Option<Spanned<Finite>>,
    from_hz: Option<Frequency>,
    to_hz: Option<Spanned<Frequency>>,
    minutes_a_day: Option<Time>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct SourceTable {
    record: Option<String>,
    sheet: Option<Label>,
    db_at_300_mm: Option<Spanned<Finite>>,
    at_v_rms: Option<Positive>,
    drive_v_rms: Option<Positive>,
    u_db: Option<Spanned<NonNegative>>,
    drive_u_percent: Option<Spanned<NonNegative>>,
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

impl Place {
    /// Middle, array frame, m.
    pub fn at_m(&self) -> Vec3 {
        Vec3::from(self.at_mm) / 1e3
    }
}

/// Where the level of an element comes from, as the file states it.
#[derive(Debug, Clone, PartialEq)]
pub enum SourceStatement {
    /// A data sheet.
    Sheet(DataSheet),
    /// A record of the same array at the same drive, whose receiver has a known sensitivity.
    Record(PathBuf),
}

/// `[exposure]` of a rig file.
#[derive(Debug, Clone, PartialEq)]
pub struct Exposure {
    /// Places; at least one.
    pub places: Vec<Place>,
    /// Limits.
    pub limits: Vec<Limit>,
    /// The level of an element; `None` if nobody stated one.
    pub source: Option<SourceStatement>,
    /// Standard uncertainty of the simulated level beside that of its source, dB; `None` if nobody stated one.
    pub model_u_db: Option<f64>,
    /// Of the temperature of the air, °C.
    pub temperature_u_c: Option<f64>,
    /// Of its relative humidity, percent.
    pub humidity_u_percent: Option<f64>,
}

/// Largest radius of a place, mm: beyond it, the level of a room is meant.
const MOST_WITHIN_MM: f64 = 500.0;

/// Levels that a limit or a data sheet may have, dB: from hardly audible to the sound that would tear the air.
const LEVELS_DB: std::ops::RangeInclusive<f64> = 0.0..=194.0;

/// Largest standard uncertainty of a level, dB.
const MOST_U_DB: f64 = 10.0;

impl Exposure {
    /// Checks the `[exposure]` of `source`. Paths in it are relative to the folder of `source`.
    ///
    /// # Errors
    /// A [`Fault`] at the first key that is missing, superfluous or out of range.
    pub fn read(table: &Spanned<ExposureTable>, source: &TomlSource) -> Result<Self, Fault> {
        let keys = table.get_ref();
        if keys.place.is_empty() {
            return Err(source.fault(
                table.span(),
                "[exposure] names no place",
                "add [[exposure.place]] with `name`, `at_mm` and `within_mm`",
            ));
        }
        if let Some(u_db) = &keys.model_u_db {
            at_most(u_db, "model_u_db", source)?;
        }
        Ok(Self {
            places: keys
                .place
                .iter()
                .map(|place| read_place(place, source))
                .collect::<Result<_, _>>()?,
            limits: keys
                .limit
                .iter()
                .map(|limit| read_limit(limit, source))
                .collect::<Result<_, _>>()?,
            source: keys.source.as_ref().map(|stated| read_source(stated, source)).transpose()?,
            model_u_db: keys.model_u_db.as_ref().map(|u| u.get_ref().get()),
            temperature_u_c: keys.temperature_u_c.map(NonNegative::get),
            humidity_u_percent: keys.humidity_u_percent.map(NonNegative::get),
        })
    }

    /// Longest time with the array driven in a day, minutes, and the limit that has it.
    pub fn minutes_a_day(&self) -> Option<(f64, &Limit)> {
        let timed = self.limits.iter().filter_map(|limit| Some((limit.minutes_a_day?, limit)));
        timed.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

fn at_most(u_db: &Spanned<NonNegative>, key: &str, source: &TomlSource) -> Result<(), Fault> {
    let value = u_db.get_ref().get();
    if value <= MOST_U_DB {
        return Ok(());
    }
    Err(source.fault(
        u_db.span(),
        format!("`{key}` is {value} dB; at most {MOST_U_DB} dB is accepted"),
        "with a larger uncertainty nothing can be said of a limit",
    ))
}

fn level(db: &Spanned<Finite>, source: &TomlSource) -> Result<f64, Fault> {
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
    let bands = vec![Band { from_hz, to_hz, db: level(db, source)? }];
    Ok(Limit { name: name.into(), source: of.into(), bands, minutes_a_day })
}

fn read_source(
    table: &Spanned<SourceTable>,
    source: &TomlSource,
) -> Result<SourceStatement, Fault> {
    let keys = table.get_ref();
    let fault = |problem: String| {
        source.fault(
            table.span(),
            problem,
            "[exposure.source] has `record`; or `sheet`, `db_at_300_mm`, `at_v_rms`, `drive_v_rms`, `u_db` and perhaps `drive_u_percent`",
        )
    };
    if let Some(record) = &keys.record {
        let alone = keys.sheet.is_none() && keys.db_at_300_mm.is_none() && keys.at_v_rms.is_none();
        if !(alone
            && keys.drive_v_rms.is_none()
            && keys.u_db.is_none()
            && keys.drive_u_percent.is_none())
        {
            return Err(fault("a source is a record or a data sheet, not both".to_owned()));
        }
        let folder = source.path().parent().unwrap_or(std::path::Path::new(""));
        return Ok(SourceStatement::Record(folder.join(record)));
    }
    let missing = |key: &str| fault(format!("`{key}` is missing"));
    let db = keys.db_at_300_mm.as_ref().ok_or_else(|| missing("db_at_300_mm"))?;
    let u_db = keys.u_db.as_ref().ok_or_else(|| missing("u_db"))?;
    at_most(u_db, "u_db", source)?;
    let drive_u_percent = keys.drive_u_percent.as_ref().map_or(0.0, |u| u.get_ref().get());
    if let Some(u) = keys.drive_u_percent.as_ref().filter(|_| drive_u_percent > 50.0) {
        return Err(source.fault(
            u.span(),
            "more than 50 percent is no uncertainty of a drive",
            "correct the value",
        ));
    }
    Ok(SourceStatement::Sheet(DataSheet {
        of: keys.sheet.clone().ok_or_else(|| missing("sheet"))?.into(),
        db_at_300_mm: level(db, source)?,
        at_v_rms: keys.at_v_rms.ok_or_else(|| missing("at_v_rms"))?.get(),
        drive_v_rms: keys.drive_v_rms.ok_or_else(|| missing("drive_v_rms"))?.get(),
        u_db: u_db.get_ref().get(),
        drive_u_percent,
    }))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;

    use super::*;

    #[derive(Deserialize)]
    struct File {
        exposure: Spanned<ExposureTable>,
    }

    pub(crate) fn read(text: &str) -> Result<Exposure, Fault> {
        let source = TomlSource::new(Path::new("rigs/rig.toml"), text);
        let file: File = source.parse()?;
        Exposure::read(&file.exposure, &source)
    }

    const EXAMPLE: &str = "[exposure]\n\
        [exposure.source]\nsheet = \"Murata MA40S4S\"\ndb_at_300_mm = 120.0\nat_v_rms = 10.0\ndrive_v_rms = 8.0\nu_db = 1.5\n\
        [[exposure.place]]\nname = \"head\"\nat_mm = [0.0, -300.0, 400.0]\nwithin_mm = 100.0\n\
        [[exposure.limit]]\nknown = \"howard-2004\"\nminutes_a_day = 240.0\n\
        [[exposure.limit]]\nname = \"house rule\"\nsource = \"instruction 7\"\ndb = 105.0\n";

    #[test]
    fn the_example_is_read() {
        let exposure = read(EXAMPLE).expect("good");
        assert_eq!(exposure.places[0].at_m(), Vec3::new(0.0, -0.3, 0.4));
        assert_eq!(
            exposure.limits.iter().map(|limit| limit.at_db(40e3)).collect::<Vec<_>>(),
            [Some(110.0), Some(105.0)]
        );
        assert_eq!(exposure.minutes_a_day().map(|(minutes, _)| minutes), Some(240.0));
        let Some(SourceStatement::Sheet(sheet)) = exposure.source else { panic!("a sheet") };
        assert_eq!((sheet.drive_v_rms, sheet.drive_u_percent), (8.0, 0.0));
    }

    #[test]
    fn a_record_is_relative_to_the_file() {
        let text = EXAMPLE.split("[[").skip(1).fold(
            "[exposure]\n[exposure.source]\nrecord = \"../out/scan\"\n".to_owned(),
            |text, part| text + "[[" + part,
        );
        let exposure = read(&text).expect("good");
        assert_eq!(exposure.source, Some(SourceStatement::Record("rigs/../out/scan".into())));
    }

    #[test]
    fn faults_are_placed() {
        for (from, to, line, said) in [
            ("400.0]", "-5.0]", 10, "behind the faces"),
            ("within_mm = 100.0", "within_mm = 900.0", 11, "more than 500"),
            ("howard-2004", "acgih", 13, "not a known limit"),
            ("db = 105.0", "db = 300.0", 18, "not a sound pressure level"),
            ("db = 105.0", "", 15, "no `db`"),
            ("source = \"instruction 7\"\n", "", 15, "document"),
            ("u_db = 1.5", "u_db = 15.0", 7, "at most 10 dB"),
            ("u_db = 1.5\n", "", 2, "`u_db` is missing"),
            ("u_db = 1.5", "u_db = 1.5\nrecord = \"x\"", 2, "not both"),
            ("known = \"howard-2004\"", "known = \"howard-2004\"\ndb = 100.0", 12, "its own name"),
            (
                "db = 105.0",
                "db = 105.0\nfrom_hz = 30000.0\nto_hz = 20000.0",
                20,
                "before it begins",
            ),
            ("name = \"head\"", "nome = \"head\"", 9, "nome"),
        ] {
            let text = EXAMPLE.replacen(from, to, 1);
            assert_ne!(text, EXAMPLE, "{from}");
            let fault = read(&text).expect_err(to);
            assert_eq!(fault.line_column().map(|place| place.0), Some(line), "{to}: {fault}");
            assert!(fault.problem().contains(said), "{to}: {fault}");
        }
        assert!(read("[exposure]\nplace = []\n").expect_err("none").problem().contains("no place"));
    }

    proptest! {
        #[test]
        fn any_numbers_are_read_or_refused(x in any::<f64>(), z in any::<f64>(), within in any::<f64>(), db in any::<f64>()) {
            let number = |value: f64| if value.is_finite() { format!("{value:?}") } else { "nan".to_owned() };
            let text = EXAMPLE
                .replace("[0.0, -300.0, 400.0]", &format!("[{}, 0.0, {}]", number(x), number(z)))
                .replace("within_mm = 100.0", &format!("within_mm = {}", number(within)))
                .replace("db = 105.0", &format!("db = {}", number(db)));
            if let Ok(exposure) = read(&text) {
                let place = &exposure.places[0];
                prop_assert!(place.at_mm[2] > 0.0 && (0.0..=500.0).contains(&place.within_mm));
                prop_assert!(exposure.limits[1].at_db(40e3).is_some_and(|db| (0.0..=194.0).contains(&db)));
            }
        }
    }
}
