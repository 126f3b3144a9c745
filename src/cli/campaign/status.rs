//! `fieldgap campaign status`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use jiff::Timestamp;
use serde::Serialize;

use super::laboratory::{figures_of, reanalysed_figures_of};
use super::person::open_question;
use crate::cli::output::{print, print_json};
use fieldgap_campaign::{Campaign, CampaignFolder, CellStatus, Overview, followed};
use fieldgap_reanalysis::ReanalysisName;

/// The `status` command.
#[derive(Debug, Args)]
pub(super) struct Status {
    /// Folder of the campaign
    folder: PathBuf,
    /// Print everything as JSON, each cell with its figures
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct StatusJson {
    running: bool,
    next_round: Option<Timestamp>,
    done: usize,
    failed: usize,
    open: usize,
    #[serde(flatten)]
    overview: Overview,
}

/// A campaign's file, and its overview, as they are now; with the figures of a reanalysis in place of those of the cells' reports if its name is given.
pub(super) fn overview_of(
    folder: &Path,
    reanalysis: Option<&ReanalysisName>,
) -> miette::Result<(Campaign, Overview)> {
    let campaign = CampaignFolder::campaign(folder)?;
    let state = CampaignFolder::read(folder)?;
    let figures = |record: &Path, setting: &str, at| match reanalysis {
        Some(name) => reanalysed_figures_of(record, name, setting, at),
        None => figures_of(record, setting, at),
    };
    let follower = followed(&campaign, folder, &state, &figures)?;
    let mut overview = Overview::of(&campaign, folder, &state, &follower);
    if CampaignFolder::is_running(folder) {
        overview.question = open_question(folder).map(|question| question.text);
    }
    Ok((campaign, overview))
}

impl Status {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let (campaign, overview) = overview_of(&self.folder, None)?;
        let running = CampaignFolder::is_running(&self.folder);
        let [done, failed, open] = overview.counts();
        let next_round = next_round(&campaign, &overview, open);
        if self.json {
            print_json(&StatusJson { running, next_round, done, failed, open, overview })?;
            return Ok(ExitCode::SUCCESS);
        }
        let mut lines = vec![format!(
            "{}: round {} of {}, {done} cells done, {failed} failed, {open} open; {}",
            overview.name,
            overview.rounds_begun.len(),
            overview.rounds,
            if running { "running" } else { "not running" }
        )];
        if let Some(question) = &overview.question {
            lines.push(format!("waits for an answer: {question}"));
            lines.push(format!("  `fieldgap campaign answer {} yes`", self.folder.display()));
        }
        lines.extend(next_round.map(|at| format!("next round: {}", campaign.schedule.show(at))));
        lines.extend(overview.ended_early.iter().map(|reason| format!("ended early: {reason}")));
        for alarm in overview.alarms.iter().filter(|alarm| alarm.open) {
            lines.push(format!("ALARM in {}: {}", alarm.cell, alarm.sentence));
            lines.extend(alarm.cause.iter().map(|cause| format!("  {cause}")));
        }
        lines.extend(
            overview.rigs_left.iter().map(|(rig, reason)| format!("{rig} is left alone: {reason}")),
        );
        lines.extend(overview.not_set.iter().map(|reason| format!("not set: {reason}")));
        for cell in &overview.cells {
            match &cell.status {
                CellStatus::Failed { reason } => {
                    lines.push(format!("failed: {}: {reason}", cell.id))
                }
                CellStatus::Done { problem: Some(problem), .. } => {
                    lines.push(format!("not compared: {}: {problem}", cell.id));
                }
                CellStatus::Done { changed: true, .. } => {
                    lines.push(format!("changed in the file since: {}", cell.id));
                }
                _ => {}
            }
        }
        print(&(lines.join("\n") + "\n"))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// When the next round begins; `None` while one has open cells, or after the last.
fn next_round(campaign: &Campaign, overview: &Overview, open: usize) -> Option<Timestamp> {
    let begun = overview.rounds_begun.len() as u32;
    if begun >= overview.rounds || (begun > 0 && open > 0) {
        return None;
    }
    campaign.schedule.start_from(overview.began?, Timestamp::now())
}
