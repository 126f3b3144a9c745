//! The figures as files for people and programs: those of each comparison, one after the other.

use fieldgap_comparison::Comparison;

/// Name of the table for people.
pub(super) const TEXT_NAME: &str = "table.txt";
/// Name of the table for programs.
pub(super) const CSV_NAME: &str = "comparison.csv";
/// Name of the comparisons in full.
pub(super) const JSON_NAME: &str = "comparison.json";

/// The text tables, one below the other.
pub(super) fn text(comparisons: &[Comparison]) -> String {
    let tables: Vec<String> = comparisons.iter().map(Comparison::to_text).collect();
    tables.join("\n")
}

/// The CSV tables as one, with the simulator in a column of its own before the others.
pub fn csv(comparisons: &[Comparison]) -> String {
    let mut csv = String::new();
    for comparison in comparisons {
        let table = comparison.to_csv();
        let mut lines = table.lines();
        let header = lines.next().unwrap_or_default();
        if csv.is_empty() {
            csv.push_str(&format!("simulator,{header}\n"));
        }
        for line in lines {
            csv.push_str(&format!("{},{line}\n", comparison.simulator));
        }
    }
    csv
}
