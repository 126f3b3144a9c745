//! Numbers of the tasks of an array job, as Slurm writes them: `0-3,7,10-20:5%4`.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// A set of task numbers: ascending ranges, never next to each other.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TaskNumbers(Vec<RangeInclusive<u32>>);

/// A text that is not a set of task numbers.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a list of task numbers, such as 0-3,7")]
pub struct WrongNumbers(String);

/// Most ranges of a text; an array job has no more tasks (four million) than this times a few.
const MOST_RANGES: usize = 1 << 20;

impl TaskNumbers {
    /// The set of these numbers.
    pub fn new(numbers: impl IntoIterator<Item = u32>) -> Self {
        Self::joined(numbers.into_iter().map(|number| number..=number).collect())
    }

    fn joined(mut ranges: Vec<RangeInclusive<u32>>) -> Self {
        ranges.retain(|range| !range.is_empty());
        ranges.sort_by_key(|range| *range.start());
        let mut joined: Vec<RangeInclusive<u32>> = Vec::new();
        for range in ranges {
            match joined.last_mut() {
                Some(last) if *range.start() <= last.end().saturating_add(1) => {
                    *last = *last.start()..=*last.end().max(range.end());
                }
                _ => joined.push(range),
            }
        }
        Self(joined)
    }

    /// Whether a number is in the set.
    pub fn contains(&self, number: u32) -> bool {
        let after = self.0.partition_point(|range| *range.start() <= number);
        after > 0 && self.0[after - 1].contains(&number)
    }

    /// Whether the set has no number.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl fmt::Display for TaskNumbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, range) in self.0.iter().enumerate() {
            if index > 0 {
                f.write_str(",")?;
            }
            match range.start() == range.end() {
                true => write!(f, "{}", range.start())?,
                false => write!(f, "{}-{}", range.start(), range.end())?,
            }
        }
        Ok(())
    }
}

impl FromStr for TaskNumbers {
    type Err = WrongNumbers;

    /// Reads what Slurm writes, with or without brackets. The limit after `%` is left out.
    fn from_str(text: &str) -> Result<Self, WrongNumbers> {
        let wrong = || WrongNumbers(text.chars().take(80).collect());
        let bare = text.trim();
        let bare = bare.strip_prefix('[').and_then(|bare| bare.strip_suffix(']')).unwrap_or(bare);
        let (list, limit) = bare.split_once('%').map_or((bare, None), |(l, m)| (l, Some(m)));
        if limit.is_some_and(|limit| limit.parse::<u32>().is_err()) {
            return Err(wrong());
        }
        let mut ranges = Vec::new();
        for part in list.split(',') {
            let (range, step) = part.split_once(':').map_or((part, "1"), |(r, s)| (r, s));
            let (from, to) = range.split_once('-').unwrap_or((range, range));
            let [from, to, step] = [from, to, step].map(|number| number.parse::<u32>());
            let (Ok(from), Ok(to), Ok(step @ 1..)) = (from, to, step) else { return Err(wrong()) };
            if from > to {
                return Err(wrong());
            }
            match step {
                1 => ranges.push(from..=to),
                _ if (to - from) as usize / step as usize + ranges.len() > MOST_RANGES => {
                    return Err(wrong());
                }
                _ => ranges.extend((from..=to).step_by(step as usize).map(|n| n..=n)),
            }
            if ranges.len() > MOST_RANGES {
                return Err(wrong());
            }
        }
        Ok(Self::joined(ranges))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn forms_of_slurm() {
        let read = |text: &str| text.parse::<TaskNumbers>().map(|numbers| numbers.to_string());
        assert_eq!(read("7").as_deref(), Ok("7"));
        assert_eq!(read("[0-3,7,8%2]").as_deref(), Ok("0-3,7-8"));
        assert_eq!(read("0-10:5").as_deref(), Ok("0,5,10"));
        for wrong in ["", "N/A", "3-1", "1-", "1%x", "0-4294967295:2", "1:0", "[1", "99999999999"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
        assert_eq!(read("0-4294967295").as_deref(), Ok("0-4294967295"));
    }

    proptest! {
        #[test]
        fn a_set_reads_back_as_it_was_written(numbers in prop::collection::btree_set(0u32..60, 1..40)) {
            let set = TaskNumbers::new(numbers.iter().copied());
            let read: TaskNumbers = set.to_string().parse().expect("its own form");
            prop_assert_eq!(&read, &set);
            let held: BTreeSet<u32> = (0..70).filter(|&number| read.contains(number)).collect();
            prop_assert_eq!(held, numbers);
        }

        #[test]
        fn any_text_is_read_or_refused(text in "[-0-9,:%\\[\\]A/N ]{0,24}") {
            let _ = text.parse::<TaskNumbers>();
        }
    }
}
