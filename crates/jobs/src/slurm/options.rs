//! What a job asks of Slurm.

use std::fmt;
use std::num::NonZeroU32;
use std::str::FromStr;

/// What a job asks of Slurm; what is `None` is left to the cluster.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlurmOptions {
    /// Partition.
    pub partition: Option<Partition>,
    /// Time limit of a task.
    pub time: Option<TimeLimit>,
    /// Memory of a task.
    pub memory: Option<Memory>,
    /// Processors of a task.
    pub cpus: NonZeroU32,
    /// Most tasks that run at a time.
    pub at_once: Option<NonZeroU32>,
    /// Lines of shell before the command, such as `module load`; `#SBATCH` lines at their beginning are options of the job.
    pub set_up: String,
}

impl Default for SlurmOptions {
    fn default() -> Self {
        Self {
            partition: None,
            time: None,
            memory: None,
            cpus: NonZeroU32::MIN,
            at_once: None,
            set_up: String::new(),
        }
    }
}

/// A text that is not the option it should be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is not {wanted}")]
pub struct NotAnOption {
    text: String,
    wanted: &'static str,
}

macro_rules! options {
    ($($(#[$doc:meta])* $name:ident: $valid:path, $wanted:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq)]
        pub struct $name(String);

        impl FromStr for $name {
            type Err = NotAnOption;

            fn from_str(text: &str) -> Result<Self, NotAnOption> {
                match $valid(text) {
                    true => Ok(Self(text.to_owned())),
                    false => Err(NotAnOption { text: text.to_owned(), wanted: $wanted }),
                }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }
    )*};
}

options! {
    /// The name of a partition, or several with commas.
    Partition: is_partition, "the name of a partition (letters, digits, - _ . and commas)";
    /// A time limit: minutes, or `hours:minutes:seconds`, or `days-hours:minutes`, as `sbatch --time` reads it.
    TimeLimit: is_time, "a time limit, such as 30 (minutes), 2:00:00 or 1-12:00";
    /// An amount of memory: mebibytes, or a number with K, M, G or T.
    Memory: is_memory, "an amount of memory, such as 500M or 4G";
}

fn is_partition(text: &str) -> bool {
    let part = |part: &str| {
        !part.is_empty()
            && !part.starts_with('-')
            && part.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
    };
    text.split(',').all(part)
}

fn is_number(text: &str) -> bool {
    (1..=9).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit())
}

fn is_time(text: &str) -> bool {
    let (rest, most) = match text.split_once('-') {
        Some((days, rest)) if is_number(days) => (rest, 3),
        Some(_) => return false,
        None => (text, 3),
    };
    let parts: Vec<&str> = rest.split(':').collect();
    parts.len() <= most && parts.iter().all(|part| is_number(part))
}

fn is_memory(text: &str) -> bool {
    let number = text.strip_suffix(['K', 'M', 'G', 'T']).unwrap_or(text);
    is_number(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_what_slurm_reads() {
        for good in ["30", "30:00", "2:00:00", "1-12", "1-12:30", "1-12:30:00"] {
            assert!(good.parse::<TimeLimit>().is_ok(), "{good}");
        }
        for wrong in ["", "-", "1-", "1-2-3", "1:2:3:4", "2h", "1 ; rm", "１"] {
            assert!(wrong.parse::<TimeLimit>().is_err(), "{wrong}");
        }
        assert!("4G".parse::<Memory>().is_ok() && "500".parse::<Memory>().is_ok());
        assert!("4 GB".parse::<Memory>().is_err() && "G".parse::<Memory>().is_err());
        assert!("main,long-2".parse::<Partition>().is_ok());
        for wrong in ["", "a,", "a b", "a\n#SBATCH", "$(x)", "--x"] {
            assert!(wrong.parse::<Partition>().is_err(), "{wrong}");
        }
    }
}
