//! The lines of a file at a fault, as a message shows them: few, of bounded length, and with their control characters visible.

use std::ops::Range;
use std::path::Path;

use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

use super::visible::{visible, visible_line};

/// Characters that are shown before and after the fault in its line.
const BEFORE: usize = 60;
const AFTER: usize = 100;

/// Most lines of the fault itself that are shown; a table may be long.
const MOST_LINES: usize = 12;

/// Some lines of a file.
#[derive(Debug, Clone)]
pub(super) struct Excerpt {
    name: String,
    text: String,
    /// Number of the first line, from 0.
    first_line: usize,
    /// The fault in `text`.
    span: SourceSpan,
    /// Column of the fault in its file, from 0.
    column: usize,
}

impl Excerpt {
    /// The lines of `text` at a range that lies on character boundaries, and one line before and after; `line` and `column` of
    /// the range's start count from 0.
    pub fn of(path: &Path, text: &str, range: Range<usize>, line: usize, column: usize) -> Self {
        let begin = text[..range.start].rfind('\n').map_or(0, |end| end + 1);
        let mut shown = String::new();
        let mut first_line = line;
        if begin > 0 {
            let previous = text[..begin - 1].rfind('\n').map_or(0, |end| end + 1);
            push_line(&mut shown, &text[previous..begin - 1], 0);
            first_line -= 1;
        }
        let (mut from, mut to) = (shown.len(), shown.len());
        let mut at = begin;
        let mut lines = text[begin..].split('\n');
        for (number, line) in lines.by_ref().take(MOST_LINES).enumerate() {
            let start = range.start.saturating_sub(at).min(line.len());
            let end = range.end.saturating_sub(at).min(line.len());
            let place = push_line(&mut shown, line, start);
            if number == 0 {
                from = place.at(line, start, &shown);
            }
            to = place.at(line, end, &shown);
            at += line.len() + 1;
            if range.end < at {
                break;
            }
        }
        if let Some(next) = lines.next() {
            push_line(&mut shown, next, 0);
        }
        let name = visible_line(&path.display().to_string()).into_owned();
        let span = (from, to.saturating_sub(from)).into();
        Self { name, text: shown, first_line, span, column }
    }

    /// The fault in the excerpt.
    pub fn span(&self) -> SourceSpan {
        self.span
    }
}

/// Where a part of a line stands in the text that is shown.
struct Placed {
    begin: usize,
    part: Range<usize>,
}

impl Placed {
    /// The place of a byte of the line.
    fn at(&self, line: &str, byte: usize, shown: &str) -> usize {
        let byte = byte.clamp(self.part.start, self.part.end);
        let at = self.begin + visible(&line[self.part.start..byte]).len();
        at.min(shown.len())
    }
}

/// Adds the part of a line about a byte, with its control characters visible.
fn push_line(shown: &mut String, line: &str, byte: usize) -> Placed {
    let line = line.strip_suffix('\r').unwrap_or(line);
    let byte = byte.min(line.len());
    let from = line[..byte].char_indices().rev().nth(BEFORE).map_or(0, |(at, _)| at);
    let to = line[byte..].char_indices().nth(AFTER).map_or(line.len(), |(at, _)| byte + at);
    if from > 0 {
        *shown += "… ";
    }
    let begin = shown.len();
    *shown += &visible(&line[from..to]);
    if to < line.len() {
        *shown += " …";
    }
    shown.push('\n');
    Placed { begin, part: from..to }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let inner = self.text.read_span(span, before, after)?;
        // Where the line is shown in part, the column of the file, not of the part.
        let column = if *span == self.span && before == 0 { self.column } else { inner.column() };
        Ok(Box::new(MietteSpanContents::new_named(
            self.name.clone(),
            inner.data(),
            *inner.span(),
            inner.line() + self.first_line,
            column,
            inner.line_count(),
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn excerpt(text: &str, wanted: &str) -> Excerpt {
        let at = text.find(wanted).expect("part of the text");
        let line = text[..at].matches('\n').count();
        Excerpt::of(Path::new("f.toml"), text, at..at + wanted.len(), line, 7)
    }

    fn marked(excerpt: &Excerpt) -> &str {
        let span = excerpt.span();
        &excerpt.text[span.offset()..span.offset() + span.len()]
    }

    #[test]
    fn the_fault_is_shown_with_the_lines_beside_it() {
        let excerpt = excerpt("a\nb\nc = -2\nd\ne\n", "-2");
        assert_eq!(excerpt.text, "b\nc = -2\nd\n");
        assert_eq!((excerpt.first_line, marked(&excerpt)), (1, "-2"));
    }

    #[test]
    fn a_long_line_is_shown_about_the_fault() {
        let text = format!("{}wrong{}\n", "λ".repeat(70_000), "y".repeat(70_000));
        let excerpt = excerpt(&text, "wrong");
        assert!(excerpt.text.chars().count() < 300, "{}", excerpt.text);
        assert_eq!(marked(&excerpt), "wrong");
    }

    #[test]
    fn control_characters_are_visible_and_the_fault_stays_marked() {
        let excerpt = excerpt("\x1b[2J\u{202e} = wrong # \x1b\n", "wrong");
        assert_eq!(excerpt.text, "\\u{1b}[2J\\u{202e} = wrong # \\u{1b}\n\n");
        assert_eq!(marked(&excerpt), "wrong");
    }

    proptest::proptest! {
        #[test]
        fn any_range_of_any_text_can_be_shown(
            text in "[a\\n\\r\\tλ\\x1b]{0,300}", start in 0usize..400, length in 0usize..400,
        ) {
            let fault = crate::Fault::at(Path::new("f"), &text, start..start + length, "p", "r");
            let handler = miette::GraphicalReportHandler::new();
            let mut out = String::new();
            handler.render_report(&mut out, &fault).expect("text");
        }
    }
}
