//! The page of a campaign: what changed and where, alarms first, then the cells in rows and columns, figures over time, and small maps.
//!
//! It is written again after every cell. Pictures lie beside it, and only those that changed are drawn again.

mod addresses;
mod alarms;
mod cells;
#[cfg(test)]
mod example;
mod facts;
mod headline;
mod kept;
mod map_file;
mod map_pictures;
mod maps;
mod matrix;
mod next_steps;
mod page;
mod shades;
mod trends;

use std::path::PathBuf;

use self::kept::put;
use super::error::ReportError;
use fieldgap_campaign::Overview;

/// Writes the page of a campaign, `index.html`, into its folder, which is created if it is missing; gives the page's path. Control charts lie
/// beside it in `charts`, small maps of the records in `maps`. Every file is replaced as a whole, so that a reader never finds half of one.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written. A record that cannot be read is no error; the page says so.
pub fn write_campaign(overview: &Overview) -> Result<PathBuf, ReportError> {
    let folder = &overview.folder;
    std::fs::create_dir_all(folder).map_err(ReportError::write(folder))?;
    let trends = trends::trends(overview)?;
    let maps = maps::maps(overview)?;
    // The page comes last: what it shows is then there.
    let index = folder.join("index.html");
    put(&index, page::page(overview, &trends, maps).as_bytes())?;
    Ok(index)
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};
    use std::time::Instant;

    use fieldgap_archive::RecordFigures;
    use fieldgap_campaign::{CampaignFolder, CellFigures, CellStatus, followed};
    use fieldgap_monitoring::Run;

    use super::example::{cell, charts, overview};
    use super::*;

    #[test]
    fn the_page_is_written_again_over_the_old_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut campaign = overview();
        campaign.folder = folder.path().join("new");
        let first = write_campaign(&campaign).expect("written");
        assert_eq!(first, campaign.folder.join("index.html"));
        let text = std::fs::read_to_string(&first).expect("a page");
        assert_eq!(
            std::fs::read_to_string(write_campaign(&campaign).expect("written")).expect("a page"),
            text
        );
        campaign.name = "another".to_owned();
        write_campaign(&campaign).expect("written");
        assert!(std::fs::read_to_string(&first).expect("a page").contains("Campaign another"));
    }

    /// The overview of a campaign on disk.
    fn on_disk(folder: &Path) -> Overview {
        let campaign = CampaignFolder::campaign(folder).expect("a campaign");
        let state = CampaignFolder::read(folder).expect("a log");
        let figures_of = |folder: &Path, setting: &str, at| {
            let figures = RecordFigures::read(folder).ok()??;
            let series = figures.series().into_iter().map(|(name, figure)| (name.into(), figure));
            let run = Run {
                cell: setting.to_owned(),
                at: at?,
                temperature_c: None,
                figures: series.collect(),
            };
            Some(CellFigures {
                run,
                verdict: figures.cause.map(|cause| cause.verdict.as_str().to_owned()),
            })
        };
        let follower = followed(&campaign, folder, &state, &figures_of).expect("a baseline");
        Overview::of(&campaign, folder, &state, &follower)
    }

    /// Writes the page of a campaign on disk, and others that are made of its cells, to be looked at:
    /// `FIELDGAP_CAMPAIGN=FOLDER cargo test pages_to_look_at -- --ignored`.
    #[test]
    #[ignore = "writes files to look at"]
    fn pages_to_look_at() {
        let folder = PathBuf::from(
            std::env::var("FIELDGAP_CAMPAIGN").expect("FIELDGAP_CAMPAIGN names a folder"),
        );
        let time = |overview: &Overview, what: &str| {
            let begun = Instant::now();
            write_campaign(overview).expect("written");
            eprintln!("{what}: {:.3} s", begun.elapsed().as_secs_f64());
        };
        let mut real = on_disk(&folder);
        time(&real, "as it is, first");
        time(&real, "as it is, again");
        real.folder = folder.join("alarmed");
        let _ = std::fs::create_dir_all(&real.folder);
        let _ = std::os::unix::fs::symlink(folder.join("cells"), real.folder.join("cells"));
        (real.alarms, real.charts) = (overview().alarms, charts());
        (real.ended, real.not_set, real.rigs_left) =
            (false, overview().not_set, overview().rigs_left);
        for (number, cell) in real.cells.iter_mut().enumerate() {
            cell.gap_change = Some(0.01 * ((number * 7) % 11) as f64 - 0.05);
            cell.verdict = Some(
                ["explained", "mostly-explained", "ambiguous", "unexplained", "none"][number % 5]
                    .to_owned(),
            );
            cell.alarm = number == 17;
            cell.status = match number {
                5 => CellStatus::Failed { reason: "the robot did not answer".to_owned() },
                9 => CellStatus::Done { problem: Some("not compared".to_owned()), changed: true },
                22 => CellStatus::Scanning,
                23 => CellStatus::Open,
                _ => continue,
            };
            if number != 9 {
                cell.run = None;
            }
        }
        time(&real, "with alarms, first");
        // A thousand cells: ten settings by a hundred rounds, each with a record.
        let mut large = overview();
        large.folder = folder.join("large");
        let records: Vec<PathBuf> = std::fs::read_dir(folder.join("cells"))
            .expect("cells")
            .flatten()
            .map(|entry| entry.path())
            .collect();
        large.cells.clear();
        for number in 0..1000u32 {
            let mut one = cell(1 + number / 10, &format!("x={}", number % 10));
            (one.id, one.values) = (format!("cell-{number}"), vec![number as usize % 10]);
            let begin = one.run.as_ref().expect("a run").at.as_second();
            let figures = [
                "gap",
                "level",
                "correlation",
                "z100.focus0.gap",
                "z100.focus0.correlation",
                "z100.focus0.peak_ratio",
            ];
            if let Some(run) = &mut one.run {
                run.at =
                    jiff::Timestamp::from_second(begin + 60 * i64::from(number)).expect("in range");
                let value = |figure: usize| fieldgap_text::Uncertain {
                    value: 0.1 + 0.001 * ((number as usize * (7 + figure)) % 11) as f64,
                    standard_error: 0.004,
                };
                run.figures = figures
                    .iter()
                    .enumerate()
                    .map(|(at, name)| ((*name).to_owned(), value(at)))
                    .collect();
            }
            let to = fieldgap_campaign::cell_folder(&large.folder, &one.id);
            let _ = std::fs::create_dir_all(to.parent().expect("a folder"));
            let _ = std::os::unix::fs::symlink(&records[number as usize % records.len()], to);
            large.cells.push(one);
        }
        let runs: Vec<Run> = large.cells.iter().filter_map(|cell| cell.run.clone()).collect();
        let baseline = fieldgap_monitoring::Baseline::of_runs(&runs[..20], Default::default())
            .expect("a baseline");
        let (_, judged) =
            fieldgap_monitoring::Monitor::replay(Default::default(), &baseline, &runs[20..], &[]);
        let points: Vec<_> = judged.into_iter().map(|one| one.charts).collect();
        let charted = |runs: usize| {
            let mut charts: std::collections::BTreeMap<String, Vec<_>> = Default::default();
            for point in points[..runs - 20].iter().flatten() {
                charts.entry(point.figure.clone()).or_default().push(point.clone());
            }
            charts
        };
        (large.why_no_charts, large.ended, large.rounds) = (None, false, 100);
        let newest = large.cells[999].clone();
        (large.cells[999].status, large.cells[999].run) = (CellStatus::Open, None);
        large.charts = charted(999);
        time(&large, "a thousand cells, first");
        time(&large, "a thousand cells, nothing new");
        large.cells[999] = newest;
        large.charts = charted(1000);
        time(&large, "a thousand cells, one new");
    }
}
