//! A drawn picture: its files, and how it stands on a page.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::html::{Html, element, link, text, void};
use super::picture::Drawn;

/// A picture and the name of its files.
pub(super) struct Figure {
    /// File name without its extension.
    name: String,
    /// The picture.
    pub drawn: Drawn,
}

impl Figure {
    /// A picture whose files have this name before their extension.
    pub fn new(name: String, drawn: Drawn) -> Self {
        Self { name, drawn }
    }

    pub fn png_name(&self) -> String {
        format!("{}.png", self.name)
    }

    pub fn svg_name(&self) -> String {
        format!("{}.svg", self.name)
    }

    /// The picture itself, inside the page.
    pub fn image(&self) -> Html {
        let source = format!("data:image/png;base64,{}", STANDARD.encode(&self.drawn.png));
        let (width, height) = self.drawn.size;
        void(
            "img",
            &[
                ("alt", &self.drawn.description),
                ("width", &width.to_string()),
                ("height", &height.to_string()),
                ("src", &source),
            ],
        )
    }

    /// The way to its files.
    pub fn files(&self) -> Html {
        element(
            "p",
            &[],
            [
                text("As a file: "),
                link(&self.png_name(), "PNG"),
                text(", "),
                link(&self.svg_name(), "SVG"),
            ],
        )
    }
}
