//! Several things in a sentence.

/// Things as a sentence lists them: `a, b and c`; empty without any.
pub fn listed(things: &[String]) -> String {
    match things.split_last() {
        Some((last, rest @ [_, ..])) => format!("{} and {last}", rest.join(", ")),
        _ => things.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_thing_is_joined_by_a_word() {
        let list = |things: &[&str]| {
            listed(&things.iter().map(|&thing| thing.to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(list(&[]), "");
        assert_eq!(list(&["x"]), "x");
        assert_eq!(list(&["x", "y"]), "x and y");
        assert_eq!(list(&["x", "y", "z"]), "x, y and z");
    }
}
