//! An error in an input file.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use miette::{NamedSource, SourceSpan};

/// An error in a file: where it is, what is wrong, and how to correct it.
///
/// `Display` gives one line, `file:line:column: problem`. As a [`miette::Diagnostic`] it also shows the line and the remedy.
#[derive(Debug, Clone, thiserror::Error, miette::Diagnostic)]
#[error("{}{problem}", self.place())]
pub struct Fault {
    path: Box<Path>,
    line_column: Option<(usize, usize)>,
    problem: String,
    #[help]
    remedy: Option<String>,
    #[source_code]
    source_code: Option<Arc<NamedSource<String>>>,
    #[label("here")]
    span: Option<SourceSpan>,
}

impl Fault {
    /// A fault of a whole file: missing, unreadable, empty.
    pub fn of_file(path: &Path, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            line_column: None,
            problem: problem.into(),
            remedy: Some(remedy.into()),
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
        Self {
            line_column: Some(line_and_column(text, start)),
            source_code: Some(Arc::new(NamedSource::new(
                path.display().to_string(),
                text.to_owned(),
            ))),
            span: Some((start, end - start).into()),
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
        let problem = problem.into();
        Self {
            line_column: Some((line, column)),
            problem: format!("{problem}\n  in the line: {line_text}"),
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
        match self.line_column {
            Some((line, column)) => format!("{}:{line}:{column}: ", self.path.display()),
            None => format!("{}: ", self.path.display()),
        }
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
