//! Answers of Slurm's commands. A line that is none of theirs, such as a site's greeting, is left out.

use super::numbers::TaskNumbers;
use super::task_state::{TaskReport, TaskState};

/// The format that `squeue` is asked for: array job, task numbers, state, reason.
pub(super) const SQUEUE_FORMAT: &str = "%F|%K|%T|%r";

/// The job number in the answer of `sbatch --parsable`: `NUMBER` or `NUMBER;CLUSTER`, on the last line that has this form.
pub fn parse_job_id(text: &str) -> Option<u64> {
    text.lines().rev().find_map(|line| line.trim().split(';').next()?.parse().ok())
}

/// Tasks of a job in the answer of `squeue --noheader --format='%F|%K|%T|%r'`.
pub fn parse_squeue(text: &str, job: u64) -> Vec<TaskReport> {
    let report = |line: &str| {
        let mut parts = line.trim().splitn(4, '|');
        let own = parts.next()?.trim().parse() == Ok(job);
        let tasks = parts.next()?.parse().ok()?;
        let state = TaskState::parse(parts.next()?)?;
        let reason = parts.next().unwrap_or_default().trim();
        let reason = if reason == "None" { "" } else { reason }.to_owned();
        own.then_some(TaskReport { tasks, state, reason })
    };
    text.lines().filter_map(report).collect()
}

/// Tasks of a job in the answer of `sacct --noheader --parsable2 --allocations --format=JobID,State`.
pub fn parse_sacct(text: &str, job: u64) -> Vec<TaskReport> {
    let report = |line: &str| {
        let (id, state) = line.trim().split_once('|')?;
        let (own, tasks) = id.split_once('_')?;
        let state = TaskState::parse(state)?;
        let tasks = tasks.parse().ok()?;
        (own.parse() == Ok(job)).then_some(TaskReport { tasks, state, reason: String::new() })
    };
    text.lines().filter_map(report).collect()
}

/// Tasks of a job in the answer of `scontrol show job`: paragraphs of `Key=Value`.
pub fn parse_scontrol(text: &str, job: u64) -> Vec<TaskReport> {
    let report = |paragraph: &[&str]| {
        let value = |key: &str| {
            let mut words = paragraph.iter().flat_map(|line| line.split_whitespace());
            words.find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
        };
        let own = value("ArrayJobId")?.parse() == Ok(job);
        let tasks: TaskNumbers = value("ArrayTaskId")?.parse().ok()?;
        let state = TaskState::parse(value("JobState")?)?;
        let reason = value("Reason").filter(|reason| *reason != "None").unwrap_or_default();
        own.then(|| TaskReport { tasks, state, reason: reason.to_owned() })
    };
    let lines: Vec<&str> = text.lines().collect();
    lines.split(|line| line.trim().is_empty()).filter_map(report).collect()
}

/// The value of a key in the answer of `scontrol show config`.
pub fn parse_config<'t>(text: &'t str, key: &str) -> Option<&'t str> {
    text.lines().find_map(|line| {
        let (found, value) = line.split_once('=')?;
        (found.trim() == key).then(|| value.trim())
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn told(reports: &[TaskReport]) -> Vec<String> {
        let one =
            |report: &TaskReport| format!("{} {:?} {}", report.tasks, report.state, report.reason);
        reports.iter().map(one).collect()
    }

    #[test]
    fn job_numbers() {
        assert_eq!(parse_job_id("4711\n"), Some(4711));
        assert_eq!(parse_job_id("Welcome to the cluster\n4711;north\n"), Some(4711));
        assert_eq!(parse_job_id("sbatch: error\n"), None);
        assert_eq!(parse_job_id(""), None);
    }

    #[test]
    fn squeue_with_others_and_greetings() {
        let text = "Welcome | to | the cluster\n7|0|RUNNING|None\n7|3-5,9%2|PENDING|JobArrayTaskLimit\n8|1|RUNNING|None\n\
                    7|6|NODE_FAIL|NodeDown\n7|N/A|PENDING|None\n7|8|UNHEARD_OF|None\n";
        let expected =
            ["0 Running ", "3-5,9 Waiting JobArrayTaskLimit", "6 Failed(\"NODE_FAIL\") NodeDown"];
        assert_eq!(told(&parse_squeue(text, 7)), expected);
    }

    #[test]
    fn sacct_with_steps_and_cancelled_ones() {
        let text = "7_0|COMPLETED\n7_1|CANCELLED by 1000\n7_[2-4%2]|PENDING\n8_0|FAILED\n7_0.batch|COMPLETED\n7|FAILED\n";
        let expected = ["0 Completed ", "1 Failed(\"CANCELLED\") ", "2-4 Waiting "];
        assert_eq!(told(&parse_sacct(text, 7)), expected);
    }

    #[test]
    fn scontrol_in_paragraphs() {
        let text = "JobId=9 ArrayJobId=7 ArrayTaskId=2 JobName=a b\n   UserId=root(0) GroupId=root(0)\n   \
                    JobState=FAILED Reason=NonZeroExitCode Dependency=(null)\n\nJobId=7 ArrayJobId=7 ArrayTaskId=4-6%2\n   \
                    JobState=PENDING Reason=Resources\n\nJobId=3\n   JobState=RUNNING Reason=None\n";
        let expected = ["2 Failed(\"FAILED\") NonZeroExitCode", "4-6 Waiting Resources"];
        assert_eq!(told(&parse_scontrol(text, 7)), expected);
        assert_eq!(
            told(&parse_scontrol("slurm_load_jobs error: Invalid job id specified", 7)),
            [""; 0]
        );
    }

    #[test]
    fn values_of_the_configuration() {
        let text =
            "Configuration data as of 2026\nMaxArraySize            = 1001\nMaxJobCount = 10000\n";
        assert_eq!(parse_config(text, "MaxArraySize"), Some("1001"));
        assert_eq!(parse_config(text, "MaxArray"), None);
    }

    proptest! {
        #[test]
        fn any_answer_is_read(text in "([0-9]{1,3}[|_;= ]|RUNNING|PENDING|ArrayTaskId=|ArrayJobId=7|JobState=|\n|[-,%:]|.){0,60}") {
            let job = 7;
            for reports in [parse_squeue(&text, job), parse_sacct(&text, job), parse_scontrol(&text, job)] {
                prop_assert!(reports.iter().all(|report| !report.tasks.is_empty()));
            }
            let _ = (parse_job_id(&text), parse_config(&text, "MaxArraySize"));
        }

        #[test]
        fn every_task_of_an_answer_is_found(numbers in prop::collection::btree_set(0u32..2000, 1..50)) {
            let lines: String = numbers.iter().map(|number| format!("7|{number}|RUNNING|None\n")).collect();
            let reports = parse_squeue(&lines, 7);
            prop_assert_eq!(reports.len(), numbers.len());
            prop_assert!(numbers.iter().all(|&number| reports.iter().any(|report| report.tasks.contains(number))));
        }
    }
}
