//! A virtual rig behind ports, which is real for whoever opens them.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A running `fieldgap virtual`.
pub struct Heard(Child);

impl Heard {
    /// The rig of a file, at twenty times real time; the rig file that names its ports is written into `named`. `program` starts the program in the folder
    /// of both.
    pub fn behind(mut program: Command, folder: &Path, rig: &str, named: &str) -> Self {
        let text = std::fs::read_to_string(folder.join(rig)).expect("there");
        let paced = text.replace("pace = \"lockstep\"", "pace = { times = 20.0 }");
        assert_ne!(paced, text);
        std::fs::write(folder.join(rig), paced).expect("written");
        program.args(["virtual", rig, "--links", "ports", "--write-rig", named]);
        let child = program.stdout(Stdio::null()).spawn().expect("it starts");
        let begun = Instant::now();
        while !folder.join(named).exists() {
            assert!(begun.elapsed() < Duration::from_secs(20), "no rig file");
            std::thread::sleep(Duration::from_millis(20));
        }
        Self(child)
    }
}

impl Drop for Heard {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
