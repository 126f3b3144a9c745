//! An error in an input file.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use miette::SourceSpan;

use super::excerpt::Excerpt;
use super::visible::{visible, visible_line};

/// Most characters of a problem: it may quote a word of the file.
const MOST_OF_PROBLEM: usize = 1000;

/// An error in a file: where it is, what is wrong, and how to correct it.
///
/// `Display` gives one line, `file:line:column: problem`. As a [`miette::Diagnostic`] it also shows the line and the remedy. Control
/// characters of the file are made visible, and long lines are shown in part.
#[derive(Debug, Clone, thiserror::Error, miette::Diagnostic)]
#[error("{}{problem}", self.place())]
pub struct Fault {
    path: Box<Path>,
    line_column: Option<(usize, usize)>,
    problem: String,
    #[help]
    remedy: Option<String>,
    #[source_code]
    source_code: Option<Arc<Excerpt>>,
    #[label("here")]
    span: Option<SourceSpan>,
}

impl Fault {
    /// A fault of a whole file: missing, unreadable, empty.
    pub fn of_file(path: &Path, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            line_column: None,
            problem: bounded(&visible(&problem.into())),
            remedy: Some(visible(&remedy.into()).into_owned()),
            source_code: None,
            span: None,
        }
    }

    /// A fault at a byte range of `text`, the contents of `path`.
    ///
    /// A range outside the text is clipped to it.
    pub fn at(
        path: &Path,
        text: &str,
        range: Range<usize>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        let start = floor_char_boundary(text, range.start);
        let end = floor_char_boundary(text, range.end).max(start);
        let (line, column) = line_and_column(text, start);
        let excerpt = Excerpt::of(path, text, start..end, line - 1, column - 1);
        Self {
            line_column: Some((line, column)),
            span: Some(excerpt.span()),
            source_code: Some(Arc::new(excerpt)),
            ..Self::of_file(path, problem, remedy)
        }
    }

    /// A fault on a line of a table; `line` and `column` (in characters) count from 1.
    ///
    /// The text of the line is shown, not the file, which may be long.
    pub fn on_line(
        path: &Path,
        line: usize,
        column: usize,
        line_text: &str,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        let line_text = bounded(&visible_line(line_text));
        Self {
            line_column: Some((line, column)),
            problem: format!("{}\n  in the line: {line_text}", bounded(&visible(&problem.into()))),
            ..Self::of_file(path, String::new(), remedy)
        }
    }

    /// The file at fault.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Line and column, both from 1, if the fault has a position in the file.
    pub fn line_column(&self) -> Option<(usize, usize)> {
        self.line_column
    }

    /// What is wrong.
    pub fn problem(&self) -> &str {
        &self.problem
    }

    fn place(&self) -> String {
        let path = self.path.display().to_string();
        let path = visible_line(&path);
        match self.line_column {
            Some((line, column)) => format!("{path}:{line}:{column}: "),
            None => format!("{path}: "),
        }
    }
}

fn bounded(text: &str) -> String {
    match text.char_indices().nth(MOST_OF_PROBLEM) {
        Some((end, _)) => format!("{} …", &text[..end]),
        None => text.to_owned(),
    }
}

fn floor_char_boundary(text: &str, mut at: usize) -> usize {
    at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

fn line_and_column(text: &str, at: usize) -> (usize, usize) {
    let before = &text[..at];
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
    (line, column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_names_file_line_and_column() {
        let text = "a = 1\nλ = -2\n";
        let at = text.find("-2").expect("part of the text");
        let fault = Fault::at(Path::new("x.toml"), text, at..at + 2, "negative", "use 2");
        assert_eq!(fault.to_string(), "x.toml:2:5: negative");
    }

    proptest::proptest! {
        #[test]
        fn any_range_of_any_text_has_a_position(text in ".{0,40}", start in 0usize..80, end in 0usize..80) {
            let fault = Fault::at(Path::new("x"), &text, start..end, "p", "r");
            let (line, column) = fault.line_column().expect("a position");
            proptest::prop_assert!(line >= 1 && column >= 1);
        }
    }
}
