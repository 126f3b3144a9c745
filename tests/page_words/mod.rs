//! What a page says, without how it says it.

/// Elements that stand within a line; every other one begins a line of its own.
const WITHIN_A_LINE: &[&str] = &["a", "code", "strong", "td", "th", "img"];

/// The visible words of a page, a line for each block: no tags, no style, no pictures.
pub fn words(page: &str) -> String {
    let body = page.split_once("<body>").expect("a body").1;
    let mut words = String::new();
    for piece in body.split('<') {
        let (tag, text) = piece.split_once('>').unwrap_or(("", piece));
        let name = tag.split(' ').next().unwrap_or_default();
        match name.strip_prefix('/') {
            Some("td" | "th") => words.push_str(" | "),
            None if !WITHIN_A_LINE.contains(&name) => words.push('\n'),
            _ => {}
        }
        words.push_str(&unescaped(text));
    }
    let lines = words.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join("\n")
}

fn unescaped(text: &str) -> String {
    text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&")
}
