//! One block of G-code: its words, and the errors of contradictory ones.

use super::settings::Dialect;

/// What a block asks for.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Block {
    /// `G0` (true) or `G1` (false), if given.
    pub rapid: Option<bool>,
    /// `G53`: coordinates are the machine's in this block.
    pub machine_frame: bool,
    /// `G90` or `G91`.
    pub absolute: Option<bool>,
    /// `G20` or `G21`.
    pub inches: Option<bool>,
    /// `G4`: the dwell, s.
    pub dwell_s: Option<f64>,
    /// `G92`: new coordinates of the present position.
    pub renames: bool,
    /// `G92.1`: cancels `G92`.
    pub unrenames: bool,
    /// X, Y, Z as written.
    pub coordinates: [Option<f64>; 3],
    /// F as written.
    pub feed: Option<f64>,
}

/// Parses a block.
///
/// # Errors
/// The code of the error.
pub(super) fn parse(line: &str, dialect: Dialect) -> Result<Block, u32> {
    let mut block = Block::default();
    let mut groups: Vec<&str> = Vec::new();
    let mut values: Vec<char> = Vec::new();
    let mut dwells = false;
    let mut dwell_s = None;
    for (letter, value) in words(line)? {
        match letter {
            'G' | 'M' => {
                let tenths = code(value, letter, dialect)?;
                let moves = letter == 'G' && matches!(tenths, 0 | 10 | 920);
                // Two codes that use the axis words have an error of their own, which takes precedence over that of their group.
                if moves && groups.iter().any(|&group| group == "motion" || group == "renaming") {
                    return Err(24);
                }
                let group = group(letter, tenths).ok_or(20_u32)?;
                if groups.contains(&group) {
                    return Err(21);
                }
                groups.push(group);
                match (letter, tenths) {
                    ('G', 0) => block.rapid = Some(true),
                    ('G', 10) => block.rapid = Some(false),
                    ('G', 40) => dwells = true,
                    ('G', 200) => block.inches = Some(true),
                    ('G', 210) => block.inches = Some(false),
                    ('G', 530) => block.machine_frame = true,
                    ('G', 900) => block.absolute = Some(true),
                    ('G', 910) => block.absolute = Some(false),
                    ('G', 920) => block.renames = true,
                    ('G', 921) => block.unrenames = true,
                    _ => {}
                }
            }
            'X' | 'Y' | 'Z' | 'F' | 'N' | 'P' | 'S' | 'T' => {
                if values.contains(&letter) {
                    return Err(25);
                }
                if matches!(letter, 'F' | 'N' | 'P' | 'S' | 'T') && value < 0.0 {
                    return Err(4);
                }
                values.push(letter);
                match letter {
                    'X' => block.coordinates[0] = Some(value),
                    'Y' => block.coordinates[1] = Some(value),
                    'Z' => block.coordinates[2] = Some(value),
                    'F' => block.feed = Some(value),
                    'P' => dwell_s = Some(value),
                    _ => {}
                }
            }
            _ => return Err(20),
        }
    }
    if dwells {
        block.dwell_s = Some(dwell_s.ok_or(28_u32)?);
    } else if dwell_s.is_some() {
        return Err(36);
    }
    if block.renames && block.coordinates == [None; 3] {
        return Err(26);
    }
    Ok(block)
}

/// A code in tenths: 92.1 is 921.
fn code(value: f64, letter: char, dialect: Dialect) -> Result<u32, u32> {
    let tenths = (value * 10.0).round();
    let is_whole = (value - value.trunc()).abs() < 1e-6;
    // GRBL keeps the whole part in eight bits and takes what does not fit for a fraction.
    if dialect == Dialect::Grbl && (value >= 256.0 || (letter == 'M' && !is_whole)) {
        return Err(23);
    }
    if value < 0.0 {
        return Err(4);
    }
    Ok(tenths as u32)
}

/// The modal group of a code that is known.
fn group(letter: char, tenths: u32) -> Option<&'static str> {
    Some(match (letter, tenths) {
        ('G', 0 | 10 | 800) => "motion",
        ('G', 40 | 530) => "of one block",
        ('G', 920 | 921) => "renaming",
        ('G', 170 | 180 | 190) => "plane",
        ('G', 200 | 210) => "units",
        ('G', 400) => "cutter",
        ('G', 490) => "length",
        ('G', 540) => "work",
        ('G', 610) => "path",
        ('G', 900 | 910) => "distance",
        ('G', 911) => "arc distance",
        ('G', 940) => "feed mode",
        ('M', 0 | 10 | 20 | 300) => "stopping",
        ('M', 30 | 40 | 50) => "spindle",
        ('M', 70 | 80 | 90) => "coolant",
        _ => return None,
    })
}

fn words(line: &str) -> Result<Vec<(char, f64)>, u32> {
    let mut words = Vec::new();
    let mut rest = line;
    while let Some(letter) = rest.chars().next() {
        if !letter.is_ascii_uppercase() {
            return Err(1);
        }
        let number = &rest[1..];
        let is_part = |&(at, c): &(usize, char)| {
            c.is_ascii_digit() || c == '.' || (at == 0 && matches!(c, '-' | '+'))
        };
        let length = number.char_indices().take_while(is_part).count();
        words.push((letter, number[..length].parse().map_err(|_| 2_u32)?));
        rest = &number[length..];
    }
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(line: &str) -> u32 {
        parse(line, Dialect::Grbl).expect_err(line)
    }

    #[test]
    fn a_block_says_what_it_asks_for() {
        let block = parse("G21G90G94G53G1X-150.000Y1Z+.5F600", Dialect::Grbl).expect("valid");
        assert_eq!(block.rapid, Some(false));
        assert_eq!(block.coordinates, [Some(-150.0), Some(1.0), Some(0.5)]);
        assert!(block.machine_frame && block.feed == Some(600.0) && block.inches == Some(false));
        assert_eq!(parse("G4P0.5", Dialect::Grbl).expect("valid").dwell_s, Some(0.5));
    }

    #[test]
    fn nonsense_has_the_codes_of_the_real_firmware() {
        assert_eq!(error("N1G4P0*33"), 1);
        assert_eq!(error("G1X"), 2);
        assert_eq!(error("M114"), 20);
        assert_eq!(error("M400"), 23);
        assert_eq!(parse("M400", Dialect::GrblHal), Err(20));
        assert_eq!(error("G0G1X1"), 24);
        assert_eq!(error("G90G91"), 21);
        assert_eq!(error("G1X1X2"), 25);
        assert_eq!(error("G4"), 28);
        assert_eq!(error("G1X1F-1"), 4);
        assert_eq!(error("Q1"), 20);
    }

    proptest::proptest! {
        #[test]
        fn any_text_is_taken_apart_or_refused(line in ".{0,60}") {
            let _ = parse(&line, Dialect::Grbl);
        }
    }
}
