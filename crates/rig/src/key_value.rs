//! `key=value` words, as devices state their properties.

/// The value of a key among words separated by spaces.
pub(crate) fn value_of<'a>(words: &'a str, key: &str) -> Option<&'a str> {
    let mut pairs = words.split(' ').filter_map(|word| word.split_once('='));
    pairs.find(|(name, _)| *name == key).map(|(_, value)| value)
}

#[cfg(test)]
mod tests {
    use super::value_of;

    #[test]
    fn the_first_word_with_the_key_counts() {
        let words = "elements=36 clock_hz=10240000 odd elements=7 unit=";
        assert_eq!(value_of(words, "elements"), Some("36"));
        assert_eq!(value_of(words, "unit"), Some(""));
        assert_eq!(value_of(words, "clock"), None);
        assert_eq!(value_of(words, "odd"), None);
    }
}
