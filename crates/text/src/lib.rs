//! Numbers, paragraphs and tables as text: what the terminal and the pages of fieldgap have in common.
//!
//! ```
//! use fieldgap_text::{Uncertain, percent, uncertain};
//!
//! let speed_m_s = Uncertain { value: 346.123, standard_error: 0.21 };
//! assert_eq!(uncertain(speed_m_s), "346.12 ± 0.21");
//! assert_eq!(percent(0.0134), "1.34\u{a0}%");
//! ```
//!
//! Begin with [`uncertain`], [`significant`] and [`percent`] for numbers, [`table`] and [`paragraph`] for a terminal.

mod layout;
mod list;
mod numbers;

pub use layout::{paragraph, table, table_rows};
pub use list::listed;
pub use numbers::{
    ABSENT, Uncertain, fixed, height_mm, millimetres, percent, raised, significant, uncertain,
    with_minus_signs,
};
