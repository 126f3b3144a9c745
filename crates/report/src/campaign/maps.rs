//! Small maps of all settings beside each other: how each was in the first round, and how it is now.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::super::error::ReportError;
use super::super::picture::ColourScale;
use super::addresses::{encoded, report_address};
use super::map_file::{MapFile, Outcome};
use super::map_pictures::{draw, map_name};
use fieldgap_campaign::{CellOverview, CellStatus, Overview};
use fieldgap_text::{fixed, significant};

/// The folder of the maps, below that of the campaign.
const FOLDER: &str = "maps";

/// Width of a map on the page, CSS pixels, if it is as wide as high.
const WIDTH: f64 = 144.0;

/// The cells of a setting that are shown.
struct Pair<'a> {
    first: &'a CellOverview,
    /// The newest, if it is another one.
    newest: Option<&'a CellOverview>,
}

/// The section of maps; draws those that are missing. `None` without a done cell.
pub(super) fn maps(overview: &Overview) -> Result<Option<Markup>, ReportError> {
    let pairs = pairs(overview);
    if pairs.is_empty() {
        return Ok(None);
    }
    let folder = overview.folder.join(FOLDER);
    std::fs::create_dir_all(&folder).map_err(ReportError::write(&folder))?;
    let firsts: Vec<&CellOverview> = pairs.iter().map(|pair| pair.first).collect();
    let newest: Vec<&CellOverview> = pairs.iter().filter_map(|pair| pair.newest).collect();
    let file = draw(&overview.folder, &folder, &firsts, &newest)?;
    Ok(Some(html! {
        p {
            "Readings at the height where each setting had its largest one in its first scan. All maps of a unit have one colour scale."
            @if !newest.is_empty() { " On the left the first scan, on the right the newest." }
        }
        @for (unit, top) in &file.tops { (scale(unit, *top)) }
        div class="maps" {
            @for pair in &pairs {
                figure {
                    div {
                        (map(pair.first, &file))
                        @if let Some(newest) = pair.newest { (map(newest, &file)) }
                    }
                    figcaption { b { (pair.first.setting) } " " (place(pair.first, &file)) }
                }
            }
        }
    }))
}

/// First and newest done cell of every setting, in the order of the cells.
fn pairs(overview: &Overview) -> Vec<Pair<'_>> {
    let mut number_of: BTreeMap<&str, usize> = BTreeMap::new();
    let mut pairs: Vec<Pair<'_>> = Vec::new();
    for cell in &overview.cells {
        if !matches!(cell.status, CellStatus::Done { .. }) {
            continue;
        }
        match number_of.get(cell.setting.as_str()) {
            None => {
                number_of.insert(&cell.setting, pairs.len());
                pairs.push(Pair { first: cell, newest: None });
            }
            // Repeats of the first round are no change over time.
            Some(&number) if cell.round > pairs[number].first.round => {
                pairs[number].newest = Some(cell)
            }
            Some(_) => {}
        }
    }
    pairs
}

fn map(cell: &CellOverview, file: &MapFile) -> Markup {
    let title = format!("Round {}, {}", cell.round, cell.setting);
    html! {
        @match file.maps.get(&cell.id).map(|entry| &entry.result) {
            Some(Outcome::Drawn { peak, unit, extent_mm, .. }) => {
                @let (width, height) = size(*extent_mm);
                @let peak = format!("{} {unit}", significant(*peak, 3));
                a href=(report_address(&cell.id)) title=(title) {
                    img loading="lazy" width=(width) height=(height) style={ "width:" (width) "px" } src={ (FOLDER) "/" (encoded(&map_name(cell))) }
                        alt=(format!("Map of readings, {title}: the largest is {}", peak.trim_end()));
                    span { "round " (cell.round) ": peak " (peak.trim_end()) }
                }
            }
            Some(Outcome::None(reason)) => p { (title) ": no map, because " (reason) "." },
            None => {}
        }
    }
}

/// Width and height on the page, CSS pixels; the longer side is always the same.
fn size(extent_mm: [f64; 2]) -> (u32, u32) {
    let longer = extent_mm[0].max(extent_mm[1]);
    let side = |extent: f64| (WIDTH * extent / longer).round().max(1.0) as u32;
    (side(extent_mm[0]), side(extent_mm[1]))
}

/// Where a map was measured, and how large it is.
fn place(cell: &CellOverview, file: &MapFile) -> String {
    match file.maps.get(&cell.id).map(|entry| &entry.result) {
        Some(Outcome::Drawn { place, extent_mm: [x, y], .. }) => {
            let decimals = if (place.z_mm - place.z_mm.round()).abs() < 0.05 { 0 } else { 1 };
            format!(
                "z = {} mm, {} × {} mm",
                fixed(place.z_mm, decimals),
                significant(*x, 3),
                significant(*y, 3)
            )
        }
        _ => String::new(),
    }
}

/// The colour scale with its ends.
fn scale(unit: &str, top: f64) -> Markup {
    let colours = ColourScale { top: 1.0 };
    let stops: Vec<String> = (0..=16)
        .map(|step| {
            let (red, green, blue) = colours.colour(f64::from(step) / 16.0);
            format!("#{red:02x}{green:02x}{blue:02x}")
        })
        .collect();
    let gradient = format!("background:linear-gradient(90deg,{})", stops.join(","));
    let words = format!("{} {unit}", significant(top, 2));
    html! { p class="scale" { "0 " i style=(gradient) {} " " (words.trim_end()) } }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use fieldgap_acoustics::Vec3;
    use fieldgap_input::TomlSource;
    use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};

    use super::super::example::{cell, overview};
    use super::*;

    const SETUP: &str = "format = 1\nname = \"x\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n[array]\nfrequency_hz = 40000.0\n\
        layout = \"square\"\ncolumns = 4\nrows = 4\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n[medium]\nspeed_of_sound_m_s = 343.0\n\
        [simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 100.0\n";

    /// Writes a record with planes at 90 and 100 mm, the second with this peak.
    fn record(campaign: &Path, cell: &CellOverview, peak: f64) {
        let setup =
            ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), SETUP)).expect("a set-up");
        let sample = |x: i32, y: i32, z_m: f64| {
            let at = Vec3::new(0.002 * f64::from(x), 0.002 * f64::from(y), z_m);
            let middle = x == 1 && y == 1 && z_m > 0.095;
            RecordedSample::measured(0.0, Some(0), at, if middle { peak } else { 0.1 }, None)
        };
        let samples = [0.09, 0.1]
            .into_iter()
            .flat_map(|z_m| (0..9).map(move |point| sample(point % 3, point / 3, z_m)));
        let scan = RecordedScan { setup, samples: samples.collect() };
        scan.write(&fieldgap_campaign::cell_folder(campaign, &cell.id)).expect("written");
    }

    fn modified(path: &Path) -> std::time::SystemTime {
        std::fs::metadata(path).and_then(|file| file.modified()).expect("a file")
    }

    #[test]
    fn maps_are_drawn_once_until_a_peak_exceeds_their_scale() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut campaign = overview();
        campaign.folder = folder.path().to_owned();
        campaign.cells.truncate(2);
        for (cell, peak) in campaign.cells.iter().zip([1.8, 1.1]) {
            record(folder.path(), cell, peak);
        }
        let page = maps(&campaign).expect("drawn").expect("cells").into_string();
        assert!(page.contains("z = 100 mm, 6.00 × 6.00 mm") && page.contains("2.0 V"), "{page}");
        assert!(
            page.contains(
                "loading=\"lazy\" width=\"144\" height=\"144\" style=\"width:144px\" src=\"maps/r001-focus=left.png\""
            ),
            "{page}"
        );
        let left = folder.path().join("maps/r001-focus=left.png");
        let (drawn, bytes) = (modified(&left), std::fs::read(&left).expect("a file"));

        campaign.cells.push(cell(2, "focus=left"));
        record(folder.path(), &campaign.cells[2], 1.9);
        let page = maps(&campaign).expect("drawn").expect("cells").into_string();
        assert!(page.contains("round 2: peak 1.90 V"), "{page}");
        assert_eq!(modified(&left), drawn, "it was drawn before");

        campaign.cells.push(cell(2, "focus=right"));
        record(folder.path(), &campaign.cells[3], 2.4);
        let page = maps(&campaign).expect("drawn").expect("cells").into_string();
        assert!(page.contains("3.0 V") && page.matches("<img").count() == 4, "{page}");
        assert_ne!(std::fs::read(&left).expect("a file"), bytes, "the scale is another one");
        let newest = std::fs::read(folder.path().join("maps/r002-focus=left.png")).expect("a file");
        let pixel = |bytes: &[u8]| {
            image::load_from_memory(bytes).expect("a PNG").to_rgb8().get_pixel(144, 144).0
        };
        let (red, green, blue) = ColourScale { top: 3.0 }.colour(1.9);
        assert_eq!(pixel(&newest), [red, green, blue], "all are on the new scale");
    }

    #[test]
    fn a_cell_without_a_record_has_no_map_and_says_why() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut campaign = overview();
        campaign.folder = folder.path().to_owned();
        let page = maps(&campaign).expect("drawn").expect("cells").into_string();
        assert!(page.contains("no map, because") && !page.contains("<img"), "{page}");
        campaign.cells.clear();
        assert!(maps(&campaign).expect("drawn").is_none());
    }

    #[test]
    fn the_newest_of_a_later_round_stands_beside_the_first() {
        let mut campaign = overview();
        let mut repeat = cell(1, "focus=left");
        repeat.repeat = 2;
        campaign.cells.insert(1, repeat);
        campaign.cells.push(cell(3, "focus=left"));
        let shown: Vec<_> = pairs(&campaign)
            .iter()
            .map(|pair| (pair.first.round, pair.newest.map(|cell| cell.round)))
            .collect();
        assert_eq!(shown, [(1, Some(3)), (1, None)]);
    }
}
