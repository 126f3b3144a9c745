//! HTML in which text cannot turn into markup.

/// A piece of HTML. Text gets in only through [`text`], attributes only through [`element`] and [`void`], which
/// escape both.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Html(String);

/// Tags that begin on a line of their own, so that two pages can be compared line by line.
const BLOCKS: &[&str] = &[
    "html",
    "head",
    "body",
    "header",
    "main",
    "section",
    "nav",
    "h1",
    "h2",
    "h3",
    "p",
    "ul",
    "li",
    "dl",
    "dt",
    "dd",
    "figure",
    "figcaption",
    "table",
    "caption",
    "thead",
    "tbody",
    "tr",
    "div",
    "meta",
    "title",
    "footer",
    "pre",
];

impl Html {
    /// The pieces one after the other.
    pub fn all(pieces: impl IntoIterator<Item = Html>) -> Self {
        pieces.into_iter().fold(Self::default(), |mut whole, piece| {
            whole.0.push_str(&piece.0);
            whole
        })
    }

    /// The whole document, with its style sheets.
    pub fn document(title: &str, styles: &[&'static str], body: Html) -> String {
        let head = Html::all([
            void("meta", &[("charset", "utf-8")]),
            void(
                "meta",
                &[("name", "viewport"), ("content", "width=device-width, initial-scale=1")],
            ),
            element("title", &[], [text(title)]),
            Html(format!("<style>\n{}</style>\n", styles.concat())),
        ]);
        let page = element(
            "html",
            &[("lang", "en")],
            [element("head", &[], [head]), element("body", &[], [body])],
        );
        format!("<!DOCTYPE html>{}", page.0)
    }
}

/// Text; control characters, which HTML has no place for, become the replacement character.
pub(super) fn text(text: &str) -> Html {
    Html(escaped(text))
}

/// An element around its children.
pub(super) fn element(
    tag: &'static str,
    attributes: &[(&'static str, &str)],
    children: impl IntoIterator<Item = Html>,
) -> Html {
    let mut html = void(tag, attributes);
    for child in children {
        html.0.push_str(&child.0);
    }
    html.0.push_str("</");
    html.0.push_str(tag);
    html.0.push('>');
    html
}

/// An element that has no children and no end tag.
pub(super) fn void(tag: &'static str, attributes: &[(&'static str, &str)]) -> Html {
    let mut html = String::new();
    if BLOCKS.contains(&tag) {
        html.push('\n');
    }
    html.push('<');
    html.push_str(tag);
    for (name, value) in attributes {
        html.push_str(&format!(" {name}=\"{}\"", escaped(value)));
    }
    html.push('>');
    Html(html)
}

/// A paragraph of text.
pub(super) fn paragraph(words: &str) -> Html {
    element("p", &[], [text(words)])
}

/// Lines of text, kept as they are.
pub(super) fn lines(words: &str) -> Html {
    let lines: Vec<String> = words.trim_end().lines().map(escaped).collect();
    Html(format!("\n<pre>{}</pre>", lines.join("\n")))
}

/// A link.
pub(super) fn link(target: &str, words: &str) -> Html {
    element("a", &[("href", target)], [text(words)])
}

/// A section with its heading and an anchor.
pub(super) fn section(id: &str, heading: &str, content: impl IntoIterator<Item = Html>) -> Html {
    let heading = element("h2", &[], [text(heading)]);
    element("section", &[("id", id)], std::iter::once(heading).chain(content))
}

/// A table of labels and values.
pub(super) fn facts(rows: impl IntoIterator<Item = (Html, Html)>) -> Html {
    let row = |(label, value)| {
        element(
            "tr",
            &[],
            [element("th", &[("scope", "row")], [label]), element("td", &[], [value])],
        )
    };
    element("table", &[("class", "facts")], [element("tbody", &[], rows.into_iter().map(row))])
}

/// A table of one head row; the first cell of each row names it.
pub(super) fn table(
    caption: &str,
    columns: &[&str],
    rows: impl IntoIterator<Item = Vec<Html>>,
) -> Html {
    let head = columns.iter().map(|words| element("th", &[("scope", "col")], [text(words)]));
    let row = |cells: Vec<Html>| {
        let cell = |(place, content)| match place {
            0 => element("th", &[("scope", "row")], [content]),
            _ => element("td", &[], [content]),
        };
        element("tr", &[], cells.into_iter().enumerate().map(cell))
    };
    let table = element(
        "table",
        &[("class", "names")],
        [
            element("caption", &[], [text(caption)]),
            element("thead", &[], [element("tr", &[], head)]),
            element("tbody", &[], rows.into_iter().map(row)),
        ],
    );
    element("div", &[("class", "wide")], [table])
}

fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\n' | '\t' => escaped.push(' '),
            control if control.is_control() => escaped.push('\u{fffd}'),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn text_and_attributes_are_escaped() {
        let html = element("a", &[("href", "\"><script>")], [text("<b> & 'c'\u{0}")]);
        assert_eq!(
            html.0,
            "<a href=\"&quot;&gt;&lt;script&gt;\">&lt;b&gt; &amp; &#39;c&#39;\u{fffd}</a>"
        );
    }

    proptest! {
        #[test]
        fn no_text_holds_markup(words in "\\PC*|[<>&\"'\\x00-\\x1f]*") {
            let Html(html) = text(&words);
            let markup = ['<', '>', '"', '\'', '\u{0}', '\n'];
            prop_assert!(!html.contains(markup), "{}", html);
        }
    }
}
