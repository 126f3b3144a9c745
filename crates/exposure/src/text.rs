//! An assessment as text.

use super::assess::{Assessment, PlaceLevel};
use fieldgap_text::{fixed, paragraph, table};

impl Assessment {
    /// Places, levels, limits and margins, with the budget of the loudest place, in at most 80 columns.
    pub fn to_text(&self) -> String {
        let khz = self.frequency_hz / 1e3;
        let Some(source) = &self.source else {
            return paragraph(
                &format!(
                    "The sound level of the array at {khz} kHz is unknown: the rig file has no [exposure.source], and no record was given. \
                     The limits cannot be compared."
                ),
                0,
                2,
            );
        };
        let mut text = paragraph(
            &format!(
                "Largest levels at {khz} kHz{}, dB re 20 µPa rms, with expanded uncertainty (k = 2)",
                if self.focused_at_places { ", focused at each place" } else { "" }
            ),
            0,
            2,
        );
        text += &paragraph(&format!("level of the elements: {source}"), 0, 2);
        let heading = ["place", "level", "U", "limit", "margin", ""].map(str::to_owned);
        let rows: Vec<[String; 6]> =
            std::iter::once(heading).chain(self.places.iter().flat_map(rows)).collect();
        text += "\n";
        text += &table(&rows);
        for name in &self.not_at_frequency {
            text += &paragraph(&format!("no level at {khz} kHz: {name}"), 2, 2);
        }
        if self.limits == 0 {
            text += &paragraph("no limit is stated: [[exposure.limit]] in the rig file", 2, 2);
        }
        if let Some(loudest) = self.places.iter().max_by(|a, b| a.level_db.total_cmp(&b.level_db)) {
            let [x, y, z] = loudest.at_mm.map(|mm| fixed(mm, 0));
            let drive = loudest.drive.map_or(String::new(), |drive| format!(", drive {drive}"));
            text += &format!("\nuncertainty at {} (at {x}, {y}, {z} mm{drive})\n", loudest.name);
            text += &loudest.budget.to_text();
        }
        text
    }
}

/// The place with its level, and below it each limit.
fn rows(place: &PlaceLevel) -> Vec<[String; 6]> {
    let within = match place.within_mm {
        0.0 => String::new(),
        within_mm => format!(", within {within_mm} mm"),
    };
    let none = String::new;
    let mut rows = vec![[
        format!("{}{within}", place.name),
        fixed(place.level_db, 1),
        format!("±{}", fixed(place.budget.expanded_db(), 1)),
        none(),
        none(),
        none(),
    ]];
    rows.extend(place.against.iter().map(|against| {
        let margin = format!("{:+.1}", against.margin_db).replace('-', "\u{2212}");
        [
            format!("  {}", against.limit),
            none(),
            none(),
            fixed(against.limit_db, 1),
            margin,
            against.standing.to_string(),
        ]
    }));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DataSheet, Drives, Exposure, Radiating, assess};
    use fieldgap_acoustics::{Array, Excitation, Simulator, Vec3};
    use fieldgap_level::{Band, KnownLimit, Limit, People, Place};
    use fieldgap_records::MediumSection;

    fn assessment(known: bool) -> Assessment {
        let array = Array::square(6, 6, 10.5e-3).expect("not empty");
        let medium = MediumSection::of_air(20.0, 50.0, 101.325).expect("a room");
        let place =
            |name: &str, at_mm, within_mm| Place { name: name.to_owned(), at_mm, within_mm };
        let audible = Limit {
            name: "audible sound".to_owned(),
            source: "a rule".to_owned(),
            bands: vec![Band { from_hz: 0.0, to_hz: 16e3, db: 85.0 }],
            minutes_a_day: None,
        };
        let exposure = Exposure {
            people: People {
                places: vec![
                    place("operator's head", [0.0, -300.0, 400.0], 80.0),
                    place("visitor", [0.0, -1500.0, 1500.0], 0.0),
                ],
                limits: vec![
                    KnownLimit::Howard2004.limit(),
                    KnownLimit::Agnir2010.limit(),
                    audible,
                ],
            },
            source: None,
            model_u_db: None,
            temperature_u_c: None,
            humidity_u_percent: Some(5.0),
        };
        let sheet = DataSheet {
            of: "Murata MA40S4S".to_owned(),
            db_at_300_mm: 120.0,
            at_v_rms: 10.0,
            drive_v_rms: 8.0,
            u_db: 1.5,
            drive_u_percent: 2.0,
        };
        let source = sheet.source_level(0.152);
        let radiating = Radiating {
            array: &array,
            medium: &medium,
            frequency_hz: 40e3,
            simulator: Simulator::Piston,
        };
        let drives = [Excitation::Focus(Vec3::new(0.0, 0.0, 0.15))];
        assess(&exposure, radiating, known.then_some(&source), Drives::These(&drives))
    }

    #[test]
    fn text_of_levels_against_limits() {
        insta::assert_snapshot!(assessment(true).to_text());
    }

    #[test]
    fn text_of_an_unknown_level() {
        insta::assert_snapshot!(assessment(false).to_text());
    }
}
