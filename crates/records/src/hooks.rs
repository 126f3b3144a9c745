//! `[hooks]` and `[alarm]` of a plan or a rig file: programs that notify a person, and when.

use std::path::Path;

use serde::{Deserialize, Serialize};

use fieldgap_input::Time;

/// `[hooks]`: programs that are started at events of a scan.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hooks {
    /// The scan ended before its last point.
    on_failure: Option<HookCommand>,
    /// The scan is complete.
    on_finish: Option<HookCommand>,
    /// The scan needs a person; meanwhile it continues or waits.
    on_question: Option<HookCommand>,
}

/// The event that a hook is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum HookKind {
    /// The scan ended before its last point.
    Failure,
    /// The scan is complete.
    Finish,
    /// The scan needs a person.
    Question,
}

impl HookKind {
    /// Its name in the variable `FIELDGAP_EVENT`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Failure => "failure",
            Self::Finish => "finish",
            Self::Question => "question",
        }
    }
}

impl Hooks {
    /// The program for a kind of event.
    pub fn command(&self, kind: HookKind) -> Option<&HookCommand> {
        match kind {
            HookKind::Failure => self.on_failure.as_ref(),
            HookKind::Finish => self.on_finish.as_ref(),
            HookKind::Question => self.on_question.as_ref(),
        }
    }

    /// The same hooks, with relative paths of programs resolved from a folder.
    pub fn beside(&self, folder: &Path) -> Self {
        let beside = |command: &Option<HookCommand>| Some(command.clone()?.beside(folder));
        Self {
            on_failure: beside(&self.on_failure),
            on_finish: beside(&self.on_finish),
            on_question: beside(&self.on_question),
        }
    }

    /// The same hooks, with missing ones taken from `others`.
    pub fn or(&self, others: &Self) -> Self {
        let or = |one: &Option<HookCommand>, other: &Option<HookCommand>| {
            one.as_ref().or(other.as_ref()).cloned()
        };
        Self {
            on_failure: or(&self.on_failure, &others.on_failure),
            on_finish: or(&self.on_finish, &others.on_finish),
            on_question: or(&self.on_question, &others.on_question),
        }
    }
}

/// A program and its arguments. It is started without a shell: nothing is expanded or piped.
///
/// Written as a list of words, or as one line that is split at spaces outside quotes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Vec<String>")]
pub struct HookCommand {
    program: String,
    arguments: Vec<String>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Written {
    Line(String),
    Words(Vec<String>),
}

impl TryFrom<Written> for HookCommand {
    type Error = String;
    fn try_from(written: Written) -> Result<Self, String> {
        let words = match written {
            Written::Words(words) => words,
            Written::Line(line) => shlex::split(&line)
                .ok_or_else(|| format!("`{line}` has an opening quote without a closing one"))?,
        };
        if words.iter().any(|word| word.contains('\0')) {
            return Err("a word of a command cannot contain a zero byte".to_owned());
        }
        let mut words = words.into_iter();
        match words.next().filter(|program| !program.is_empty()) {
            Some(program) => Ok(Self { program, arguments: words.collect() }),
            None => Err("the command is empty: name a program".to_owned()),
        }
    }
}

impl From<HookCommand> for Vec<String> {
    fn from(command: HookCommand) -> Self {
        std::iter::once(command.program).chain(command.arguments).collect()
    }
}

impl HookCommand {
    /// The program: a path, or a name to be searched in `PATH`.
    pub fn program(&self) -> &str {
        &self.program
    }

    /// The same command, a relative path of the program resolved from a folder.
    pub fn beside(mut self, folder: &Path) -> Self {
        if self.program.contains('/') {
            self.program = folder.join(&self.program).to_string_lossy().into_owned();
        }
        self
    }

    /// The same command with another text in each argument.
    pub fn with_arguments(mut self, argument: impl Fn(&str) -> String) -> Self {
        self.arguments.iter_mut().for_each(|text| *text = argument(text));
        self
    }

    /// Its arguments.
    pub fn arguments(&self) -> &[String] {
        &self.arguments
    }
}

/// `[alarm]`: when a scan without progress raises an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Alarm {
    /// Seconds without a new point before the alarm; by default estimated from the plan's slowest point.
    pub no_progress_s: Option<Time>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_input::{Fault, toml_text};

    fn hooks(text: &str) -> Result<Hooks, Fault> {
        toml_text(Path::new("plan.toml"), text)
    }

    #[test]
    fn a_line_is_split_into_words_and_nothing_is_expanded() {
        let hooks = hooks(
            "on_failure = \"notify 'two words' $HOME ; rm *\"\non_finish = [\"mail\", \"a b\"]\n",
        )
        .expect("valid");
        let failure = hooks.command(HookKind::Failure).expect("given");
        assert_eq!(failure.program(), "notify");
        assert_eq!(failure.arguments(), ["two words", "$HOME", ";", "rm", "*"]);
        assert_eq!(hooks.command(HookKind::Finish).expect("given").arguments(), ["a b"]);
        assert_eq!(hooks.command(HookKind::Question), None);
    }

    #[test]
    fn an_invalid_command_is_shown_at_its_line() {
        for wrong in ["\"\"", "[]", "\"say 'hello\"", "[\"\"]", "3"] {
            let fault = hooks(&format!("# hooks\non_failure = {wrong}\n")).expect_err(wrong);
            assert_eq!(fault.line_column().map(|(line, _)| line), Some(2), "{fault}");
        }
        assert!(hooks("on_failre = \"x\"\n").is_err());
    }

    #[test]
    fn a_path_is_relative_to_its_file_and_a_name_is_kept() {
        let hooks =
            hooks("on_finish = './tell.sh x'\non_failure = 'mail'\non_question = '/bin/x'\n");
        let hooks = hooks.expect("valid").beside(Path::new("scans"));
        let program = |kind| hooks.command(kind).expect("given").program();
        assert_eq!(program(HookKind::Finish), "scans/./tell.sh");
        assert_eq!(program(HookKind::Failure), "mail");
        assert_eq!(program(HookKind::Question), "/bin/x");
    }

    #[test]
    fn hooks_of_the_plan_have_precedence_over_those_of_the_rig() {
        let plan = hooks("on_finish = \"plan\"\n").expect("valid");
        let rig = hooks("on_finish = \"rig\"\non_question = \"rig\"\n").expect("valid");
        let both = plan.or(&rig);
        assert_eq!(both.command(HookKind::Finish).map(HookCommand::program), Some("plan"));
        assert_eq!(both.command(HookKind::Question).map(HookCommand::program), Some("rig"));
    }
}
