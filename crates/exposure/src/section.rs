//! `[exposure]`: places of people, limits, and the level of the array's elements.

use std::path::PathBuf;

use serde::Deserialize;
use toml::Spanned;

use super::source::DataSheet;
use fieldgap_input::{Fault, Finite, Label, NonNegative, Positive, TomlSource};
use fieldgap_level::{Limit, LimitTable, People, PlaceTable, sound_level};

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
struct SourceTable {
    record: Option<String>,
    sheet: Option<Label>,
    db_at_300_mm: Option<Spanned<Finite>>,
    at_v_rms: Option<Positive>,
    drive_v_rms: Option<Positive>,
    u_db: Option<Spanned<NonNegative>>,
    drive_u_percent: Option<Spanned<NonNegative>>,
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
    /// Places, at least one, and limits.
    pub people: People,
    /// The level of an element; `None` if nobody stated one.
    pub source: Option<SourceStatement>,
    /// Standard uncertainty of the simulated level beside that of its source, dB; `None` if nobody stated one.
    pub model_u_db: Option<f64>,
    /// Of the temperature of the air, °C.
    pub temperature_u_c: Option<f64>,
    /// Of its relative humidity, percent.
    pub humidity_u_percent: Option<f64>,
}

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
            people: People::read(&keys.place, &keys.limit, source)?,
            source: keys.source.as_ref().map(|stated| read_source(stated, source)).transpose()?,
            model_u_db: keys.model_u_db.as_ref().map(|u| u.get_ref().get()),
            temperature_u_c: keys.temperature_u_c.map(NonNegative::get),
            humidity_u_percent: keys.humidity_u_percent.map(NonNegative::get),
        })
    }

    /// Of people alone, in the room of a rig file without `[exposure]`: the level of the elements is unknown. `None` without a place.
    pub fn of(people: People) -> Option<Self> {
        let somebody = !people.places.is_empty();
        somebody.then_some(Self {
            people,
            source: None,
            model_u_db: None,
            temperature_u_c: None,
            humidity_u_percent: None,
        })
    }

    /// With the places and limits of a plan, as [`People::with`] joins them.
    pub fn with(&self, people: &People) -> Self {
        Self { people: self.people.with(people), ..self.clone() }
    }

    /// Longest time with the array driven in a day, minutes, and the limit that has it.
    pub fn minutes_a_day(&self) -> Option<(f64, &Limit)> {
        let timed =
            self.people.limits.iter().filter_map(|limit| Some((limit.minutes_a_day?, limit)));
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
        db_at_300_mm: sound_level(db, source)?,
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
        assert_eq!(exposure.people.places[0].at_mm, [0.0, -300.0, 400.0]);
        assert_eq!(
            exposure.people.limits.iter().map(|limit| limit.at_db(40e3)).collect::<Vec<_>>(),
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
            ("name = \"house rule\"", "name = \"work, 110 dB at 25 to 50 kHz\"", 15, "already"),
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
                let place = &exposure.people.places[0];
                prop_assert!(place.at_mm[2] > 0.0 && (0.0..=500.0).contains(&place.within_mm));
                prop_assert!(exposure.people.limits[1].at_db(40e3).is_some_and(|db| (0.0..=194.0).contains(&db)));
            }
        }
    }
}
