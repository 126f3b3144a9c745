//! What devices answer: the drivers run against a wire log whose received bytes were changed.
//!
//! `corpus/devices/NAME` has a rig file and the log of one device, `robot.log`, `receiver.log` or `focus-array.log`. Lines that were sent are
//! left out of the changes: a driver that is answered otherwise sends something else.

use std::path::{Path, PathBuf};

use fieldgap::acquisition::RigSetup;
use fieldgap::input::TomlSource;
use fieldgap::rig::replay::replay;
use fieldgap::rig::{RigConfig, Role};

use super::corpus::folder;
use super::mutation::{Step, mutated};

/// A device with its driver and its log.
pub struct Device {
    config: RigConfig,
    role: Role,
    log: String,
}

/// The devices of the corpus with this prefix of their name.
///
/// # Panics
/// If a file of the corpus cannot be read.
pub fn devices(prefix: &str) -> Vec<Device> {
    let entries = std::fs::read_dir(folder("devices")).expect("the corpus has devices");
    let mut folders: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    folders.sort();
    folders.retain(|path| {
        path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(prefix))
    });
    assert!(!folders.is_empty(), "no device is called {prefix}");
    folders.iter().flat_map(|folder| device(folder)).collect()
}

fn device(folder: &Path) -> Vec<Device> {
    let rig = TomlSource::read(&folder.join("rig.toml")).expect("a rig file");
    let config = RigSetup::parse(rig).expect("a valid rig file").rig;
    let roles = [
        ("robot.log", Role::Robot),
        ("receiver.log", Role::Receiver),
        ("focus-array.log", Role::FocusArray),
    ];
    let logs = roles.into_iter().filter_map(|(name, role)| {
        let log = std::fs::read_to_string(folder.join(name)).ok()?;
        Some(Device { config: config.clone(), role, log })
    });
    logs.collect()
}

impl Device {
    /// The log.
    pub fn log(&self) -> &str {
        &self.log
    }

    /// The log with changes in the bytes that were received: each step is for one answer.
    pub fn answering(&self, steps: &[Step]) -> Vec<u8> {
        let mut lines: Vec<String> = self.log.lines().map(str::to_owned).collect();
        let received = |line: &&mut String| line.split(' ').nth(1) == Some("<");
        let mut answers: Vec<&mut String> = lines.iter_mut().filter(received).collect();
        if answers.is_empty() {
            return self.log.clone().into_bytes();
        }
        for (n, step) in steps.iter().enumerate() {
            let which = (step.1 as usize).wrapping_mul(n + 1) % answers.len();
            let answer = &mut answers[which];
            let Some((head, text)) = answer.split_once(" < ") else { continue };
            let bytes = mutated(&unescaped(text), &[(step.0, step.2, step.1)], &[b"ok\n".to_vec()]);
            **answer = format!("{head} < {}", bytes.escape_ascii());
        }
        (lines.join("\n") + "\n").into_bytes()
    }

    /// Runs the driver against a log.
    ///
    /// # Panics
    /// If there is no runtime.
    pub fn run(&self, log: &[u8]) {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .start_paused(true)
            .build()
            .expect("a runtime");
        let _ = runtime.block_on(replay(&self.config, self.role, &String::from_utf8_lossy(log)));
    }
}

fn unescaped(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        let escape = if byte == b'\\' { rest.next() } else { None };
        bytes.push(match escape {
            None => byte,
            Some(b'n') => b'\n',
            Some(b'r') => b'\r',
            Some(b't') => b'\t',
            Some(b'x') => {
                let mut digit =
                    || rest.next().and_then(|digit| char::from(digit).to_digit(16)).unwrap_or(0);
                (digit() * 16 + digit()) as u8
            }
            Some(other) => other,
        });
    }
    bytes
}
