//! The figures of all comparisons as text, CSV and JSON.

use fieldgap_comparison::Comparison;

/// Name of the text table.
pub(super) const TEXT_NAME: &str = "table.txt";
/// Name of the CSV table.
pub(super) const CSV_NAME: &str = "comparison.csv";
/// Name of the file with the complete comparisons.
pub(super) const JSON_NAME: &str = "comparison.json";

/// The text tables of the comparisons, in their order.
pub(super) fn text(comparisons: &[Comparison]) -> String {
    let tables: Vec<String> = comparisons.iter().map(Comparison::to_wide_text).collect();
    tables.join("\n")
}

/// One CSV table of all comparisons: a row for each simulator, drive and height, with the simulator in the first column.
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
