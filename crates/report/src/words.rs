//! Lists, sentences and names of parameters.

/// A list in words: `a`, `a and b`, `a, b and c`.
pub(super) fn listed(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// A sentence: with a capital at its beginning and a full stop at its end, where they are missing.
pub(super) fn sentence(words: &str) -> String {
    let mut rest = words.trim().chars();
    let mut sentence: String = rest.next().into_iter().flat_map(char::to_uppercase).collect();
    sentence.extend(rest);
    if !sentence.ends_with(['.', '!', '?']) {
        sentence.push('.');
    }
    sentence
}

/// The name of a parameter of the registration.
pub(super) fn parameter(name: &str) -> String {
    match name {
        "shift_x" => "shift in x".to_owned(),
        "shift_y" => "shift in y".to_owned(),
        "shift_z" => "height".to_owned(),
        "step_ratio" => "step".to_owned(),
        other => other.replace('_', " "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_listed() {
        let words = ["50", "100", "150"].map(str::to_owned);
        assert_eq!(listed(&words), "50, 100 and 150");
        assert_eq!(listed(&words[..1]), "50");
        assert_eq!(listed(&[]), "");
    }

    #[test]
    fn a_sentence_begins_large_and_ends_once() {
        assert_eq!(sentence("it fits"), "It fits.");
        assert_eq!(sentence("It fits. "), "It fits.");
    }
}
