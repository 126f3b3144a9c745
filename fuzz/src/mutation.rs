//! Changes of a valid file, which reach further than random bytes: what is not changed is still valid.

/// One change: which, where, and how much.
pub type Step = (u8, u32, u32);

/// Numbers at the ends of ranges and beyond.
const NUMBERS: [&str; 24] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "0.5",
    "1e-12",
    "1e-9",
    "1e-6",
    "9999.9",
    "10000",
    "99999.9",
    "1e5",
    "1e9",
    "1e12",
    "1e13",
    "1e17",
    "1e300",
    "1e308",
    "-1e308",
    "nan",
    "inf",
    "65536",
    "4294967295",
    "18446744073709551615",
];

/// Words that mean something to a reader or to a terminal.
const WORDS: [&str; 20] = [
    "\n",
    "\r\n",
    "\t",
    ",",
    ";",
    "=",
    "[",
    "]",
    "[[",
    "{",
    "\"",
    "#",
    "\\x1b[2J",
    "\x1b]0;\x07",
    "\u{202e}",
    "\u{9b}",
    "ok\n",
    "error:1\n",
    "\0",
    "µ",
];

/// Largest case, bytes.
const LARGEST: usize = 1 << 20;

/// A case changed step by step. `others` are further cases, of which parts are taken.
pub fn mutated(case: &[u8], steps: &[Step], others: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = case.to_vec();
    for &(kind, place, size) in steps {
        change(&mut bytes, kind, place as usize, size as usize, others);
        bytes.truncate(LARGEST);
    }
    bytes
}

fn change(bytes: &mut Vec<u8>, kind: u8, place: usize, size: usize, others: &[Vec<u8>]) {
    if bytes.is_empty() {
        bytes.push(size as u8);
    }
    let at = place % bytes.len();
    let short = 1 + size % 16;
    let end = (at + short).min(bytes.len());
    match kind % 12 {
        // A number for a number, the most fruitful change.
        0..=3 => {
            let new = NUMBERS[size % NUMBERS.len()];
            let number = number_from(bytes, at);
            bytes.splice(number, new.bytes());
        }
        4 => bytes[at] = size as u8,
        5 => bytes[at] ^= 1 << (size % 8),
        6 => drop(bytes.drain(at..end)),
        7 => {
            let part = bytes[at..end].to_vec();
            let times = [2, 10, 1000][size % 3];
            let part = part.repeat(times);
            bytes.splice(at..at, part);
        }
        8 => drop(bytes.splice(at..at, WORDS[size % WORDS.len()].bytes())),
        9 => {
            let line = line_at(bytes, at);
            match size % 3 {
                0 => drop(bytes.drain(line)),
                1 => {
                    let copy = bytes[line.clone()].to_vec();
                    drop(bytes.splice(line.end..line.end, copy));
                }
                _ => {
                    let copy = bytes[line].to_vec();
                    let other = line_at(bytes, size % bytes.len()).start;
                    drop(bytes.splice(other..other, copy));
                }
            }
        }
        10 => bytes.truncate(at),
        _ => {
            let other = &others[size % others.len()];
            if !other.is_empty() {
                let line = line_at(other, place % other.len());
                let here = line_at(bytes, at).start;
                drop(bytes.splice(here..here, other[line].iter().copied()));
            }
        }
    }
}

/// The first number at or after a place; else nothing at the place.
fn number_from(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let digit = |byte: &u8| byte.is_ascii_digit();
    let Some(start) = bytes[at..].iter().position(digit).map(|n| at + n) else { return at..at };
    let part = |byte: &u8| digit(byte) || b".+-eE_".contains(byte);
    let before = bytes[..start].iter().rev().take_while(|byte| part(byte)).count();
    let after = bytes[start..].iter().take_while(|byte| part(byte)).count();
    start - before..start + after
}

/// The line around a place, with its end.
fn line_at(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let start = bytes[..at].iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    let end =
        bytes[at..].iter().position(|byte| *byte == b'\n').map_or(bytes.len(), |n| at + n + 1);
    start..end
}
