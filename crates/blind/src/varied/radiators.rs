//! How the elements radiate, and what the record believes of it: the same, as far as a transducer file can state it.

use std::sync::Arc;

use super::super::random_sequence::RandomSequence;
use fieldgap_acoustics::transducer::{DescribedTransducer, Directivity, MeasuredTable, OnAxis};
use fieldgap_input::Positive;
use fieldgap_records::TransducerFile;
use fieldgap_virtual_rig::face_motion::FaceMotion;
use fieldgap_virtual_rig::truth::TrueSource;

/// Up to so many products of elements and readings a record states the integral over the face, whose simulation is slow; beyond it states
/// the far field of the same face.
const FEW_PATHS: usize = 60_000;

/// Steps of the tables of far fields from 0 to 90°.
const TABLE_STEPS: usize = 60;

/// The radiator as it is and as it is believed to be.
pub(super) struct DrawnRadiator {
    pub truly: TrueSource,
    pub believed: TransducerFile,
}

/// A radiator in a housing of this diameter, and the name of its kind.
pub(super) fn draw(
    diameter_mm: f64,
    paths: usize,
    random: &mut RandomSequence,
) -> (DrawnRadiator, &'static str) {
    let radius_m = (diameter_mm * random.uniform(0.36, 0.46) * 1e2).round() / 1e2 * 1e-3;
    let kind = random.uniform(0.0, 1.0);
    if kind < 0.12 {
        (described(Directivity::Even, radius_m), "monopole")
    } else if kind < 0.34 {
        (described(Directivity::Piston, radius_m), "far-field piston")
    } else if kind < 0.60 {
        let law = if paths <= FEW_PATHS { Directivity::Rayleigh } else { Directivity::Piston };
        (face(FaceMotion::Whole, law, radius_m), "piston face")
    } else if kind < 0.74 {
        let motion = FaceMotion::HeldAtRim { power: 1 + random.index(2) as u8 };
        (face(motion, far_field(motion, radius_m), radius_m), "face held at its rim")
    } else if kind < 0.86 {
        let bend = (random.uniform(1.2, 1.7) * 1e3).round() / 1e3;
        let motion = FaceMotion::CentreAgainstRim { bend };
        (face(motion, far_field(motion, radius_m), radius_m), "bending face")
    } else {
        (described(data_sheet(random), radius_m), "measured table")
    }
}

/// A transducer that radiates exactly by its laws.
fn described(directivity: Directivity, radius_m: f64) -> DrawnRadiator {
    let transducer = DescribedTransducer { on_axis: OnAxis::Spherical, directivity };
    DrawnRadiator {
        truly: TrueSource {
            face_radius_m: Some(radius_m),
            transducer: Some(Arc::new(transducer.clone())),
            motion: FaceMotion::Whole,
        },
        believed: file(transducer, radius_m),
    }
}

/// A face that radiates by its integral.
fn face(motion: FaceMotion, law: Directivity, radius_m: f64) -> DrawnRadiator {
    let believed = DescribedTransducer { on_axis: OnAxis::Spherical, directivity: law };
    DrawnRadiator {
        truly: TrueSource { face_radius_m: Some(radius_m), transducer: None, motion },
        believed: file(believed, radius_m),
    }
}

fn file(transducer: DescribedTransducer, radius_m: f64) -> TransducerFile {
    let radius_m = Positive::new(radius_m).expect("a part of a diameter");
    TransducerFile::describing("transducer", "its maker", Some(radius_m), transducer)
}

/// The far field of a moving face as a table, as a laboratory would measure it without noise.
fn far_field(motion: FaceMotion, radius_m: f64) -> Directivity {
    // The carrier in usual air. Another temperature changes the angles of a lobe by its share of the sound speed, below a percent.
    let wavenumber_rad_m = std::f64::consts::TAU / (super::wavelength_mm() * 1e-3);
    let angles_deg: Vec<f64> =
        (0..=TABLE_STEPS).map(|n| 90.0 * n as f64 / TABLE_STEPS as f64).collect();
    let level = |deg: &f64| motion.far_field(wavenumber_rad_m * radius_m * deg.to_radians().sin());
    table(&angles_deg, &angles_deg.iter().map(level).collect::<Vec<_>>())
}

/// A lobe as a data sheet has it: every ten degrees, in steps of a hundredth, without a formula behind it.
fn data_sheet(random: &mut RandomSequence) -> Directivity {
    let width_deg = random.uniform(35.0, 60.0);
    let angles_deg: Vec<f64> = (0..=9).map(|n| 10.0 * f64::from(n)).collect();
    let pressures: Vec<f64> = angles_deg
        .iter()
        .map(|&deg| {
            let lobe = libm::exp(-(deg / width_deg).powi(2));
            let uneven = if deg == 0.0 { 1.0 } else { random.uniform(0.95, 1.05) };
            ((lobe * uneven) * 100.0).round() / 100.0
        })
        .collect();
    table(&angles_deg, &pressures)
}

fn table(angles_deg: &[f64], pressures: &[f64]) -> Directivity {
    Directivity::Table(MeasuredTable::new(angles_deg, pressures).expect("ascending angles"))
}
