//! `fieldgap campaign run` and `resume`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use jiff::Timestamp;
use miette::IntoDiagnostic;
use tokio::sync::watch;

use super::laboratory::{ThisLaboratory, figures_of};
use super::news::Teller;
use crate::cli::ENDED_PARTIAL;
use crate::cli::exposure::Foreseen;
use crate::cli::gap::GapLimit;
use crate::cli::output::{fresh_folder, print_json, say};
use crate::cli::permission::{Act, Permission};
use crate::cli::stop::StopRequests;
use crate::cli::trust::{Trust, listed, programs};
use crate::rig_file::RigFile;
use fieldgap_campaign::{
    Campaign, CampaignEnd, CampaignFolder, CellStatus, Forecast, GAP, Overview, Runner, Selection,
    followed, fresh_seed,
};
use fieldgap_records::{HookCommand, Hooks};

/// The `run` command.
#[derive(Debug, Args)]
pub(super) struct Run {
    /// File of the campaign
    file: PathBuf,
    /// Folder for the campaign [default: out/NAME, with the name in the file]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Only check every cell, and print how many there are, how long they take, and what a person is asked
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    common: Common,
}

/// The `resume` command.
#[derive(Debug, Args)]
pub(super) struct Resume {
    /// Folder of the campaign
    folder: PathBuf,
    /// Only try the cells again that failed
    #[arg(long)]
    failed: bool,
    /// Only measure the cells again that were changed in the file; their records so far are kept beside
    #[arg(long, conflicts_with = "failed")]
    changed: bool,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Args)]
struct Common {
    #[command(flatten)]
    permission: Permission,
    #[command(flatten)]
    trust: Trust,
    #[command(flatten)]
    limit: GapLimit,
    /// Print what happens as lines of JSON
    #[arg(long)]
    json: bool,
}

impl Run {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let campaign = Campaign::read(&self.file)?;
        let seed = campaign.seed.map_or_else(fresh_seed, Ok).into_diagnostic()?;
        let agreed = self.common.checked(&campaign, seed, self.dry_run)?;
        let Some(agreed) = agreed else { return Ok(ExitCode::SUCCESS) };
        let path = self.out.unwrap_or_else(|| fresh_folder(&campaign.name));
        let folder = CampaignFolder::begin(&campaign, &path, seed, Timestamp::now())?;
        say(format!("campaign: {}", path.display()));
        self.common.conduct(&campaign, folder, Selection::Open, agreed)
    }
}

impl Resume {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let campaign = CampaignFolder::campaign(&self.folder)?;
        let mut folder = CampaignFolder::open(&self.folder)?;
        let agreed = self.common.checked(&campaign, folder.state().seed, false)?;
        let Some(agreed) = agreed else { return Ok(ExitCode::SUCCESS) };
        folder.log(Timestamp::now(), fieldgap_campaign::What::Resumed)?;
        let selection = match (self.failed, self.changed) {
            (true, _) => Selection::Failed,
            (_, true) => Selection::Changed,
            _ => Selection::Open,
        };
        let changed = changed_cells(&campaign, &folder)?;
        if selection != Selection::Changed && changed > 0 {
            say(format!(
                "{changed} cells that are done would be other ones by the file as it is now; `fieldgap campaign resume {} --changed` measures them again",
                self.folder.display()
            ));
        }
        self.common.conduct(&campaign, folder, selection, agreed)
    }
}

/// Done cells whose plan or rig file is another one now.
fn changed_cells(campaign: &Campaign, folder: &CampaignFolder) -> miette::Result<usize> {
    let follower = followed(campaign, folder.path(), folder.state(), &figures_of)?;
    let overview = Overview::of(campaign, folder.path(), folder.state(), &follower);
    let changed = |status: &CellStatus| matches!(status, CellStatus::Done { changed: true, .. });
    Ok(overview.cells.iter().filter(|cell| changed(&cell.status)).count())
}

impl Common {
    /// Checks every cell, shows what the campaign takes, and asks for permission and trust; the hooks of scans that were agreed to. `None`
    /// after a dry run.
    fn checked(
        &self,
        campaign: &Campaign,
        seed: u64,
        dry_run: bool,
    ) -> miette::Result<Option<Vec<Hooks>>> {
        let forecast = campaign.forecast(seed, Timestamp::now())?;
        for bench in &campaign.benches {
            RigFile::of(bench.setup()?)?.check_truth()?;
        }
        if dry_run && self.json {
            print_json(&forecast)?;
            return Ok(None);
        }
        let mut hooks: Vec<Hooks> = Vec::new();
        for cell in campaign.cells(1, seed) {
            let of_scan = campaign.scan_of(&cell)?.hooks();
            if !hooks.contains(&of_scan) {
                hooks.push(of_scan);
            }
        }
        let named: Vec<(String, HookCommand)> =
            campaign.programs().into_iter().chain(hooks.iter().flat_map(programs)).collect();
        say(in_words(&forecast, campaign));
        if dry_run {
            if let Some(commands) = listed(&named) {
                say(format!("programs that run:\n{commands}"));
            }
            return Ok(None);
        }
        if let Some(exceeds) = &forecast.exceeds {
            say(format!("the campaign will end early: {exceeds}"));
        }
        self.trust.in_programs(&named, "the campaign, its plan or a rig file")?;
        for cell in campaign.cells(1, seed) {
            let scan = campaign.scan_of(&cell)?;
            let foreseen = Foreseen::of_scan(&scan)?;
            self.permission.within_limits(foreseen.as_ref(), scan.rig_setup())?;
        }
        for bench in &campaign.benches {
            self.permission.to(Act::Scan, &bench.setup()?)?;
        }
        Ok(Some(hooks))
    }

    fn conduct(
        self,
        campaign: &Campaign,
        folder: CampaignFolder,
        selection: Selection,
        agreed: Vec<Hooks>,
    ) -> miette::Result<ExitCode> {
        let path = folder.path().to_owned();
        let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
        let ended = runtime.block_on(async {
            let (ask, stop) = watch::channel(None);
            let requests = StopRequests::listen().into_diagnostic()?;
            tokio::spawn(async move {
                let who = requests.first().await;
                let _ = ask.send(Some(who));
                // Whoever waits for a request holds a receiver of this channel.
                ask.closed().await;
            });
            let laboratory = ThisLaboratory {
                teller: Teller::of(campaign, &path, self.json),
                after: campaign.after,
                rigs: campaign.benches.iter().map(|bench| bench.path().to_owned()).collect(),
                agreed,
                stop,
            };
            let runner = Runner::new(campaign, folder, &laboratory, selection)?;
            Ok::<_, miette::Report>(runner.run().await?)
        });
        // The runtime must live on, because it listens for signals until the program ends.
        std::mem::forget(runtime);
        let ended = ended?;
        if !self.json {
            say(format!("page: {}", path.join("index.html").display()));
        }
        match ended {
            CampaignEnd::Early(_) => {
                say(format!(
                    "`fieldgap campaign resume {}` continues the campaign",
                    path.display()
                ));
                Ok(ExitCode::from(ENDED_PARTIAL))
            }
            CampaignEnd::Done => self.judged(campaign, &path),
        }
    }

    /// The exit code of a campaign that is done: by failures, then by the largest gap.
    fn judged(&self, campaign: &Campaign, path: &Path) -> miette::Result<ExitCode> {
        let state = CampaignFolder::read(path)?;
        let follower = followed(campaign, path, &state, &figures_of)?;
        let overview = Overview::of(campaign, path, &state, &follower);
        let [_, failed, open] = overview.counts();
        if failed + open > 0 {
            let option = if failed > 0 { " --failed" } else { "" };
            say(format!(
                "{failed} cells failed and {open} are open; `fieldgap campaign resume {}{option}` tries them again",
                path.display()
            ));
            return Ok(ExitCode::FAILURE);
        }
        let gaps = overview
            .cells
            .iter()
            .filter_map(|cell| Some(cell.run.as_ref()?.figures.get(GAP)?.value));
        let largest = gaps.fold(0.0, f64::max);
        Ok(self.limit.exit_code_of(largest * 100.0, "the largest gap"))
    }
}

fn in_words(forecast: &Forecast, campaign: &Campaign) -> String {
    let time = |seconds: f64| {
        let duration = std::time::Duration::try_from_secs_f64(seconds).unwrap_or_default();
        indicatif::HumanDuration(duration).to_string()
    };
    let mut lines = vec![
        format!(
            "{} cells a round on {}: {} readings, about {}",
            forecast.cells_a_round,
            forecast.rigs.join(", "),
            forecast.readings_a_round,
            time(forecast.round_s)
        ),
        format!(
            "{} rounds: about {} of scanning, {} with the array driven, robot path {:.1} m, {:.1} MiB on disk",
            forecast.rounds,
            time(forecast.used.time_s),
            time(forecast.used.emitting_s),
            forecast.used.way_m,
            forecast.bytes as f64 / f64::from(1 << 20)
        ),
    ];
    let starts: Vec<String> =
        forecast.starts.iter().map(|at| campaign.schedule.show(*at)).collect();
    if forecast.rounds > 1 || !starts.is_empty() {
        let more = if forecast.rounds as usize > starts.len() { ", ..." } else { "" };
        lines.push(format!("rounds begin: {}{more}", starts.join(", ")));
    }
    if !forecast.questions.is_empty() {
        lines.push("a person is asked in each round:".to_owned());
        lines.extend(forecast.questions.iter().map(|question| format!("  {question}")));
    }
    if let Some(exceeds) = &forecast.exceeds {
        lines.push(exceeds.clone());
    }
    lines.join("\n")
}
