//! Paragraphs and tables for a terminal.

/// Line width of a terminal, characters.
const WIDTH: usize = 100;

/// Words in lines of at most 100 characters, indented; lines after the first by `hang` more. Longer words, and words joined
/// by a no-break space, are not broken.
pub fn paragraph(words: &str, indent: usize, hang: usize) -> String {
    let mut lines = String::new();
    let mut line = " ".repeat(indent);
    let mut empty = true;
    for word in words.split([' ', '\n']).filter(|word| !word.is_empty()) {
        let length = line.chars().count() + word.chars().count() + usize::from(!empty);
        if !empty && length > WIDTH {
            lines += &line;
            lines.push('\n');
            line = " ".repeat(indent + hang);
            empty = true;
        }
        if !empty {
            line.push(' ');
        }
        line += word;
        empty = false;
    }
    if !empty {
        lines += &line;
        lines.push('\n');
    }
    lines
}

/// Rows in columns, separated and indented by two blanks. The first column is left-aligned, the others right-aligned.
pub fn table<const COLUMNS: usize>(rows: &[[String; COLUMNS]]) -> String {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
    let widths: Vec<usize> = (0..COLUMNS).map(|column| width(column).unwrap_or(0)).collect();
    let line = |row: &[String; COLUMNS]| {
        let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, &width))| {
            if column == 0 { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        let cells: Vec<String> = cells.collect();
        format!("  {}", cells.join("  ")).trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_paragraphs_are_filled() {
        let words = "sound ".repeat(40);
        let text = paragraph(&words, 2, 3);
        let lengths: Vec<usize> = text.lines().map(str::len).collect();
        let (last, full) = lengths.split_last().expect("lines");
        assert!(full.iter().chain([last]).all(|&length| length <= WIDTH), "{text}");
        assert!(full.iter().all(|&length| length > WIDTH - 6), "{text}");
        assert!(text.starts_with("  sound") && text.contains("\n     sound"), "{text}");
        assert_eq!(text.split_whitespace().count(), 40);
        assert_eq!(paragraph(" ", 2, 0), "");
        assert_eq!(paragraph(&"x".repeat(120), 0, 2).lines().count(), 1);
    }

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let rows = [["a", "1.5"], ["long", "20"]].map(|row| row.map(str::to_owned));
        assert_eq!(table(&rows), "  a     1.5\n  long   20\n");
    }
}
