//! How figures went over time: the gap of every setting, and the control charts.

use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use maud::{Markup, html};
use rayon::prelude::*;

use super::super::error::ReportError;
use super::super::picture::{ControlChart, GapLine, GapOverTime, Picture, svg_file};
use super::addresses::{encoded, file_name};
use super::kept::{Kept, put};
use fieldgap_campaign::{CellStatus, GAP, Overview};
use fieldgap_monitoring::{ChartPoint, Scope};

/// The folder of the pictures, below that of the campaign.
const FOLDER: &str = "charts";

/// What was drawn, so that it is not drawn again.
const DRAWN: &str = "drawn.json";

/// Raised when the pictures look different, so that all are drawn again.
const LOOK: u32 = 1;

/// The figures that are unfolded without an alarm.
const IMPORTANT: [&str; 2] = [GAP, "level"];

/// A picture on the page.
struct Chart {
    file: String,
    description: String,
    size: (u32, u32),
}

/// The charts of one figure.
struct FigureCharts {
    figure: String,
    open: bool,
    /// That of all cells, and those with an alarm.
    shown: Vec<Chart>,
    /// Those of the other settings.
    folded: Vec<Chart>,
}

/// The section of trends; draws the pictures that changed.
pub(super) fn trends(overview: &Overview) -> Result<Markup, ReportError> {
    let folder = overview.folder.join(FOLDER);
    std::fs::create_dir_all(&folder).map_err(ReportError::write(&folder))?;
    let mut kept = Kept::read(&folder.join(DRAWN));
    let gap = gap_over_time(overview, &folder, &mut kept)?;
    let figures = control_charts(overview, &folder, &mut kept)?;
    kept.write()?;
    Ok(html! {
        @if let Some(chart) = &gap {
            h3 { "Gap over time" }
            (picture(chart))
        }
        @if let Some(why) = &overview.why_no_charts {
            p { "There are no control charts: " (why) "." }
        } @else if figures.is_empty() {
            p { "There are no control charts: no cell was measured after the baseline." }
        } @else {
            h3 { "Control charts" }
            p {
                "A figure is compared with its baseline. Its chart adds up deviations; beyond its limit it raises an alarm. "
                "The chart of all cells finds a change that they have in common sooner."
            }
        }
        @for figure in &figures {
            details id={ "figure-" (file_name(&figure.figure)) } open[figure.open] {
                summary { (figure.figure) }
                @for chart in &figure.shown { (picture(chart)) }
                @if figure.shown.is_empty() { p { "Nothing is judged yet: the scatter between runs is not known." } }
                @if !figure.folded.is_empty() {
                    details id={ "settings-" (file_name(&figure.figure)) } {
                        summary { "Charts of " (figure.folded.len()) (if figure.shown.is_empty() { " settings" } else { " further settings" }) }
                        @for chart in &figure.folded { (picture(chart)) }
                    }
                }
            }
        }
    })
}

fn picture(chart: &Chart) -> Markup {
    let (width, height) = chart.size;
    html! {
        figure class="chart" {
            img loading="lazy" alt=(chart.description) width=(width) height=(height) src={ (FOLDER) "/" (encoded(&chart.file)) };
        }
    }
}

fn gap_over_time(
    overview: &Overview,
    folder: &Path,
    kept: &mut Kept,
) -> Result<Option<Chart>, ReportError> {
    let mut lines: BTreeMap<&str, GapLine> = BTreeMap::new();
    for cell in &overview.cells {
        let Some(run) =
            cell.run.as_ref().filter(|_| matches!(cell.status, CellStatus::Done { .. }))
        else {
            continue;
        };
        let Some(gap) = run.figures.get(GAP).filter(|gap| gap.value.is_finite()) else { continue };
        let line = lines
            .entry(&cell.setting)
            .or_insert_with(|| GapLine { points: Vec::new(), alarms: Vec::new() });
        line.points.push((run.at.as_second() as f64, gap.value));
        line.alarms.push(cell.alarm);
    }
    // A setting that ran once makes no line; with several rounds there is one soon.
    if lines.values().all(|line| line.points.len() < 2) {
        return Ok(None);
    }
    let mut hasher = DefaultHasher::new();
    for line in lines.values() {
        for ((time, gap), alarm) in line.points.iter().zip(&line.alarms) {
            (time.to_bits(), gap.to_bits(), alarm).hash(&mut hasher);
        }
        0.hash(&mut hasher);
    }
    let Some(chart) = GapOverTime::new(lines.into_values().collect()) else { return Ok(None) };
    let file = "gap-over-time.svg".to_owned();
    let digest = hasher.finish() ^ u64::from(LOOK);
    if !kept.has(&file, digest) {
        put(&folder.join(&file), svg_file(&chart)?.as_bytes())?;
        kept.add(&file, digest);
    }
    Ok(Some(Chart { file, description: chart.description(), size: chart.size() }))
}

fn control_charts(
    overview: &Overview,
    folder: &Path,
    kept: &mut Kept,
) -> Result<Vec<FigureCharts>, ReportError> {
    let alarms: BTreeSet<(&str, &Scope)> = overview
        .alarms
        .iter()
        .filter(|alarm| alarm.open)
        .map(|alarm| (alarm.alarm.figure.as_str(), &alarm.alarm.scope))
        .collect();
    let mut charts: Vec<(&str, &Scope, Vec<&ChartPoint>)> = Vec::new();
    for (figure, points) in &overview.charts {
        let mut scopes: BTreeMap<&Scope, Vec<&ChartPoint>> = BTreeMap::new();
        for point in points {
            scopes.entry(&point.scope).or_default().push(point);
        }
        charts.extend(scopes.into_iter().map(|(scope, points)| (figure.as_str(), scope, points)));
    }
    let old = &*kept;
    let drawn = charts.par_iter().map(|(figure, scope, points)| {
        let file = format!("{}.svg", file_name(&format!("{figure}-{scope}")));
        let digest = digest(points);
        let points: Vec<ChartPoint> = points.iter().map(|point| (*point).clone()).collect();
        // The chart of all cells shows nothing but judgements.
        let judged = points.iter().any(|point| point.statistic.is_some());
        let shown =
            ControlChart::new(&points).filter(|_| judged || matches!(scope, Scope::Cell(_)));
        let Some(chart) = shown else { return Ok(None) };
        if !old.has(&file, digest) {
            put(&folder.join(&file), svg_file(&chart)?.as_bytes())?;
        }
        let described = Chart { file, description: chart.description(), size: chart.size() };
        Ok(Some((*figure, *scope, described, digest)))
    });
    let drawn: Vec<Option<_>> = drawn.collect::<Result<_, ReportError>>()?;
    let mut figures: BTreeMap<&str, FigureCharts> = BTreeMap::new();
    for (figure, scope, chart, digest) in drawn.into_iter().flatten() {
        kept.add(&chart.file, digest);
        let alarm = alarms.contains(&(figure, scope));
        let of = figures.entry(figure).or_insert_with(|| FigureCharts {
            figure: figure.to_owned(),
            open: IMPORTANT.contains(&figure),
            shown: Vec::new(),
            folded: Vec::new(),
        });
        of.open |= alarm;
        match scope {
            // That of all cells is the last of the order, and goes first.
            Scope::AllCells => of.shown.insert(0, chart),
            Scope::CellByCell if alarm => of.shown.push(chart),
            Scope::CellByCell => of.folded.push(chart),
            Scope::Cell(_) if alarm => of.shown.push(chart),
            Scope::Cell(_) => of.folded.push(chart),
        }
    }
    let mut figures: Vec<FigureCharts> = figures.into_values().collect();
    figures.sort_by_key(|one| {
        let alarm = alarms.iter().any(|(figure, _)| *figure == one.figure);
        let place = IMPORTANT.iter().position(|name| *name == one.figure);
        (!alarm, place.unwrap_or(IMPORTANT.len()), one.figure.clone())
    });
    Ok(figures)
}

/// A number that changes with anything that a chart shows.
fn digest(points: &[&ChartPoint]) -> u64 {
    let mut hasher = DefaultHasher::new();
    LOOK.hash(&mut hasher);
    for point in points {
        let number = |value: Option<f64>| value.map(f64::to_bits);
        point.at.hash(&mut hasher);
        point.alarm.hash(&mut hasher);
        [
            Some(point.value.value),
            Some(point.value.standard_error),
            point.baseline.map(|one| one.value),
            point.baseline.map(|one| one.standard_error),
            point.z,
            point.statistic,
            Some(point.limit),
        ]
        .map(number)
        .hash(&mut hasher);
    }
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::super::example::{charts, overview};
    use super::*;

    fn campaign(folder: &Path) -> Overview {
        let mut campaign = overview();
        campaign.folder = folder.to_owned();
        (campaign.charts, campaign.why_no_charts) = (charts(), None);
        campaign
    }

    #[test]
    fn important_figures_are_unfolded_and_alarms_come_first() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut campaign = campaign(folder.path());
        campaign.alarms[0].alarm.figure = "z100.peak_ratio".to_owned();
        let page = trends(&campaign).expect("drawn").into_string();
        let place = |words: &str| page.find(words).unwrap_or_else(|| panic!("{words} in {page}"));
        let peak = place("<details id=\"figure-z100.peak_ratio\" open>");
        assert!(peak < place("<details id=\"figure-gap\" open>"));
        assert!(place("figure-gap") < place("figure-level"));
        campaign.alarms.clear();
        let page = trends(&campaign).expect("drawn").into_string();
        assert!(page.contains("<details id=\"figure-z100.peak_ratio\">"), "{page}");
    }

    #[test]
    fn only_what_changed_is_drawn_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut campaign = campaign(folder.path());
        trends(&campaign).expect("drawn");
        let old = folder.path().join("charts/gap-cell-focus=left.svg");
        let all = folder.path().join("charts/gap-all-cells.svg");
        for path in [&old, &all] {
            std::fs::write(path, "as it was").expect("written");
        }
        let points = campaign.charts.get_mut(GAP).expect("charts");
        let last =
            points.iter_mut().rfind(|point| point.scope == Scope::AllCells).expect("a point");
        last.value.value += 0.01;
        trends(&campaign).expect("drawn");
        assert_eq!(std::fs::read_to_string(old).expect("a file"), "as it was");
        assert!(std::fs::read_to_string(all).expect("a file").contains("<svg"));
    }

    #[test]
    fn the_reason_why_there_are_no_charts_is_said() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut campaign = campaign(folder.path());
        (campaign.charts, campaign.why_no_charts) =
            (BTreeMap::new(), Some("no baseline".to_owned()));
        assert!(
            trends(&campaign)
                .expect("drawn")
                .into_string()
                .contains("There are no control charts: no baseline.")
        );
    }
}
