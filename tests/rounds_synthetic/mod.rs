//! A closed loop with every kind of round: a cause that is taken back, rivals, and one that holds with a part that no file has.

use std::path::Path;

use fieldgap::acoustics::Vec3;
use fieldgap::closed_loop::{Corrected, Cure, End, Likely, Purpose, Round, Verification};
use fieldgap::correction::{ChangedKey, Unwritten};
use fieldgap::diagnosis::{EffectId, Verdict};
use fieldgap::input::TomlSource;
use fieldgap::records::{BoxMm, ClosedLoop, RecordedSample, RecordedScan, ScanSetup};

const SETUP: &str = "format = 1\nname = \"find-out\"\nrecorded = 2026-11-20T10:02:00Z\nreading = \"V\"\n\
    [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 2\nrows = 2\nelement_diameter_mm = 10.0\nspacing_mm = 0.0\n\
    [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n\
    [[focus]]\nx_mm = 2.0\ny_mm = -1.0\nz_mm = 120.0\n[[focus]]\nphases_rad = [0.0, 1.0, 2.0, 3.0]\n";

/// Readings of each round.
const READINGS: usize = 24;

pub fn settings() -> ClosedLoop {
    let within = BoxMm { least: Vec3::new(-20.0, -20.0, 80.0), most: Vec3::new(20.0, 20.0, 140.0) };
    ClosedLoop { longest_s: Some(1200.0), ..ClosedLoop::within(within) }
}

/// The readings: on a spiral, a second apart, every sixth silent and every second with the drive that the loop added.
pub fn record(rounds: &[Round]) -> RecordedScan {
    let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), SETUP)).expect("good");
    let count: usize = rounds.iter().map(|round| round.readings).sum();
    let samples = (0..count).map(|n| {
        let angle = 0.7 * n as f64;
        let at_m =
            Vec3::new(0.018 * angle.cos(), 0.018 * angle.sin(), 0.08 + 0.0005 * (n % 100) as f64);
        let focus = if n % 6 == 0 { None } else { Some(n % 2) };
        RecordedSample::measured(n as f64, focus, at_m, 1.0, None)
    });
    RecordedScan { setup, samples: samples.collect() }
}

fn round(number: usize, purpose: Purpose, verdict: Verdict, sets: &[(&[EffectId], f64)]) -> Round {
    let likely = |(effects, probability): &(&[EffectId], f64)| Likely {
        effects: effects.to_vec(),
        probability: *probability,
    };
    let named = match verdict {
        Verdict::Ambiguous => sets.iter().take(2).map(|(set, _)| set.to_vec()).collect(),
        Verdict::Unexplained | Verdict::None => Vec::new(),
        _ => vec![sets[0].0.to_vec()],
    };
    Round {
        round: number,
        purpose,
        before: READINGS * number,
        readings: if purpose == Purpose::End { 0 } else { READINGS },
        drives: [1, 2],
        verdict: Some(verdict),
        named,
        probabilities: sets.iter().map(likely).collect(),
        outside: if verdict == Verdict::Unexplained { 1.0 } else { 0.02 },
        expected_bits: (purpose == Purpose::Explore).then_some(0.75),
        expected_s: 20.0,
        cure: None,
        verification: None,
        end: None,
        reason: format!("The reason of round {number}."),
    }
}

fn tested(gap: f64, holds: bool) -> Verification {
    Verification {
        readings: READINGS,
        gap_before: 0.21,
        gap_before_error: 0.02,
        gap_after: 0.021,
        gap_after_error: 0.002,
        noise: 0.02,
        chi_square: 1.1,
        corrected: Some(Corrected {
            gap,
            gap_error: 0.1 * gap,
            chi_square: (gap / 0.02).powi(2),
            departure: if holds { 0.02 } else { 2.5 },
        }),
        holds,
    }
}

fn cure(round: usize, accounted: &[EffectId]) -> Cure {
    let why = "no set-up file has a key for it";
    Cure {
        folder: Some(format!("corrected-round-{round}")),
        corrected: vec!["pitch.ratio = 1.0213 ± 0.0004".to_owned()],
        changes: vec![ChangedKey {
            key: "array.spacing_mm".to_owned(),
            before: Some("0.0".to_owned()),
            after: Some("0.21".to_owned()),
        }],
        accounted: accounted
            .iter()
            .map(|effect| Unwritten { effect: *effect, why: why.to_owned() })
            .collect(),
    }
}

/// The rounds.
pub fn rounds() -> Vec<Round> {
    use EffectId::{Pitch, SoundSpeed, Turbulence};
    let rivals: &[(&[EffectId], f64)] = &[(&[Pitch], 0.5), (&[SoundSpeed], 0.4), (&[], 0.1)];
    let certain: &[(&[EffectId], f64)] = &[(&[Pitch], 0.97), (&[SoundSpeed], 0.03)];
    let both: &[(&[EffectId], f64)] = &[(&[Turbulence, Pitch], 0.99), (&[Pitch], 0.01)];
    let first = Round {
        purpose: Purpose::First,
        verdict: None,
        named: Vec::new(),
        probabilities: Vec::new(),
        expected_bits: None,
        outside: 0.0,
        ..round(0, Purpose::Explore, Verdict::Ambiguous, rivals)
    };
    let verify = |number, sets, accounted: &[EffectId]| Round {
        cure: Some(cure(number, accounted)),
        ..round(number, Purpose::Verify, Verdict::Explained, sets)
    };
    vec![
        first,
        round(1, Purpose::Explore, Verdict::Ambiguous, rivals),
        verify(2, certain, &[]),
        Round {
            verification: Some(tested(0.08, false)),
            ..round(3, Purpose::Explore, Verdict::Unexplained, certain)
        },
        verify(4, both, &[Turbulence]),
        Round {
            verification: Some(tested(0.0205, true)),
            end: Some(End::Verified),
            ..round(5, Purpose::End, Verdict::Explained, both)
        },
    ]
}
