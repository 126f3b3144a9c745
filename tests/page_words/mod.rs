//! What a page says, without how it says it.

/// The words of a page, a line for each block: no tags, no style, no pictures.
pub fn words(page: &str) -> String {
    let body = page.split_once("<body>").expect("a body").1;
    let mut words = String::new();
    for piece in body.split('<') {
        let (tag, text) = piece.split_once('>').unwrap_or(("", piece));
        if matches!(tag, "/td" | "/th") || tag.starts_with("/th ") {
            words.push_str(" | ");
        }
        words.push_str(text);
    }
    let lines = words.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join("\n")
}
