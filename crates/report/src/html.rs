//! The parts that all pages share. Maud escapes every text and every attribute.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The whole document, with its style sheets. It asks for nothing from outside.
pub(super) fn document(title: &str, styles: &[&str], body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { @for style in styles { (PreEscaped(style)) } }
            }
            body { (body) }
        }
    };
    without_control_characters(&page.into_string())
}

/// HTML has no place for control characters; each becomes the replacement character.
fn without_control_characters(page: &str) -> String {
    page.replace(|c: char| c.is_control() && !matches!(c, '\n' | '\t'), "\u{fffd}")
}

/// The links to the sections of a page: anchor and heading of each.
pub(super) fn navigation<'a>(entries: impl IntoIterator<Item = (&'a str, &'a str)>) -> Markup {
    html! {
        nav aria-label="Sections" {
            ul {
                @for (id, heading) in entries { li { a href={ "#" (id) } { (heading) } } }
            }
        }
    }
}

/// A section with its heading and an anchor.
pub(super) fn section(id: &str, heading: &str, content: &Markup) -> Markup {
    html! { section id=(id) { h2 { (heading) } (content) } }
}

/// Terms and what they mean.
pub(super) fn glossary<'a>(terms: impl IntoIterator<Item = (&'a str, &'a str)>) -> Markup {
    html! {
        dl { @for (term, meaning) in terms { dt { (term) } dd { (meaning) } } }
    }
}

/// A table of labels and values.
pub(super) fn facts<L: AsRef<str>>(rows: impl IntoIterator<Item = (L, Markup)>) -> Markup {
    html! {
        table class="facts" {
            tbody {
                @for (label, value) in rows { tr { th scope="row" { (label.as_ref()) } td { (value) } } }
            }
        }
    }
}

/// A table of one head row; the first cell of each row names it.
pub(super) fn table(
    caption: &str,
    columns: &[&str],
    rows: impl IntoIterator<Item = Vec<String>>,
) -> Markup {
    html! {
        div class="wide" {
            table class="names" {
                caption { (caption) }
                thead { tr { @for words in columns { th scope="col" { (words) } } } }
                tbody { @for row in rows { (named_row(&row)) } }
            }
        }
    }
}

fn named_row(cells: &[String]) -> Markup {
    html! {
        @if let [name, values @ ..] = cells {
            tr { th scope="row" { (name) } @for value in values { td { (value) } } }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A page that holds these words as text and as an attribute.
    fn page_with(words: &str) -> String {
        document(words, &[], &html! { a href=(words) { (words) } })
    }

    #[test]
    fn text_and_attributes_are_escaped() {
        let page = page_with("\"><script>&\u{0}");
        let escaped = "&quot;&gt;&lt;script&gt;&amp;\u{fffd}";
        let link = format!("<body><a href=\"{escaped}\">{escaped}</a></body>");
        assert!(page.contains(&link), "{page}");
    }

    proptest! {
        #[test]
        fn no_words_add_markup(words in "\\PC*|[<>&\"'\\x00-\\x1f]*") {
            let page = page_with(&words);
            let count = |page: &str, of: char| page.matches(of).count();
            let empty = page_with("");
            for markup in ['<', '>', '"'] {
                prop_assert_eq!(count(&page, markup), count(&empty, markup), "{}", page);
            }
            prop_assert!(!page.contains(|c: char| c.is_control() && c != '\n' && c != '\t'));
        }
    }
}
