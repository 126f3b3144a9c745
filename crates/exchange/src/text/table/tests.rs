use proptest::prelude::*;

use super::*;
use crate::text::{Decimal, Delimiter};

fn table(text: &str) -> Result<TextTable, Fault> {
    TextTable::of_bytes(Path::new("t.csv"), text.as_bytes().to_vec())
}

fn names(table: &TextTable) -> Vec<&str> {
    table.headings.iter().map(|heading| heading.name.as_str()).collect()
}

#[test]
fn headings_are_found_above_the_rows() {
    for (text, expected, unit) in [
        ("x,y,z,p\n1,2,3,4\n", ["x", "y", "z", "p"], None),
        ("x_mm,y_mm,z_mm,p_V\n1,2,3,4\n", ["x", "y", "z", "p"], Some("mm")),
        ("# x y z p\n1 2 3 4\n", ["x", "y", "z", "p"], None),
        ("% made today\n%% x;y;z;p\n1;2;3;4\n", ["x", "y", "z", "p"], None),
        ("x;y;z;p\nmm;mm;mm;V\n1;2;3;4\n", ["x", "y", "z", "p"], Some("mm")),
        ("Date;today\n\nx [mm];y [mm];z [mm];p [V]\n1;2;3;4\n", ["x", "y", "z", "p"], Some("mm")),
        ("1,2,3,4\n", ["", "", "", ""], None),
    ] {
        let table = table(text).expect(text);
        assert_eq!(names(&table), expected, "{text}");
        assert_eq!(table.headings[0].unit.as_deref(), unit, "{text}");
        assert_eq!(table.column(3).expect("numbers"), [4.0], "{text}");
    }
}

#[test]
fn lines_before_the_table_are_counted() {
    let table = table("sep=,\nDate,today\nx,y,z\n1,2,3\n").expect("a table");
    assert_eq!((table.preamble, table.line(0)), (2, 4));
}

#[test]
fn separators_at_the_end_of_lines_are_no_columns() {
    let table = table("x,y,,\n1,2,,\n3,4,,\n").expect("a table");
    assert_eq!(names(&table), ["x", "y"]);
}

#[test]
fn faults_are_placed_at_their_line_and_column() {
    let table_of = |text: &str| table(text).and_then(|table| table.column(1));
    for (text, place, said) in [
        ("x,y\n1,2\n3,a\n", Some((3, 3)), "`a` is not a number"),
        ("x,y\n1,2\n# c\n\n3\n", Some((5, 2)), "1 cells"),
        ("x,y\r\n1,2\r\n3,4\r\n3,4,5\r\n", Some((4, 5)), "3 cells"),
        ("hello\n", None, "no row of numbers"),
        ("", None, "no row of numbers"),
    ] {
        let fault = table_of(text).expect_err(text);
        assert_eq!(fault.line_column(), place, "{text:?}: {fault}");
        assert!(fault.problem().contains(said), "{text:?}: {fault}");
    }
}

#[test]
fn files_of_spreadsheets_and_instruments_are_decoded() {
    let utf16: Vec<u8> =
        "\u{feff}x\ty\n1,5\t2\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let table = TextTable::of_bytes(Path::new("t.txt"), utf16).expect("a table");
    assert_eq!((table.encoding, table.column(0).expect("numbers")), (Some("UTF-16"), vec![1.5]));
    let latin = b"x [\xb5m];y\n1;2\n".to_vec();
    let table = TextTable::of_bytes(Path::new("t.txt"), latin).expect("a table");
    assert_eq!(table.headings[0].unit.as_deref(), Some("\u{b5}m"));
}

fn written(rows: &[[f64; 4]], delimiter: Delimiter, decimal: Decimal, ends: &str) -> String {
    let separator = match delimiter {
        Delimiter::Tab => "\t",
        Delimiter::Semicolon => ";",
        Delimiter::Comma => ",",
        Delimiter::Bar => "|",
        Delimiter::Blanks => "  ",
    };
    let cell = |value: &f64| {
        let point = format!("{value:?}");
        match (decimal, delimiter) {
            (Decimal::Point, _) => point,
            (Decimal::Comma, Delimiter::Comma) => format!("\"{}\"", point.replace('.', ",")),
            (Decimal::Comma, _) => point.replace('.', ","),
        }
    };
    let lines = rows.iter().map(|row| row.iter().map(cell).collect::<Vec<_>>().join(separator));
    lines.map(|line| line + ends).collect()
}

proptest! {
    #[test]
    fn the_same_numbers_in_any_dialect_read_back_the_same(
        rows in prop::collection::vec(prop::array::uniform4(-1e4..1e4f64), 1..20),
        ends in prop_oneof![Just("\n"), Just("\r\n"), Just("\r")],
        heading in prop_oneof![Just(""), Just("# comment"), Just("File made by a program")],
    ) {
        for delimiter in [
            Delimiter::Tab, Delimiter::Semicolon, Delimiter::Comma, Delimiter::Bar, Delimiter::Blanks,
        ] {
            for decimal in [Decimal::Point, Decimal::Comma] {
                let text = format!("{heading}{ends}{}", written(&rows, delimiter, decimal, ends));
                let table = table(&text).expect("a table");
                prop_assert_eq!(table.dialect, Dialect { delimiter, decimal });
                for column in 0..4 {
                    let expected: Vec<f64> = rows.iter().map(|row| row[column]).collect();
                    prop_assert_eq!(table.column(column).expect("numbers"), expected);
                }
            }
        }
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "[-0-9.,;eNa #%\"\t\r\n\u{3bb}x]{0,80}") {
        if let Ok(table) = table(&text) {
            for column in 0..table.headings.len() {
                let _ = table.column(column);
            }
        }
    }
}
