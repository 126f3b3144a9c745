//! Paragraphs and tables for a terminal.

/// Line width of a terminal, characters.
const WIDTH: usize = 80;

/// The first column of a table is not made narrower than this.
const LEAST_FIRST_COLUMN: usize = 24;

/// Words in lines of at most 80 characters, indented; lines after the first by `hang` more. Longer words, and words joined
/// by a no-break space, are not broken.
pub fn paragraph(words: &str, indent: usize, hang: usize) -> String {
    filled(words, WIDTH, indent, hang)
}

fn filled(words: &str, width: usize, indent: usize, hang: usize) -> String {
    let mut lines = String::new();
    let mut line = " ".repeat(indent);
    let mut empty = true;
    for word in words.split([' ', '\n']).filter(|word| !word.is_empty()) {
        let length = line.chars().count() + word.chars().count() + usize::from(!empty);
        if !empty && length > width {
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

/// Rows in columns, separated and indented by two blanks. The first column is left-aligned, the others right-aligned. In a table wider than
/// 80 characters the first column is broken into lines.
pub fn table<const COLUMNS: usize>(rows: &[[String; COLUMNS]]) -> String {
    table_rows(rows).concat()
}

/// As [`table()`], row by row. A row whose first cell is broken has several lines.
pub fn table_rows<const COLUMNS: usize>(rows: &[[String; COLUMNS]]) -> Vec<String> {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
    let mut widths: Vec<usize> = (0..COLUMNS).map(|column| width(column).unwrap_or(0)).collect();
    let others: usize = widths.iter().skip(1).map(|width| 2 + width).sum();
    let room = WIDTH.saturating_sub(2 + others).max(LEAST_FIRST_COLUMN);
    if let Some(first) = widths.first_mut() {
        *first = (*first).min(room);
    }
    rows.iter().map(|row| table_row(row, &widths)).collect()
}

/// The numbers stand beside the first line of a broken cell.
fn table_row<const COLUMNS: usize>(row: &[String; COLUMNS], widths: &[usize]) -> String {
    let first = widths.first().copied().unwrap_or(0);
    // Blanks at the beginning of a cell are its indentation.
    let indent = row.first().map_or(0, |cell| cell.len() - cell.trim_start_matches(' ').len());
    let broken = match row.first() {
        Some(cell) if cell.chars().count() > first => filled(cell, first, indent, 2),
        Some(cell) => cell.clone(),
        None => String::new(),
    };
    let mut lines = broken.lines();
    let mut cells = vec![format!("{:<first$}", lines.next().unwrap_or_default())];
    let numbers = row.iter().zip(widths).skip(1);
    cells.extend(numbers.map(|(cell, &width)| format!("{cell:>width$}")));
    let mut text = format!("  {}", cells.join("  ")).trim_end().to_owned() + "\n";
    text.extend(lines.map(|line| format!("  {line}\n")));
    text
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

    #[test]
    fn a_wide_table_breaks_its_first_column() {
        let name =
            "phase-plane + on-axis-unit + spreading + directivity + element-gain + offset + lag";
        let rows = [[name, "0.85 %"], ["noise alone", "0.64 %"]].map(|row| row.map(str::to_owned));
        let text = table(&rows);
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert_eq!(text.lines().count(), 3);
        assert!(text.lines().next().is_some_and(|line| line.ends_with("0.85 %")), "{text}");
    }
}
