//! The cells of a campaign: which there are, in what order, and the scan of each.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::bench::Filled;
use super::error::CampaignError;
use super::file::{Campaign, Order};
use fieldgap_acquisition::PlannedScan;
use fieldgap_input::NotAKey;

/// Longest name of a cell's folder, characters; longer ones are cut and end with a checksum. File systems allow 255 bytes.
const LONGEST: usize = 100;

/// A cell: one setting on one bench, in one round.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Cell {
    /// Its round, from 1.
    pub round: u32,
    /// Its repeat in the round, from 1.
    pub repeat: u32,
    /// Number of its bench.
    pub bench: usize,
    /// Number of the value of each condition.
    pub conditions: Vec<usize>,
    /// Number of the value of each axis.
    pub axes: Vec<usize>,
}

/// Cells between which no condition changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Number of the value of each condition.
    pub conditions: Vec<usize>,
    /// The cells of each bench, in order.
    pub queues: Vec<Vec<Cell>>,
}

impl Campaign {
    /// The cells of a round (from 1), in order. The same seed gives the same order.
    pub fn round(&self, round: u32, seed: u64) -> Vec<Block> {
        let conditions = combinations(self.conditions.iter().map(|one| one.values.len()));
        let axes = combinations(self.axes.iter().map(|axis| axis.sweep.values.len()));
        let mut settings: Vec<(u32, Vec<usize>, Vec<usize>)> = Vec::new();
        for condition in &conditions {
            for repeat in 1..=self.repeats {
                settings.extend(axes.iter().map(|axis| (repeat, condition.clone(), axis.clone())));
            }
        }
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // A stream for each round: the order of one does not depend on how many there were before.
        random.set_stream(u64::from(round));
        if self.order == Order::Random {
            settings.shuffle(&mut random);
        }
        let mut blocks: Vec<Block> = Vec::new();
        for (repeat, conditions, axes) in settings {
            if blocks.last().is_none_or(|block| block.conditions != conditions) {
                let queues = vec![Vec::new(); self.benches.len()];
                blocks.push(Block { conditions: conditions.clone(), queues });
            }
            let block = blocks.last_mut().expect("one was pushed");
            for (bench, queue) in block.queues.iter_mut().enumerate() {
                let (conditions, axes) = (conditions.clone(), axes.clone());
                queue.push(Cell { round, repeat, bench, conditions, axes });
            }
        }
        if self.order == Order::Blocked {
            for queue in blocks.iter_mut().flat_map(|block| &mut block.queues) {
                queue.shuffle(&mut random);
            }
        }
        blocks
    }

    /// All cells of a round, in no particular order of conditions.
    pub fn cells(&self, round: u32, seed: u64) -> impl Iterator<Item = Cell> {
        self.round(round, seed).into_iter().flat_map(|block| block.queues).flatten()
    }

    /// The names and values of a cell's conditions and axes, with the rig where there are several.
    pub fn values_of(&self, cell: &Cell) -> Vec<(String, String)> {
        let bench = (self.benches.len() > 1)
            .then(|| ("rig".to_owned(), self.benches[cell.bench].name.clone()));
        let conditions = self.conditions.iter().zip(&cell.conditions);
        let conditions =
            conditions.map(|(one, &value)| (one.name.clone(), one.values[value].label.clone()));
        let axes = self.axes.iter().zip(&cell.axes);
        let axes =
            axes.map(|(axis, &value)| (axis.name.clone(), axis.sweep.values[value].label.clone()));
        bench.into_iter().chain(conditions).chain(axes).collect()
    }

    /// The setting of a cell under a name that is the same in every round: `temperature=20 focus=left`.
    pub fn setting_of(&self, cell: &Cell) -> String {
        let values = self.values_of(cell);
        let parts: Vec<String> =
            values.iter().map(|(name, value)| format!("{name}={value}")).collect();
        if parts.is_empty() { "all".to_owned() } else { parts.join(" ") }
    }

    /// The name of a cell's folder, different for each cell of the campaign.
    pub fn id_of(&self, cell: &Cell) -> String {
        let setting = self.setting_of(cell);
        let repeat = if self.repeats > 1 { format!(" #{}", cell.repeat) } else { String::new() };
        let whole = format!("r{:03} {setting}{repeat}", cell.round);
        let fits = |letter: char| letter.is_alphanumeric() || "-_.+=".contains(letter);
        let plain: String =
            whole.chars().map(|letter| if fits(letter) { letter } else { '-' }).collect();
        if plain.len() <= LONGEST
            && !plain.contains("--")
            && whole.chars().all(|letter| fits(letter) || " #".contains(letter))
        {
            return plain;
        }
        // What was replaced or cut makes the difference: a checksum keeps it.
        let end = plain
            .char_indices()
            .map(|(at, _)| at)
            .take_while(|at| *at <= LONGEST)
            .last()
            .unwrap_or(0);
        format!("{}-{:08x}", &plain[..end.min(plain.len())], crc32fast::hash(whole.as_bytes()))
    }

    /// The digest of a cell's plan and rig file: another one means that the cell was changed.
    ///
    /// # Errors
    /// [`CampaignError::Cell`] if a key cannot be set.
    pub fn digest_of(&self, cell: &Cell) -> Result<String, CampaignError> {
        Ok(self.filled(cell)?.digest())
    }

    /// The scan of a cell.
    ///
    /// # Errors
    /// [`CampaignError::Cell`] if its values do not make a valid plan and rig file.
    pub fn scan_of(&self, cell: &Cell) -> Result<PlannedScan, CampaignError> {
        let name = scan_name(&self.plan_name, &self.id_of(cell));
        let label = self.setting_of(cell);
        self.filled(cell)?
            .scan(&name, if label == "all" { "" } else { &label })
            .map_err(|source| CampaignError::of_cell(&label, source))
    }

    fn filled(&self, cell: &Cell) -> Result<Filled, CampaignError> {
        let mut filled = Filled::of(&self.plan, &self.benches[cell.bench]);
        let refused = |place: &std::ops::Range<usize>, error: NotAKey| {
            let remedy = "name a key of the plan or the rig file, such as focus.0.x_mm or medium.temperature_c";
            self.source().fault(place.clone(), error.to_string(), remedy)
        };
        for (condition, &value) in self.conditions.iter().zip(&cell.conditions) {
            let Some(key) = &condition.sets else { continue };
            let value = condition.values[value].in_toml();
            filled.set(key, value).map_err(|error| refused(&condition.place, error))?;
        }
        for (axis, &value) in self.axes.iter().zip(&cell.axes) {
            let sweep = &axis.sweep;
            for (number, key) in sweep.parameters.iter().enumerate() {
                let value = sweep.values[value].for_key(number, sweep.parameters.len());
                filled.set(key, value).map_err(|error| refused(&sweep.place, error))?;
            }
        }
        Ok(filled)
    }
}

/// A new seed of the order.
///
/// # Errors
/// The system gives no random numbers.
pub fn fresh_seed() -> Result<u64, getrandom::Error> {
    // TOML has signed integers: the seed can be written into the file.
    Ok(getrandom::u64()? >> 1)
}

/// A name of a scan has letters, digits and `-_.+ `.
fn scan_name(plan: &str, id: &str) -> String {
    format!("{plan} {}", id.replace('=', " "))
}

fn combinations(counts: impl Iterator<Item = usize>) -> Vec<Vec<usize>> {
    counts.fold(vec![Vec::new()], |before, count| {
        let with =
            |head: Vec<usize>| (0..count).map(move |value| [head.clone(), vec![value]].concat());
        before.into_iter().flat_map(with).collect()
    })
}
