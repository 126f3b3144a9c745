//! The file of a campaign.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use super::bench::{Bench, Document, is_of_rig};
use super::budget::Budget;
use super::condition::{Condition, ConditionTable};
use super::error::CampaignError;
use super::schedule::{Schedule, ScheduleTable};
use fieldgap_input::{Delay, Fault, TomlSource, file_name, literal};
use fieldgap_monitoring::Settings;
use fieldgap_records::{HookCommand, Plan};
use fieldgap_study::{Sweep, SweepTable};

/// Most cells of a round.
const MOST_CELLS: usize = 100_000;

/// Failed cells in a row after which a rig is left alone: one may be chance, and one may be its consequence.
const FAILURES_IN_A_ROW: u32 = 3;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CampaignFile {
    name: Spanned<String>,
    plan: Spanned<PathBuf>,
    rigs: Option<Spanned<Vec<PathBuf>>>,
    #[serde(default)]
    repeats: Repeats,
    #[serde(default)]
    order: Order,
    seed: Option<u64>,
    #[serde(default)]
    axis: Vec<Spanned<SweepTable>>,
    #[serde(default)]
    condition: Vec<Spanned<ConditionTable>>,
    schedule: Option<Spanned<ScheduleTable>>,
    #[serde(default)]
    budget: Budget,
    #[serde(default)]
    after: After,
    #[serde(default)]
    retry: Retry,
    baseline: Option<Spanned<BaselineTable>>,
    alarm: Option<Settings>,
    #[serde(default)]
    hooks: CampaignHooks,
}

/// How often each cell is measured in a round.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "u32")]
struct Repeats(u32);

impl Default for Repeats {
    fn default() -> Self {
        Self(1)
    }
}

impl TryFrom<u32> for Repeats {
    type Error = String;

    fn try_from(repeats: u32) -> Result<Self, String> {
        match repeats {
            1..=1000 => Ok(Self(repeats)),
            _ => Err(format!("{repeats} is not a number of repeats from 1 to 1000")),
        }
    }
}

/// The order of the cells in a round.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// As in the file: conditions, then axes, the last one fastest.
    Given,
    /// All cells in random order; conditions are set as often as that needs.
    Random,
    /// Conditions one after another, the cells of each in random order, so that drift does not pass for an effect.
    #[default]
    Blocked,
}

/// `[after]`: what follows the scan of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct After {
    /// Scan and simulation are compared, and the report is written.
    pub compare: bool,
    /// The cause of the gap is sought.
    pub diagnose: bool,
    /// The rig file is corrected by a named cause, and the cell is scanned once more with it.
    pub apply: bool,
}

impl Default for After {
    fn default() -> Self {
        Self { compare: true, diagnose: false, apply: false }
    }
}

/// `[retry]`: what is tried again.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Retry {
    /// Further attempts at a cell that failed.
    pub attempts: u32,
    /// Wait before each, min.
    pub wait_min: Delay,
    /// Failed cells in a row after which the rig is left alone.
    pub failures_in_a_row: u32,
}

impl Default for Retry {
    fn default() -> Self {
        Self { attempts: 1, wait_min: literal(1.0), failures_in_a_row: FAILURES_IN_A_ROW }
    }
}

/// `[baseline]`, as it is written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct BaselineTable {
    record: Option<PathBuf>,
    campaign: Option<PathBuf>,
    rounds: Option<u32>,
}

/// What later runs are compared with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BaselineSource {
    /// The first rounds of this campaign.
    FirstRounds(u32),
    /// One record.
    Record(PathBuf),
    /// All cells of another campaign.
    Campaign(PathBuf),
}

/// `[hooks]`: programs that are told of the campaign.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CampaignHooks {
    /// A cell was measured and compared.
    pub on_cell: Option<HookCommand>,
    /// A figure left its limits.
    pub on_alarm: Option<HookCommand>,
    /// A cell failed, or a rig is left alone.
    pub on_failure: Option<HookCommand>,
    /// A person is needed.
    pub on_question: Option<HookCommand>,
    /// The campaign ended.
    pub on_finish: Option<HookCommand>,
}

impl CampaignHooks {
    fn each(&self) -> [(&'static str, &Option<HookCommand>); 5] {
        [
            ("on_cell", &self.on_cell),
            ("on_alarm", &self.on_alarm),
            ("on_failure", &self.on_failure),
            ("on_question", &self.on_question),
            ("on_finish", &self.on_finish),
        ]
    }

    fn beside(self, folder: &Path) -> Self {
        let beside = |command: Option<HookCommand>| command.map(|command| command.beside(folder));
        Self {
            on_cell: beside(self.on_cell),
            on_alarm: beside(self.on_alarm),
            on_failure: beside(self.on_failure),
            on_question: beside(self.on_question),
            on_finish: beside(self.on_finish),
        }
    }
}

/// An axis: keys of plan or rig file, and their values.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Short name in names of cells and on pages.
    pub name: String,
    /// The keys and their values.
    pub sweep: Sweep,
}

/// A campaign.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// Its name; a valid file name.
    pub name: String,
    /// The rigs it runs on, at least one, with different names.
    pub benches: Vec<Bench>,
    /// The axes; none for one setting.
    pub axes: Vec<Axis>,
    /// The conditions.
    pub conditions: Vec<Condition>,
    /// How often each cell is measured in a round.
    pub repeats: u32,
    /// The order of the cells.
    pub order: Order,
    /// Seed of the order; by default one is drawn when the campaign begins, and kept.
    pub seed: Option<u64>,
    /// When rounds and cells begin.
    pub schedule: Schedule,
    /// What may be used.
    pub budget: Budget,
    /// What follows each scan.
    pub after: After,
    /// What is tried again.
    pub retry: Retry,
    /// What later runs are compared with.
    pub baseline: BaselineSource,
    /// How rare false alarms are.
    pub alarm: Settings,
    /// Programs that are told.
    pub hooks: CampaignHooks,
    /// The base plan's name.
    pub(super) plan_name: String,
    pub(super) plan: Document,
    source: TomlSource,
}

impl Campaign {
    /// Reads the file of a campaign, its plan and its rig files. Paths are relative to the file's folder.
    ///
    /// # Errors
    /// A [`Fault`] at the first key that is wrong.
    pub fn read(path: &Path) -> Result<Self, CampaignError> {
        Self::parse(TomlSource::read(path)?)
    }

    /// Reads the text of a campaign's file.
    ///
    /// # Errors
    /// As [`Campaign::read`].
    pub fn parse(source: TomlSource) -> Result<Self, CampaignError> {
        let file: CampaignFile = source.parse()?;
        let folder = source.path().parent().unwrap_or(Path::new("")).to_owned();
        let name = file_name(&file.name, "the folder of the campaign", &source)?;
        let plan_path = folder.join(file.plan.get_ref());
        let plan_source = TomlSource::read(&plan_path).map_err(|fault| {
            source.fault(
                file.plan.span(),
                fault.to_string(),
                "give the path of a plan, relative to this file's folder",
            )
        })?;
        let plan = Plan::parse(plan_source.clone())?;
        let rigs = rig_paths(&file, &folder, &plan, &source)?;
        let benches =
            rigs.iter().map(|path| Bench::read(path)).collect::<Result<Vec<_>, Fault>>()?;
        if let Some(twice) = twice(benches.iter().map(|bench| bench.name.as_str())) {
            let place = file.rigs.as_ref().map_or(0..0, Spanned::span);
            let problem = format!("two rigs have the name `{twice}`");
            return Err(source
                .fault(place, problem, "give each rig file a `name` of its own")
                .into());
        }
        let axes = axes(&file.axis, &source)?;
        let conditions = file
            .condition
            .iter()
            .map(|table| Ok(Condition::read(table, &source)?.beside(&folder)))
            .collect::<Result<Vec<_>, Fault>>()?;
        let names = axes.iter().map(|axis| axis.name.as_str());
        if let Some(twice) = twice(names.chain(conditions.iter().map(|one| one.name.as_str()))) {
            let problem = format!("two axes or conditions have the name `{twice}`");
            let place = file.axis.first().map_or(0..0, Spanned::span);
            return Err(source.fault(place, problem, "give one of them another `name`").into());
        }
        let schedule = file.schedule.as_ref();
        let schedule = schedule
            .map_or_else(|| ScheduleTable::default().read(), |table| table.get_ref().read());
        let schedule = schedule.map_err(|wrong| {
            let place = file.schedule.as_ref().map_or(0..0, Spanned::span);
            source.fault(place, wrong.to_string(), wrong.remedy)
        })?;
        if file.after.apply && !file.after.diagnose {
            let problem = "`apply` in [after] needs a cause, and `diagnose` is not set";
            return Err(Fault::of_file(
                source.path(),
                problem,
                "write diagnose = true, or remove apply",
            )
            .into());
        }
        let keys = axes.iter().flat_map(|axis| &axis.sweep.parameters);
        let keys = keys.chain(conditions.iter().filter_map(|one| one.sets.as_ref()));
        let into_rig = keys.into_iter().find(|key| is_of_rig(key));
        if let (true, Some(key)) = (file.after.apply, into_rig) {
            let problem = format!(
                "`apply` in [after] corrects the rig file, and `{key}` is written into it for each cell"
            );
            return Err(Fault::of_file(
                source.path(),
                problem,
                "remove `apply`, or that axis or `sets`",
            )
            .into());
        }
        let baseline = baseline(file.baseline.as_ref(), &folder, &schedule, &source)?;
        let campaign = Self {
            name,
            benches,
            axes,
            conditions,
            repeats: file.repeats.0,
            order: file.order,
            seed: file.seed,
            schedule,
            budget: file.budget,
            after: file.after,
            retry: file.retry,
            baseline,
            alarm: file.alarm.unwrap_or_default(),
            hooks: file.hooks.beside(&folder),
            plan_name: plan.name,
            plan: Document::read(&plan_source)?,
            source,
        };
        campaign.cells_can_be_told_apart()?;
        Ok(campaign)
    }

    /// The file.
    pub fn source(&self) -> &TomlSource {
        &self.source
    }

    /// Every program that the file names, with the name of its key.
    pub fn programs(&self) -> Vec<(String, HookCommand)> {
        let hooks = self.hooks.each().into_iter();
        let hooks = hooks.filter_map(|(key, command)| Some((key.to_owned(), command.clone()?)));
        hooks.chain(self.conditions.iter().flat_map(Condition::programs)).collect()
    }

    fn cells_can_be_told_apart(&self) -> Result<(), Fault> {
        let count = self
            .settings_of_a_round()
            .saturating_mul(self.benches.len())
            .saturating_mul(self.repeats as usize);
        if count > MOST_CELLS {
            let problem = format!("a round has {count} cells; at most {MOST_CELLS} are possible");
            return Err(Fault::of_file(self.source.path(), problem, "give fewer values"));
        }
        for axis in &self.axes {
            let labels = axis.sweep.values.iter().map(|value| value.label.as_str());
            if let Some(twice) = twice(labels) {
                let problem = format!("the axis has the value {twice} twice");
                return Err(self.source.fault(
                    axis.sweep.place.clone(),
                    problem,
                    "use `repeats` to measure a cell several times, or give `labels`",
                ));
            }
        }
        for condition in &self.conditions {
            if let Some(twice) = twice(condition.values.iter().map(|value| value.label.as_str())) {
                let problem = format!("the condition has the value {twice} twice");
                return Err(self.source.fault(
                    condition.place.clone(),
                    problem,
                    "remove one of the two",
                ));
            }
        }
        Ok(())
    }

    /// Combinations of conditions and axes.
    pub(super) fn settings_of_a_round(&self) -> usize {
        let conditions = self.conditions.iter().map(|one| one.values.len());
        let axes = self.axes.iter().map(|axis| axis.sweep.values.len());
        conditions.chain(axes).fold(1, usize::saturating_mul)
    }
}

fn rig_paths(
    file: &CampaignFile,
    folder: &Path,
    plan: &Plan,
    source: &TomlSource,
) -> Result<Vec<PathBuf>, Fault> {
    match &file.rigs {
        Some(rigs) if rigs.get_ref().is_empty() => Err(source.fault(
            rigs.span(),
            "the list is empty",
            "name at least one rig file, or remove `rigs`",
        )),
        Some(rigs) => {
            let path = |rig: &PathBuf| {
                let path = folder.join(rig);
                if path.is_file() {
                    return Ok(path);
                }
                let problem = format!("there is no rig file {}", path.display());
                Err(source.fault(rigs.span(), problem, "paths are relative to this file's folder"))
            };
            rigs.get_ref().iter().map(path).collect()
        }
        None => Ok(vec![fieldgap_acquisition::rig_of(plan, None)?]),
    }
}

fn axes(tables: &[Spanned<SweepTable>], source: &TomlSource) -> Result<Vec<Axis>, Fault> {
    let document = Document::read(source)?;
    let items = document.tables("axis");
    let axes = tables.iter().zip(items).map(|(table, item)| {
        let sweep = Sweep::read(table, item, source)?;
        let name = sweep.given_name.clone().unwrap_or_else(|| short_name(&sweep));
        Ok(Axis { name, sweep })
    });
    axes.collect()
}

/// The last part of the key; of several keys that of the first, without the axis of a coordinate.
fn short_name(sweep: &Sweep) -> String {
    let first = &sweep.parameters[0];
    let last = first.rsplit('.').next().unwrap_or(first);
    match first.split('.').next() {
        Some(section) if sweep.parameters.len() > 1 => section.to_owned(),
        _ => last.to_owned(),
    }
}

fn baseline(
    table: Option<&Spanned<BaselineTable>>,
    folder: &Path,
    schedule: &Schedule,
    source: &TomlSource,
) -> Result<BaselineSource, Fault> {
    let Some(table) = table else { return Ok(BaselineSource::FirstRounds(1)) };
    let fault = |problem: String| {
        Err(source.fault(
            table.span(),
            problem,
            "write one of record = \"DIR\", campaign = \"DIR\" and rounds = 1",
        ))
    };
    match table.get_ref() {
        BaselineTable { record: Some(record), campaign: None, rounds: None } => {
            Ok(BaselineSource::Record(folder.join(record)))
        }
        BaselineTable { record: None, campaign: Some(campaign), rounds: None } => {
            Ok(BaselineSource::Campaign(folder.join(campaign)))
        }
        BaselineTable { record: None, campaign: None, rounds } => match rounds.unwrap_or(1) {
            rounds if (1..=schedule.rounds).contains(&rounds) => {
                Ok(BaselineSource::FirstRounds(rounds))
            }
            rounds => {
                fault(format!("a baseline of {rounds} rounds in a campaign of {}", schedule.rounds))
            }
        },
        _ => fault("the baseline is given twice".to_owned()),
    }
}

/// The first that stands there twice.
fn twice<'a>(names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let mut seen = std::collections::HashSet::new();
    names.into_iter().find(|name| !seen.insert(*name))
}
