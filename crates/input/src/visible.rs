//! Text from outside, from a file or a device, before it is shown to a person.
//!
//! A terminal obeys escape sequences in any text that is written to it: they clear the screen, set its title, or hide what follows. Marks of
//! writing direction reorder a line. All these characters are shown by their number instead.

use std::borrow::Cow;

/// A text with its control characters made visible, as `\u{1b}`; line ends and tabs remain.
///
/// ```
/// assert_eq!(fieldgap_input::visible("\x1b[2J\tgone\n"), "\\u{1b}[2J\tgone\n");
/// ```
pub fn visible(text: &str) -> Cow<'_, str> {
    shown(text, |character| is_hidden(character) && !matches!(character, '\n' | '\t'))
}

/// A text on one line: line ends and tabs are made visible too.
pub fn visible_line(text: &str) -> Cow<'_, str> {
    shown(text, is_hidden)
}

/// JSON with its control characters escaped. Outside of strings JSON has none but line ends.
pub fn visible_json(json: &str) -> Cow<'_, str> {
    escaped(
        json,
        |character| is_hidden(character) && character != '\n',
        |character, out| {
            let mut units = [0; 2];
            for unit in character.encode_utf16(&mut units) {
                *out += &format!("\\u{unit:04x}");
            }
        },
    )
}

/// Whether a terminal does not show the character but obeys it, or whether it has no width.
pub fn is_hidden(character: char) -> bool {
    character.is_control()
        || matches!(
            character,
            '\u{61c}'
                | '\u{200b}'..='\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}'
                | '\u{feff}'
                | '\u{fff9}'..='\u{fffb}'
                | '\u{e0000}'..='\u{e007f}'
        )
}

fn shown(text: &str, hidden: impl Fn(char) -> bool) -> Cow<'_, str> {
    escaped(text, hidden, |character, out| out.extend(character.escape_unicode()))
}

fn escaped(
    text: &str,
    hidden: impl Fn(char) -> bool,
    escape: impl Fn(char, &mut String),
) -> Cow<'_, str> {
    if !text.chars().any(&hidden) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for character in text.chars() {
        if hidden(character) { escape(character, &mut out) } else { out.push(character) }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn sequences_that_a_terminal_obeys_are_shown() {
        assert_eq!(visible("a\x1b]0;title\x07b"), "a\\u{1b}]0;title\\u{7}b");
        assert_eq!(visible("\u{9b}2J\u{7f}\r\u{202e}x"), "\\u{9b}2J\\u{7f}\\u{d}\\u{202e}x");
        assert_eq!(visible_line("two\nlines\t"), "two\\u{a}lines\\u{9}");
        assert_eq!(visible("λ = 8.6 mm, ± 3 %"), "λ = 8.6 mm, ± 3 %");
    }

    #[test]
    fn json_stays_the_same_value() {
        let json = "{\n \"a\": \"\u{9b}2J\u{202e}\u{e0041}\"\n}";
        assert_eq!(visible_json(json), "{\n \"a\": \"\\u009b2J\\u202e\\udb40\\udc41\"\n}");
    }

    proptest! {
        #[test]
        fn nothing_hidden_remains(text in "\\PC{0,20}[\\x00-\\x1f\u{7f}-\u{9f}\u{202a}-\u{202e}]{0,9}") {
            prop_assert!(!visible_line(&text).chars().any(is_hidden));
            prop_assert!(!visible(&text).chars().any(|c| is_hidden(c) && c != '\n' && c != '\t'));
        }
    }
}
