//! The plan of a closed loop as text: made from a plan of places, and longer with each round.

use std::fmt::Write;

use serde::Serialize;
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, value};

use fieldgap_acoustics::Vec3;
use fieldgap_input::{Fault, TomlSource};
use fieldgap_records::{BoxMm, FocusSection, FocusTable, Layers, Plan, Shape};

use crate::flights::Course;
use crate::robot::Planned;

/// Least extent of the box of a plan along an axis, as a share of the largest: a plan of one plane is scanned around it too.
const LEAST_EXTENT: f64 = 0.5;

/// Regions of a plan, which a closed loop replaces by places of its own.
const REGIONS: [&str; 4] = ["plane", "volume", "line", "points"];

#[derive(Serialize)]
struct Drives {
    focus: Vec<FocusTable>,
}

/// A plan with `[closed_loop]` in place of its regions, over the box that they fill. A plan that has the section keeps it. `minutes`
/// replaces the time that the plan allows.
///
/// # Errors
/// A [`Fault`] if the result is no valid plan.
pub fn in_closed_loop(plan: &Plan, minutes: Option<f64>) -> Result<Plan, Fault> {
    let path = plan.path();
    let mut document: DocumentMut = plan
        .text()
        .parse()
        .map_err(|error| Fault::of_file(path, format!("{error}"), "correct the file"))?;
    if plan.closed_loop.is_none() {
        for region in REGIONS {
            document.remove(region);
        }
        if let Some(dark) = document.get_mut("dark").and_then(Item::as_table_like_mut) {
            dark.remove("after");
        }
        if let Some(reference) = document.get_mut("reference").and_then(Item::as_table_like_mut) {
            reference.remove("every_points");
        }
        let within = box_of(plan);
        let mut table = Table::new();
        let corner = |at_mm: Vec3| value(Array::from_iter(at_mm.iter().copied()));
        table.insert("min_mm", corner(within.least));
        table.insert("max_mm", corner(within.most));
        document.insert("closed_loop", Item::Table(table));
    }
    if let (Some(minutes), Some(table)) =
        (minutes, document.get_mut("closed_loop").and_then(Item::as_table_like_mut))
    {
        table.insert("minutes", value(minutes));
    }
    Plan::parse(TomlSource::new(path, document.to_string()))
}

/// The box that the regions of a plan fill, widened to at least half of its largest extent along each axis, millimetres.
fn box_of(plan: &Plan) -> BoxMm {
    let corners = plan.regions.iter().flat_map(|region| match &region.shape {
        Shape::Planes(layers) | Shape::Volume(layers) => corners(layers),
        Shape::Line { from_mm, step_mm, count } => {
            vec![*from_mm, from_mm + step_mm * (count - 1) as f64]
        }
        Shape::Points(points) => points.clone(),
    });
    let (mut least, mut most) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    for at_mm in corners {
        least = least.inf(&at_mm);
        most = most.sup(&at_mm);
    }
    let wanted = LEAST_EXTENT * (most - least).max().max(1.0);
    let missing = (most - least).map(|extent| 0.5 * (wanted - extent).max(0.0));
    BoxMm { least: least - missing, most: most + missing }
}

fn corners(layers: &Layers) -> Vec<Vec3> {
    let last = |axis: &fieldgap_records::Axis| axis.at_mm(axis.count - 1);
    let (low, high) = (layers.z_mm[0], layers.z_mm[layers.z_mm.len() - 1]);
    vec![
        Vec3::new(layers.x.first_mm, layers.y.first_mm, low),
        Vec3::new(last(&layers.x), last(&layers.y), high),
    ]
}

/// The text of a plan with more drives.
pub(crate) fn with_drives(text: &str, drives: &[FocusSection]) -> String {
    let drives = Drives { focus: drives.iter().map(FocusSection::table).collect() };
    let tables = toml_edit::ser::to_document(&drives).expect("drives are TOML");
    let mut longer = text.trim_end().to_owned();
    longer += "\n\n# Drives that the closed loop added.\n";
    longer + &in_headings(tables)
}

/// An array of tables with a heading each, so that it goes on with the array of the plan.
fn in_headings(mut tables: DocumentMut) -> String {
    if let Some(Item::Value(toml_edit::Value::Array(inline))) = tables.remove("focus") {
        let mut headed = ArrayOfTables::new();
        for table in inline {
            if let toml_edit::Value::InlineTable(table) = table {
                headed.push(table.into_table());
            }
        }
        tables.insert("focus", Item::ArrayOfTables(headed));
    }
    tables.to_string()
}

/// The text of a plan with one more list of readings.
pub fn with_readings(text: &str, why: &str, readings: &[Planned]) -> String {
    with_course(text, why, &Course::at_rest(readings.to_vec()))
}

/// The text of a plan with one more list of readings, of which some may be flown.
pub(crate) fn with_course(text: &str, why: &str, course: &Course) -> String {
    let readings = &course.readings;
    let mut longer = text.trim_end().to_owned();
    let _ = write!(longer, "\n\n# {why}\n[[readings]]\nat_mm = [\n");
    for line in readings.chunks(6) {
        longer += "  ";
        for (at_m, _) in line {
            let [x, y, z] = [at_m.x, at_m.y, at_m.z].map(|m| (m * 1e5).round() / 100.0);
            let _ = write!(longer, " [{x}, {y}, {z}],");
        }
        longer += "\n";
    }
    longer += "]\nfocus = [\n";
    for line in readings.chunks(24) {
        longer += "  ";
        for (_, focus) in line {
            let _ = match focus {
                Some(focus) => write!(longer, " {focus},"),
                None => write!(longer, " -1,"),
            };
        }
        longer += "\n";
    }
    longer += "]\n";
    if let Some(speeds_mm_s) = course.speeds_mm_s() {
        longer += "speed_mm_s = [\n";
        for line in speeds_mm_s.chunks(24) {
            longer += "  ";
            line.iter().for_each(|mm_s| {
                let _ = write!(longer, " {mm_s:?},");
            });
            longer += "\n";
        }
        longer += "]\n";
    }
    longer
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const PLAN: &str = "name = \"p\"\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0.0\ny_mm = 5\nz_mm = 100\n\
                        [dark]\nbefore = 4\nafter = 4\n[[plane]]\nz_mm = [80, 120]\nsize_mm = [60, 20]\nstep_mm = 2\n";

    fn parsed(text: &str) -> Plan {
        Plan::parse(TomlSource::new(Path::new("plan.toml"), text)).expect(text)
    }

    #[test]
    fn a_plan_of_planes_becomes_a_box() {
        let plan = in_closed_loop(&parsed(PLAN), Some(20.0)).expect("a plan");
        let settings = plan.closed_loop.as_ref().expect("it has the section");
        assert_eq!(settings.within.least, Vec3::new(-30.0, -15.0, 80.0));
        assert_eq!(settings.within.most, Vec3::new(30.0, 15.0, 120.0));
        assert_eq!(settings.longest_s, Some(1200.0));
        assert!(plan.regions.is_empty() && plan.visits().is_empty());
        // Its own settings are kept.
        let again = in_closed_loop(&plan, None).expect("a plan");
        assert_eq!(again.closed_loop, plan.closed_loop);
    }

    #[test]
    fn a_longer_plan_begins_with_the_shorter() {
        let plan = in_closed_loop(&parsed(PLAN), None).expect("a plan");
        let drives = [FocusSection::AllZero, FocusSection::Phases(vec![0.25, -1.0])];
        let text = with_drives(plan.text(), &drives);
        let first: Vec<Planned> =
            vec![(Vec3::new(0.01, 0.0, 0.1), None), (Vec3::new(0.01234, -0.02, 0.11), Some(2))];
        let one = parsed(&with_readings(&text, "First round", &first));
        assert_eq!(one.foci.len(), 3);
        assert_eq!(one.foci[1..], drives);
        let visits: Vec<Planned> =
            one.visits().iter().map(|visit| (visit.position_m, visit.focus)).collect();
        assert_eq!(visits.len(), 2);
        assert!(visits.iter().zip(&first).all(|(a, b)| (a.0 - b.0).norm() < 1e-9 && a.1 == b.1));
        let two = parsed(&with_readings(one.text(), "Second round", &first));
        assert_eq!(two.visits().len(), 4);
        assert_eq!(two.visits()[..2], one.visits()[..]);
    }
}
