//! One command parsed into its words.

/// A command such as `G1 X10 F3000`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Command {
    /// `G` or `M`.
    pub letter: char,
    /// The number after it.
    pub code: u32,
    words: Vec<(char, Option<f64>)>,
}

impl Command {
    /// Parses a command. `None` if it does not start with `G` or `M` in capitals and a number.
    ///
    /// As in the real firmware a word needs no blank before it, a word without a readable number has none,
    /// and a number ends after its last digit.
    pub fn parse(text: &str) -> Option<Self> {
        let mut rest = text.trim_start();
        let letter = rest.chars().next().filter(|&letter| letter == 'G' || letter == 'M')?;
        rest = &rest[1..];
        let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
        let code = rest[..digits].parse().ok()?;
        rest = &rest[digits..];
        let mut words = Vec::new();
        while let Some(letter) = rest.chars().next() {
            rest = &rest[letter.len_utf8()..];
            if letter.is_ascii_uppercase() {
                let (value, length) = number(rest);
                words.push((letter, value));
                rest = &rest[length..];
            }
        }
        Some(Self { letter, code, words })
    }

    /// Whether the word is there, with a number or without.
    pub fn has(&self, letter: char) -> bool {
        self.words.iter().any(|&(word, _)| word == letter)
    }

    /// The word's number.
    pub fn value(&self, letter: char) -> Option<f64> {
        self.words.iter().find(|&&(word, _)| word == letter).and_then(|&(_, value)| value)
    }
}

/// The plain decimal number at the start of `text` after blanks, and the length that was read.
fn number(text: &str) -> (Option<f64>, usize) {
    let blanks = text.bytes().take_while(|&b| b == b' ').count();
    let bytes = &text.as_bytes()[blanks..];
    let sign = usize::from(matches!(bytes.first(), Some(b'-' | b'+')));
    let mut point = false;
    let digits = bytes[sign..]
        .iter()
        .take_while(|&&b| b.is_ascii_digit() || (b == b'.' && !std::mem::replace(&mut point, true)))
        .count();
    let value = text[blanks..blanks + sign + digits].parse().ok();
    match value {
        Some(value) => (Some(value), blanks + sign + digits),
        None => (None, 0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_need_no_blanks_between_them() {
        let command = Command::parse("G1X10Y-2.5 F3000").expect("a command");
        assert_eq!((command.letter, command.code), ('G', 1));
        assert_eq!(command.value('X'), Some(10.0));
        assert_eq!(command.value('Y'), Some(-2.5));
        assert_eq!(command.value('F'), Some(3000.0));
    }

    #[test]
    fn a_word_without_a_number_is_there_all_the_same() {
        let command = Command::parse("G28 X").expect("a command");
        assert!(command.has('X') && command.value('X').is_none() && !command.has('Y'));
    }

    #[test]
    fn lower_case_and_nonsense_are_no_commands() {
        for text in ["g28", "hello", "", "M", "λ1"] {
            assert_eq!(Command::parse(text), None, "{text}");
        }
    }

    proptest::proptest! {
        #[test]
        fn any_text_is_taken_apart_or_refused(text in ".{0,60}") {
            let _ = Command::parse(&text);
        }
    }
}
