//! A robot whose firmware is identified by its greeting or by its answers.

use std::time::Duration;

use serde::Deserialize;
use tokio::time::Instant;

use super::firmware::Firmware;
use super::grbl::{Grbl, GrblConfig};
use super::klipper::{Klipper, KlipperConfig};
use super::marlin::{Marlin, MarlinConfig};
use crate::Motion;
use crate::device::Role;
use crate::error::{Cause, RigError};
use crate::link::{ByteLink, Wire, open_serial};
use crate::space::Feed;
use crate::travel::Envelope;

/// How long a board may take to start and to be understood.
const FOUND_WITHIN: Duration = Duration::from_secs(20);

/// How long one round of listening takes. Opening the port restarts many boards, which then greet by themselves.
const LISTENS: Duration = Duration::from_millis(1500);

/// All are asked what they are; each takes the others' questions for unknown commands.
const QUESTIONS: &[u8] = b"\n$I\nM115\n";

/// As before, behind a reset: after a limit GRBL answers nothing else.
const QUESTIONS_BEHIND_A_RESET: &[u8] = b"\x18\n$I\nM115\n";

/// `[motion.auto]`: where the robot is reached. Its firmware is identified and driven with the defaults of its driver.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AutoConfig {
    /// The serial port; absent where a virtual rig gives it.
    pub port: Option<String>,
    /// Its speed, bits a second.
    #[serde(default = "default_baud")]
    pub baud: u32,
}

fn default_baud() -> u32 {
    115_200
}

impl AutoConfig {
    pub(crate) async fn open(
        &self,
        envelope: Envelope,
        feed: Feed,
        port: Option<&str>,
    ) -> Result<Box<dyn Motion>, RigError> {
        let mut wire = open_serial(Role::Robot, port, self.port.as_deref(), self.baud)?;
        let firmware = identify(&mut wire).await?;
        tracing::info!(device = %wire.device(), "identified the firmware as {firmware:?}");
        Ok(match firmware {
            Firmware::Marlin => Box::new(Marlin::begin(wire, &MarlinConfig::default()).await?),
            Firmware::Klipper => {
                let config = KlipperConfig::default();
                Box::new(Klipper::begin(wire, &config, envelope).await?)
            }
            Firmware::Grbl => {
                Box::new(Grbl::begin(wire, &GrblConfig::default(), envelope, feed).await?)
            }
        })
    }
}

/// Listens for a greeting, then asks. Answers that come later do not disturb the driver, which starts a new session.
async fn identify<L: ByteLink>(wire: &mut Wire<L>) -> Result<Firmware, RigError> {
    wire.attempting("identifying the firmware");
    let until = Instant::now() + FOUND_WITHIN;
    let questions = [b"".as_slice(), QUESTIONS, QUESTIONS_BEHIND_A_RESET];
    for round in 0.. {
        if Instant::now() >= until {
            break;
        }
        wire.send(questions[round.min(questions.len() - 1)]).await?;
        let next = until.min(Instant::now() + LISTENS);
        while let Some(line) = wire.line(next).await? {
            if let Some(firmware) = Firmware::of_line(&line) {
                return Ok(firmware);
            }
        }
    }
    Err(wire.error(Cause::Silent { waited: FOUND_WITHIN }))
}

#[cfg(test)]
mod tests {
    use tokio::io::{
        AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader, DuplexStream, duplex,
    };

    use super::*;
    use crate::device::Device;

    fn wire() -> (Wire<DuplexStream>, DuplexStream) {
        let (near, far) = duplex(1024);
        (Wire::new(near, Device::new(Role::Robot, "memory")), far)
    }

    async fn greeted_by(line: &str) -> Result<Firmware, RigError> {
        let (mut wire, mut far) = wire();
        far.write_all(line.as_bytes()).await.expect("room");
        identify(&mut wire).await
    }

    #[tokio::test(start_paused = true)]
    async fn a_greeting_is_enough() {
        for (line, firmware) in [
            ("start\n", Firmware::Marlin),
            ("Marlin 2.1.2.1\n", Firmware::Marlin),
            ("\r\nGrbl 1.1h ['$' for help]\r\n", Firmware::Grbl),
            ("GrblHAL 1.1f ['$' or '$HELP' for help]\r\n", Firmware::Grbl),
        ] {
            assert_eq!(greeted_by(line).await.expect("identified"), firmware, "{line}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_board_that_does_not_greet_is_asked() {
        for (answer, firmware) in [
            ("echo:Unknown command: \"$I\"\nok\n", Firmware::Marlin),
            (
                "// Unknown command:\"$I\"\nok\nok FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.12\n",
                Firmware::Klipper,
            ),
            ("ok\n[VER:1.1h.20190830:]\n[OPT:V,15,128]\nok\nerror:20\n", Firmware::Grbl),
        ] {
            let (mut wire, far) = wire();
            let board = tokio::spawn(async move {
                let mut far = BufReader::new(far);
                let mut line = String::new();
                while line.trim() != "M115" {
                    line.clear();
                    far.read_line(&mut line).await.expect("text");
                }
                far.write_all(answer.as_bytes()).await.expect("room");
                far
            });
            assert_eq!(identify(&mut wire).await.expect("identified"), firmware, "{answer}");
            drop(board.await);
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_machine_that_a_limit_silenced_is_reset_and_one_that_is_dead_given_up() {
        let (mut wire, mut far) = wire();
        let listening = tokio::spawn(async move {
            let mut received = Vec::new();
            far.read_to_end(&mut received).await.expect("bytes");
            received
        });
        let begun = Instant::now();
        let error = identify(&mut wire).await.expect_err("nobody answers");
        assert!(matches!(error.cause(), Cause::Silent { .. }), "{error}");
        assert!(begun.elapsed() <= FOUND_WITHIN + LISTENS);
        drop(wire);
        assert!(listening.await.expect("no panic").contains(&0x18));
    }
}
