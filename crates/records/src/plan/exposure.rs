//! `[exposure]` of a plan: places of people and limits of exposure in its scan.

use serde::Deserialize;
use toml::Spanned;

use fieldgap_input::{Fault, TomlSource};
use fieldgap_level::{LimitTable, People, PlaceTable};

/// The keys of `[exposure]` in a plan. What the array emits is the rig file's to state.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ExposureTable {
    #[serde(default)]
    place: Vec<Spanned<PlaceTable>>,
    #[serde(default)]
    limit: Vec<Spanned<LimitTable>>,
}

/// Checks the section.
///
/// # Errors
/// A [`Fault`] at the first key that is wrong.
pub(super) fn read(table: &Spanned<ExposureTable>, source: &TomlSource) -> Result<People, Fault> {
    let ExposureTable { place, limit } = table.get_ref();
    if place.is_empty() && limit.is_empty() {
        return Err(source.fault(
            table.span(),
            "[exposure] states neither a place nor a limit",
            "add [[exposure.place]] or [[exposure.limit]], or leave the section out",
        ));
    }
    People::read(place, limit, source)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::Plan;

    const PLAN: &str = "name = \"p\"\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0\ny_mm = 0\nz_mm = 100\n\
                        [[plane]]\nz_mm = 100\nsize_mm = [60, 60]\nstep_mm = 2\n";
    const VISITOR: &str =
        "[[exposure.place]]\nname = \"visitor\"\nat_mm = [0, -900, 1200]\nwithin_mm = 50\n";

    fn people(more: &str) -> Result<Option<People>, Fault> {
        let source = TomlSource::new(Path::new("plan.toml"), format!("{PLAN}{more}"));
        Plan::parse(source).map(|plan| plan.people)
    }

    #[test]
    fn a_plan_states_people_and_limits_and_nothing_of_the_array() {
        assert_eq!(people("").expect("good"), None);
        let limit = "[[exposure.limit]]\nknown = \"agnir-2010\"\n";
        let stated = people(&format!("{VISITOR}{limit}")).expect("good").expect("stated");
        assert_eq!(stated.places[0].name, "visitor");
        assert_eq!(stated.limits[0].at_db(40e3), Some(100.0));
        for (more, line, says) in [
            ("[exposure]\n".to_owned(), 12, "neither a place nor a limit"),
            (format!("{VISITOR}{VISITOR}"), 16, "a place `visitor` already"),
            (format!("{limit}{limit}"), 14, "already"),
            (VISITOR.replace("1200", "-1"), 14, "behind the faces"),
            (format!("[exposure]\nmodel_u_db = 1.0\n{VISITOR}"), 13, "model_u_db"),
            (format!("[exposure.source]\nrecord = \"x\"\n{VISITOR}"), 12, "source"),
        ] {
            let fault = people(&more).expect_err(&more);
            assert_eq!(fault.line_column().map(|place| place.0), Some(line), "{more}: {fault}");
            assert!(fault.problem().contains(says), "{more}: {fault}");
        }
    }
}
