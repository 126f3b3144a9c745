//! Errors as they are shown. Their texts quote files and devices, so control characters are made visible before the colours of the terminal
//! are added.

use std::error::Error;
use std::fmt;

use miette::{Diagnostic, LabeledSpan, MietteHandlerOpts, ReportHandler, Severity, SourceCode};

use fieldgap_input::visible;

/// An error for standard error, with its causes, the line of the file at fault and what to do.
pub(super) fn error_message(report: &miette::Report) -> String {
    let mut causes: Option<Box<Cause>> = None;
    for cause in report.chain().skip(1).map(ToString::to_string).collect::<Vec<_>>().iter().rev() {
        causes = Some(Box::new(Cause { text: visible(cause).into_owned(), next: causes }));
    }
    let original: &dyn Diagnostic = report.as_ref();
    let help = original.help().map(|help| visible(&help.to_string()).into_owned());
    let text = visible(&original.to_string()).into_owned();
    // Lines are not wrapped, so that paths and messages can be searched for and copied.
    let handler = MietteHandlerOpts::new().wrap_lines(false).terminal_links(false).build();
    Shown { original, text, help, causes, handler }.to_string()
}

struct Shown<'e> {
    original: &'e dyn Diagnostic,
    text: String,
    help: Option<String>,
    causes: Option<Box<Cause>>,
    handler: miette::MietteHandler,
}

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.handler.debug(&Visible(self), f)
    }
}

struct Visible<'s, 'e>(&'s Shown<'e>);

impl fmt::Debug for Visible<'_, '_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.text)
    }
}

impl fmt::Display for Visible<'_, '_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.text)
    }
}

impl Error for Visible<'_, '_> {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.0.causes.as_deref().map(|cause| cause as _)
    }
}

impl Diagnostic for Visible<'_, '_> {
    fn severity(&self) -> Option<Severity> {
        self.0.original.severity()
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.0.help.as_ref().map(|help| Box::new(help) as _)
    }

    // A fault of a file shows an excerpt, whose control characters are visible already.
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0.original.source_code()
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.0.original.labels()
    }
}

/// One of the causes of an error.
#[derive(Debug)]
struct Cause {
    text: String,
    next: Option<Box<Cause>>,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Error for Cause {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.next.as_deref().map(|cause| cause as _)
    }
}

#[cfg(test)]
mod tests {
    use miette::{IntoDiagnostic, WrapErr, miette};

    use super::*;

    #[test]
    fn error_causes_and_help_are_shown_with_their_control_characters() {
        let device: Result<(), _> = Err(std::io::Error::other("it said `\x1b[2J`"));
        let report = device.into_diagnostic().wrap_err("no answer\u{202e}").expect_err("an error");
        let message = error_message(&report);
        assert!(message.contains("no answer\\u{202e}"), "{message}");
        assert!(message.contains("it said `\\u{1b}[2J`"), "{message}");
        let message = error_message(&miette!(help = "unplug \x07", "stuck"));
        assert!(message.contains("unplug \\u{7}") && message.contains("stuck"), "{message}");
    }
}
