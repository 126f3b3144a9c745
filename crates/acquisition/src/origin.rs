//! The original paths of a scan's plan and rig file, and the check that these files have not changed.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use toml::Table;

use super::AcquisitionError;
use super::difference::{Difference, differences};
use super::rig_setup::{RigSetup, real_devices};
use fieldgap_input::{Fault, MOST_TEXT, TomlSource, read_bytes};
use fieldgap_records::Plan;
use fieldgap_rig::Role;

pub(super) const FILE: &str = "origin.toml";

/// Copies of the plan and the rig file, in the scan's folder.
pub(super) const PLAN_COPY: &str = "plan.toml";
pub(super) const RIG_COPY: &str = "rig.toml";

/// Keys of a rig file that may change before a scan is resumed: a device may be plugged in elsewhere.
const MAY_CHANGE: [&str; 2] = ["port", "baud"];

/// `origin.toml`: the original paths of the copies in the scan's folder. File names in them are relative to the originals.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Origin {
    plan: PathBuf,
    rig: PathBuf,
    /// SHA-256 of the truth file of a virtual rig, hexadecimal.
    truth_sha256: Option<String>,
}

/// The rig file that a scan was made with, if it still exists and equals the copy in the scan's folder. The files that it names are found
/// beside it, not beside the copy.
pub fn original_rig(folder: &Path) -> Option<PathBuf> {
    let origin: Origin = TomlSource::read(&folder.join(FILE)).ok()?.parse().ok()?;
    let [original, copy] =
        [origin.rig.clone(), folder.join(RIG_COPY)].map(|path| TomlSource::read(&path).ok());
    (original?.text() == copy?.text()).then_some(origin.rig)
}

impl Origin {
    /// For a new scan.
    pub(super) fn of(plan: &Plan, rig_setup: &RigSetup) -> Result<Self, Fault> {
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let truth_sha256 = rig_setup.truth_path().map(|path| sha256_of(&path)).transpose()?;
        Ok(Self {
            plan: absolute(plan.path()),
            rig: absolute(rig_setup.source().path()),
            truth_sha256,
        })
    }

    pub(super) fn to_toml(&self) -> String {
        toml::to_string(self).expect("paths and a number are TOML")
    }

    /// The text of the copied plan, with the path of the original.
    pub(super) fn plan(&self, copy: &TomlSource) -> TomlSource {
        TomlSource::new(&self.plan, copy.text())
    }

    /// The current rig file, if it differs from its copy in ports alone; the copy, if the file no longer exists.
    pub(super) fn rig(&self, copy: &TomlSource) -> Result<TomlSource, AcquisitionError> {
        let as_begun = || Ok(TomlSource::new(&self.rig, copy.text()));
        if !self.rig.is_file() {
            return as_begun();
        }
        let now = TomlSource::read(&self.rig)?;
        if now.text() == copy.text() {
            return as_begun();
        }
        let [then_is, now_is] = [copy, &now].map(TomlSource::parse::<Table>);
        let mut changes: Vec<String> = differences(then_is?, now_is?, &MAY_CHANGE)
            .into_iter()
            .map(|Difference { key, then, now }| match (then, now) {
                (Some(then), Some(now)) => format!("`{key}` was {then} and is {now}"),
                (Some(_), None) => format!("`{key}` was removed"),
                _ => format!("`{key}` was added"),
            })
            .collect();
        // A port that is added or removed makes a virtual device real or a real one virtual.
        let [then, there] = [copy, &now].map(real_devices);
        for role in Role::ALL.iter().filter(|role| then.contains(role) != there.contains(role)) {
            let (was, is) =
                if then.contains(role) { ("real", "virtual") } else { ("virtual", "real") };
            changes.push(format!("the {role} was {was} and is {is}"));
        }
        if changes.is_empty() {
            Ok(now)
        } else {
            Err(AcquisitionError::OtherRig { path: self.rig.clone(), changes })
        }
    }

    /// Checks that the truth file of a virtual rig has not changed.
    pub(super) fn same_truth(&self, rig_setup: &RigSetup) -> Result<(), AcquisitionError> {
        match (rig_setup.truth_path(), &self.truth_sha256) {
            (Some(path), Some(then)) if sha256_of(&path)? != *then => {
                Err(AcquisitionError::OtherTruth(path))
            }
            _ => Ok(()),
        }
    }
}

fn sha256_of(path: &Path) -> Result<String, Fault> {
    let bytes = read_bytes(path, MOST_TEXT).map_err(|error| {
        let remedy =
            "check `truth` in [virtual] of the rig file; the path is relative to that file";
        Fault::of_file(path, format!("cannot be read: {error}"), remedy)
    })?;
    Ok(Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const THEN: &str = "name = \"r\"\n[motion]\norigin_mm = [1.0, 2.0, 3.0]\n[motion.marlin]\nport = \"/dev/ttyUSB0\"\n";

    fn resumed_with(now: &str) -> Result<String, AcquisitionError> {
        let folder = tempfile::tempdir().expect("a folder");
        let rig = folder.path().join("rig.toml");
        std::fs::write(&rig, now).expect("written");
        let origin = Origin { plan: "plan.toml".into(), rig: rig.clone(), truth_sha256: None };
        origin.rig(&TomlSource::new(&rig, THEN)).map(|source| source.text().to_owned())
    }

    #[test]
    fn another_port_is_accepted_and_another_origin_is_refused() {
        let moved = THEN.replace("USB0", "USB1") + "baud = 9600\n";
        assert_eq!(resumed_with(&moved).expect("the same rig"), moved);
        let error = resumed_with(&THEN.replace("2.0", "2.5")).expect_err("another rig");
        assert!(error.to_string().contains("`motion.origin_mm` was [1.0, 2.0, 3.0]"), "{error}");
        let error =
            resumed_with(&THEN.replace("[motion.marlin]", "[motion.other]")).expect_err("another");
        assert!(
            error.to_string().contains("`motion.marlin` was removed; `motion.other` was added"),
            "{error}"
        );
    }

    #[test]
    fn a_device_that_became_virtual_is_refused() {
        let mixed = format!("{THEN}[virtual]\ntruth = \"t.toml\"\n");
        let folder = tempfile::tempdir().expect("a folder");
        let rig = folder.path().join("rig.toml");
        std::fs::write(&rig, mixed.replace("port = \"/dev/ttyUSB0\"\n", "")).expect("written");
        let origin = Origin { plan: "plan.toml".into(), rig: rig.clone(), truth_sha256: None };
        let error = origin.rig(&TomlSource::new(&rig, &mixed)).expect_err("another rig");
        assert!(error.to_string().contains("the robot was real and is virtual"), "{error}");
    }

    #[test]
    fn a_missing_rig_file_is_replaced_by_its_copy() {
        let origin =
            Origin { plan: "p".into(), rig: "nowhere/rig.toml".into(), truth_sha256: None };
        let copy = TomlSource::new(Path::new("rig.toml"), THEN);
        assert_eq!(origin.rig(&copy).expect("the copy").text(), THEN);
    }
}
