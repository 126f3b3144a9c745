//! What a campaign tells: lines for a person, lines of JSON for a program, and hooks.

use std::path::Path;

use jiff::Timestamp;
use serde_json::{Value, json};

use crate::cli::output::{json_line, print, say};
use fieldgap_acquisition::{HOOK_TIME_LIMIT, run_hook};
use fieldgap_campaign::{Campaign, CampaignHooks, GAP, News, Schedule};
use fieldgap_monitoring::Run;
use fieldgap_records::HookCommand;

/// Environment variables of a hook, by name.
type Variables = Vec<(&'static str, String)>;

/// Tells what happens in a campaign.
pub(super) struct Teller {
    pub(super) folder: std::path::PathBuf,
    pub(super) hooks: CampaignHooks,
    pub(super) schedule: Schedule,
    pub(super) json: bool,
}

impl Teller {
    pub(super) fn of(campaign: &Campaign, folder: &Path, json: bool) -> Self {
        let (hooks, schedule) = (campaign.hooks.clone(), campaign.schedule.clone());
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        Self { folder, hooks, schedule, json }
    }

    /// Shows news, and starts the hook for them.
    pub(super) async fn tell(&self, news: &News<'_>) {
        if self.json {
            if let Ok(line) = json_line(&in_json(news)) {
                // The reader may have gone; the campaign goes on.
                let _ = print(&line);
            }
        } else {
            say(self.in_words(news));
        }
        let Some((hook, event, variables)) = self.hook(news) else { return };
        let common = [
            ("FIELDGAP_EVENT", event.to_owned()),
            ("FIELDGAP_CAMPAIGN", self.folder.display().to_string()),
            ("FIELDGAP_MESSAGE", self.in_words(news)),
        ];
        let variables: Vec<(&str, String)> = common.into_iter().chain(variables).collect();
        if let Err(fault) = run_hook(hook, &variables, HOOK_TIME_LIMIT).await {
            say(format!("the hook on_{event} did not run: {fault}"));
        }
    }

    /// The hook for these news, its event, and what it is told beside the message.
    fn hook(&self, news: &News<'_>) -> Option<(&HookCommand, &'static str, Variables)> {
        let hooks = &self.hooks;
        let (hook, event, variables) = match news {
            News::Closed { folder, run, gap_change, .. } => {
                let mut variables = of_record(folder, *run);
                if let Some(change) = gap_change {
                    variables
                        .push(("FIELDGAP_GAP_CHANGE_PERCENT", format!("{:.2}", change * 100.0)));
                }
                (&hooks.on_cell, "cell", variables)
            }
            News::Alarm { folder, alarm, cause, run } => {
                let mut variables = of_record(folder, Some(run));
                variables.push(("FIELDGAP_ALARM", alarm.to_string()));
                variables.push(("FIELDGAP_ALARM_FIGURE", alarm.figure.clone()));
                if let Some(relative) = alarm.relative {
                    variables.push((
                        "FIELDGAP_CHANGE_PERCENT",
                        format!("{:.2}", relative.value * 100.0),
                    ));
                }
                variables.extend(cause.map(|cause| ("FIELDGAP_CAUSE", cause.to_owned())));
                (&hooks.on_alarm, "alarm", variables)
            }
            News::Failed(..) | News::RigLeft(..) | News::NotSet(..) => {
                (&hooks.on_failure, "failure", Vec::new())
            }
            News::Ended(_) => (&hooks.on_finish, "finish", Vec::new()),
            News::Round(_) | News::Waits(..) | News::Set(..) | News::Begins(_) => return None,
        };
        Some((hook.as_ref()?, event, variables))
    }

    /// Starts the hook that calls a person.
    pub(super) async fn question(&self, text: &str) {
        let Some(hook) = &self.hooks.on_question else { return };
        let variables = [
            ("FIELDGAP_EVENT", "question".to_owned()),
            ("FIELDGAP_CAMPAIGN", self.folder.display().to_string()),
            ("FIELDGAP_MESSAGE", text.to_owned()),
        ];
        if let Err(fault) = run_hook(hook, &variables, HOOK_TIME_LIMIT).await {
            say(format!("the hook on_question did not run: {fault}"));
        }
    }

    fn in_words(&self, news: &News<'_>) -> String {
        let at = |at: Timestamp| self.schedule.show(at);
        match news {
            News::Round(round) => format!("round {round} of {}", self.schedule.rounds),
            News::Waits(until, what) => format!("waiting until {} {what}", at(*until)),
            News::Set(condition, value, None) => format!("{} is {}", condition.name, value.label),
            News::Set(condition, value, Some(reading)) => {
                format!("{} is {} (read: {reading})", condition.name, value.label)
            }
            News::NotSet(condition, value, reason) => {
                format!(
                    "{} cannot be {}; its cells are left out: {reason}",
                    condition.name, value.label
                )
            }
            News::Begins(cell) => format!("{cell}: scanning"),
            News::Closed { folder, run, gap_change, problem } => {
                let name = folder.file_name().unwrap_or_default().to_string_lossy();
                let gap = run.and_then(|run| run.figures.get(GAP));
                let gap =
                    gap.map_or("done".to_owned(), |gap| format!("gap {:.2} %", gap.value * 100.0));
                let change = gap_change.map_or(String::new(), |change| {
                    format!(", {:+.1} % of the baseline's", change * 100.0)
                });
                let problem = problem.map_or(String::new(), |problem| format!("; {problem}"));
                format!("{name}: {gap}{change}{problem}")
            }
            News::Failed(cell, reason) => format!("{cell}: failed: {reason}"),
            News::Alarm { alarm, cause, .. } => {
                let cause = cause.map_or(String::new(), |cause| format!(". {cause}"));
                format!("ALARM: {alarm}{cause}")
            }
            News::RigLeft(rig, reason) => {
                format!("{rig} is left alone until the campaign is resumed: {reason}")
            }
            News::Ended(None) => "the campaign is done".to_owned(),
            News::Ended(Some(reason)) => format!("the campaign ended early: {reason}"),
        }
    }
}

fn of_record(folder: &Path, run: Option<&Run>) -> Variables {
    // A hook may work in another folder.
    let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    let mut variables = vec![
        ("FIELDGAP_SCAN", folder.display().to_string()),
        ("FIELDGAP_REPORT", folder.join("report/index.html").display().to_string()),
    ];
    let gap = run.and_then(|run| run.figures.get(GAP));
    variables.extend(gap.map(|gap| ("FIELDGAP_GAP_PERCENT", format!("{:.3}", gap.value * 100.0))));
    variables
}

fn in_json(news: &News<'_>) -> Value {
    match news {
        News::Round(round) => json!({ "event": "round", "round": round }),
        News::Waits(until, what) => json!({ "event": "waits", "until": until, "for": what }),
        News::Set(condition, value, reading) => json!({
            "event": "set", "condition": condition.name, "value": value.label, "reading": reading,
        }),
        News::NotSet(condition, value, reason) => json!({
            "event": "not-set", "condition": condition.name, "value": value.label, "reason": reason,
        }),
        News::Begins(cell) => json!({ "event": "begins", "cell": cell }),
        News::Closed { folder, run, gap_change, problem } => json!({
            "event": "closed", "record": folder, "figures": run.map(|run| &run.figures),
            "gap_change": gap_change, "problem": problem,
        }),
        News::Failed(cell, reason) => json!({ "event": "failed", "cell": cell, "reason": reason }),
        News::Alarm { folder, alarm, cause, .. } => json!({
            "event": "alarm", "record": folder, "alarm": alarm, "sentence": alarm.to_string(), "cause": cause,
        }),
        News::RigLeft(rig, reason) => json!({ "event": "rig-left", "rig": rig, "reason": reason }),
        News::Ended(reason) => json!({ "event": "ended", "reason": reason }),
    }
}
