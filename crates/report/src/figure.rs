//! A drawn picture, its files, and its place on a page.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

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

    /// The picture with its caption, inside the page.
    pub fn markup(&self, caption: &Markup) -> Markup {
        html! {
            figure { (self.image()) figcaption { (caption) (self.files()) } }
        }
    }

    /// The picture without a caption; `narrow`, where there is one, takes its place on a narrow screen.
    pub fn beside(&self, narrow: Option<&Self>) -> Markup {
        let source =
            |figure: &Self| format!("data:image/png;base64,{}", STANDARD.encode(&figure.drawn.png));
        html! {
            figure {
                picture {
                    @if let Some(narrow) = narrow {
                        source media="(max-width: 640px)" srcset=(source(narrow));
                    }
                    (self.image())
                }
            }
        }
    }

    fn image(&self) -> Markup {
        let source = format!("data:image/png;base64,{}", STANDARD.encode(&self.drawn.png));
        let (width, height) = self.drawn.size;
        html! { img alt=(self.drawn.description) width=(width) height=(height) src=(source); }
    }

    /// Links to its files.
    fn files(&self) -> Markup {
        html! {
            p { "Files: " a href=(self.png_name()) { "PNG" } ", " a href=(self.svg_name()) { "SVG" } }
        }
    }
}
