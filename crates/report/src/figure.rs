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
    /// Its panels one below the other, for a narrow screen.
    narrow: Option<Drawn>,
}

impl Figure {
    /// A picture whose files have this name before their extension.
    pub fn new(name: String, drawn: Drawn) -> Self {
        Self { name, drawn, narrow: None }
    }

    /// The same with a picture that takes its place on a narrow screen. It has no file of its own.
    pub fn with_narrow(mut self, narrow: Drawn) -> Self {
        self.narrow = Some(narrow);
        self
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

    /// The picture without a caption.
    pub fn uncaptioned(&self) -> Markup {
        html! { figure { (self.image()) } }
    }

    fn image(&self) -> Markup {
        let source =
            |drawn: &Drawn| format!("data:image/png;base64,{}", STANDARD.encode(&drawn.png));
        let (width, height) = self.drawn.size;
        html! {
            picture {
                @if let Some(narrow) = &self.narrow {
                    source media="(max-width: 640px)" srcset=(source(narrow));
                }
                img alt=(self.drawn.description) width=(width) height=(height) src=(source(&self.drawn));
            }
        }
    }

    /// Links to its files.
    fn files(&self) -> Markup {
        html! {
            p { "Files: " a href=(self.png_name()) { "PNG" } ", " a href=(self.svg_name()) { "SVG" } }
        }
    }
}
