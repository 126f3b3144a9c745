//! A table of one row for each plane, its columns in groups.

use maud::{Markup, html};

/// The contents of the table.
pub(super) struct PlaneTable<'a> {
    pub caption: &'a str,
    /// The columns that identify a plane. The last is its height.
    pub lead: &'a [&'a str],
    /// Heading of each group, and how many columns it spans.
    pub groups: &'a [(&'a str, usize)],
    pub columns: &'a [&'a str],
    pub rows: Vec<PlaneRow>,
}

/// The row of a plane.
pub(super) struct PlaneRow {
    /// The cells before the height.
    pub lead: Vec<String>,
    pub height: String,
    pub cells: Vec<String>,
}

impl PlaneTable<'_> {
    pub fn markup(&self) -> Markup {
        html! {
            div class="wide" {
                table {
                    caption { (self.caption) }
                    thead {
                        tr {
                            td colspan=(self.lead.len()) {}
                            @for (words, width) in self.groups {
                                th colspan=(width) scope="colgroup" { (words) }
                            }
                        }
                        tr {
                            @for words in self.lead.iter().chain(self.columns) {
                                th scope="col" { (words) }
                            }
                        }
                    }
                    tbody { @for row in &self.rows { (row.markup()) } }
                }
            }
        }
    }
}

impl PlaneRow {
    fn markup(&self) -> Markup {
        html! {
            tr {
                @for words in &self.lead { td { (words) } }
                th scope="row" { (self.height) }
                @for words in &self.cells { td { (words) } }
            }
        }
    }
}
