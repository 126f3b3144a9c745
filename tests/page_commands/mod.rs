//! The commands that a Markdown page gives.
//!
//! A fence marked `sh` holds commands to run. One marked `sh hardware`, `sh long` or `sh pattern` holds commands that need a
//! device, take minutes, or name no file (`PLAN`); those are only parsed. `<!-- run: COMMAND -->` is a command that runs
//! though the reader does not see it. A fence marked `toml PATH` is a file that later commands read; one marked
//! `python` is run by the tests of the Python package. Inline code that begins
//! with `fieldgap`, or stands in the first column of a table of commands, is parsed; so are options in the other columns.

use std::path::PathBuf;

/// What a page asks for, and in which line.
#[derive(Debug, PartialEq)]
pub struct Step {
    pub line: usize,
    pub what: What,
}

/// What a page asks for.
#[derive(Debug, PartialEq)]
pub enum What {
    /// Arguments of `fieldgap`, to be run.
    Run(Vec<String>),
    /// Arguments of `fieldgap`, to be parsed.
    Parse(Vec<String>),
    /// A file, relative to the folder in which the commands run.
    File { path: PathBuf, text: String },
    /// A test, by name.
    Test(String),
    /// A benchmark, by name.
    Bench(String),
}

/// What stands on a page for a value that a program would not take.
const PLACEHOLDERS: [(&str, &str); 3] =
    [("X,Y,Z", "0,0,100"), ("FROM,TO", "20,100"), ("SHELL", "bash")];

/// The steps of a page, in its order.
pub fn steps(markdown: &str) -> Vec<Step> {
    let mut steps = Vec::new();
    let mut fence: Option<Fence> = None;
    let mut table: Option<bool> = None;
    for (number, line) in (1..).zip(markdown.lines()) {
        if let Some(info) = line.strip_prefix("```") {
            match fence.take() {
                Some(fence) => steps.extend(fence.steps()),
                None => fence = Some(Fence { line: number, info, lines: Vec::new() }),
            }
        } else if let Some(fence) = &mut fence {
            fence.lines.push(line);
        } else {
            table =
                line.starts_with('|').then(|| table.unwrap_or_else(|| cells(line)[0] == "command"));
            let whats = outside_fences(line, table == Some(true));
            steps.extend(whats.into_iter().map(|what| Step { line: number, what }));
        }
    }
    assert!(fence.is_none(), "a fence is open at the end");
    steps
}

/// The cells of a row of a table, trimmed.
fn cells(row: &str) -> Vec<String> {
    let row = row.replace("\\|", "\u{0}");
    row.trim_matches('|').split('|').map(|cell| cell.trim().replace('\u{0}', "|")).collect()
}

fn outside_fences(line: &str, of_commands: bool) -> Vec<What> {
    if let Some(hidden) = line.strip_prefix("<!-- run: ") {
        let command = hidden.strip_suffix(" -->").expect("a comment ends in its line");
        return invocation(command, What::Run).into_iter().collect();
    }
    let codes =
        |text: &str| text.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    let mut commands: Vec<String> = Vec::new();
    let mut cells =
        if line.starts_with('|') { cells(line) } else { vec![line.to_owned()] }.into_iter();
    if of_commands {
        let first = codes(&cells.next().unwrap_or_default());
        let whole = |code: &String| match code.strip_prefix("fieldgap ") {
            Some(_) => code.clone(),
            None => format!("fieldgap {code}"),
        };
        commands.extend(first.iter().map(whole).flat_map(|code| alternatives(&code)));
    }
    for code in cells.flat_map(|cell| codes(&cell)) {
        if code.starts_with("fieldgap ") || code.starts_with("cargo ") {
            commands.extend(alternatives(&code));
        } else if code.starts_with("--") && of_commands {
            // An option of the command that the row is about.
            let command = commands.first().expect("a command in the first column");
            commands.push(format!("{command} {code}"));
        }
    }
    commands.iter().filter_map(|command| invocation(command, What::Parse)).collect()
}

/// `a b|c` as `a b` and `a c`.
fn alternatives(command: &str) -> Vec<String> {
    command.split(' ').fold(vec![String::new()], |commands, word| {
        let append = |command: &String| {
            word.split('|').map(|word| format!("{command} {word}")).collect::<Vec<_>>()
        };
        commands.iter().flat_map(append).collect()
    })
}

/// A block of code.
struct Fence<'a> {
    line: usize,
    info: &'a str,
    lines: Vec<&'a str>,
}

impl Fence<'_> {
    fn steps(self) -> Vec<Step> {
        let kind: fn(Vec<String>) -> What = match self.info.split_once(' ') {
            None if self.info == "sh" => What::Run,
            Some(("sh", "hardware" | "long" | "pattern")) => What::Parse,
            Some(("toml", path)) => {
                let what = What::File { path: path.into(), text: self.lines.join("\n") };
                return vec![Step { line: self.line, what }];
            }
            // A program in `bash` is run as a whole, by the test of what it uses.
            None if matches!(self.info, "" | "toml" | "python" | "bash") => return Vec::new(),
            _ => panic!("line {}: a fence of an unknown kind, {:?}", self.line, self.info),
        };
        let lines = (self.line + 1..).zip(&self.lines);
        lines
            .filter_map(|(line, command)| Some(Step { line, what: invocation(command, kind)? }))
            .collect()
    }
}

/// What a command line asks for; `None` of one that is no business of fieldgap.
fn invocation(command: &str, fieldgap: fn(Vec<String>) -> What) -> Option<What> {
    let words = shlex::split(command).unwrap_or_else(|| panic!("quotes are open: {command}"));
    let words: Vec<&str> = words
        .iter()
        .map(|word| {
            PLACEHOLDERS.iter().find(|(name, _)| name == word).map_or(&**word, |(_, value)| value)
        })
        .collect();
    let after = |option| {
        words.iter().skip_while(move |word| **word != option).nth(1).map(|word| (*word).to_owned())
    };
    let owned = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect();
    match words.as_slice() {
        [] => None,
        ["fieldgap", arguments @ ..] => Some(fieldgap(owned(arguments))),
        ["cargo", "run", "--release", "--", arguments @ ..] => Some(fieldgap(owned(arguments))),
        ["cargo", "test", ..] => after("--test").map(What::Test),
        ["cargo", "bench", ..] => after("--bench").map(What::Bench),
        ["cargo", ..] => None,
        // What these do is the business of .ci/python itself.
        ["pip", "install", ..] | [".ci/python"] | ["python", ..] => None,
        // Needs another computer.
        ["ssh", ..] => None,
        other => panic!("a command of an unknown kind: {other:?}"),
    }
}
