//! The air begins to absorb at one moment: a humidifier, or mist from an atomiser.

use super::super::laboratory::Laboratory;
use super::super::parameters::Parameters;
use super::super::random_sequence::RandomSequence;
use super::{Draw, Unmodelled};

pub(super) const NAME: &str = "fog";

#[derive(Debug, Clone, Copy)]
struct Fog {
    at_s: f64,
    db_per_m: f64,
}

/// In the middle half of the scan, up to 40 dB/m.
pub(super) fn draw(laboratory: &Laboratory, random: &mut RandomSequence) -> Draw {
    let at_s = random.uniform(0.25, 0.75) * laboratory.survey.lasts_s();
    Draw::new(40.0, move |db_per_m| Fog { at_s, db_per_m })
}

impl Unmodelled for Fog {
    fn name(&self) -> &'static str {
        NAME
    }

    fn parameters(&self) -> Parameters {
        let Self { at_s, db_per_m } = self;
        toml::toml! {
            at_s = (*at_s)
            db_per_m = (*db_per_m)
        }
    }

    fn changes(&self) -> Vec<(f64, Vec<(&'static str, Parameters)>)> {
        let db_per_m = self.db_per_m;
        vec![(self.at_s, vec![("absorption", toml::toml! { db_per_m = (db_per_m) })])]
    }
}
