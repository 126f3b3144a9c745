//! Every target: first each kept case byte for byte, then mutations of them.

use fieldgap_fuzz::bounds::bounded;
use fieldgap_fuzz::corpus::cases;
use fieldgap_fuzz::devices::devices;
use fieldgap_fuzz::mutation::{Step, mutated};
use fieldgap_fuzz::{batches, files, records};

/// Which kept case, and how it is changed.
type Recipe = (u16, Vec<Step>);

fn fuzz(target: &'static str, run: fn(&[u8])) {
    let seeds = cases(target);
    for seed in &seeds {
        bounded(target, seed, run);
    }
    bolero::check!().with_type::<Recipe>().for_each(|(which, steps)| {
        let seed = &seeds[usize::from(*which) % seeds.len()];
        bounded(target, &mutated(seed, steps, &seeds), run);
    });
}

fn fuzz_devices(target: &'static str) {
    let devices = devices(target);
    for device in &devices {
        bounded(target, device.log().as_bytes(), |log| device.run(log));
    }
    bolero::check!().with_type::<Recipe>().for_each(|(which, steps)| {
        let device = &devices[usize::from(*which) % devices.len()];
        bounded(target, &device.answering(steps), |log| device.run(log));
    });
}

macro_rules! files {
    ($($target:ident: $run:path,)*) => {$(
        #[test]
        fn $target() {
            fuzz(stringify!($target), $run);
        }
    )*};
}

files! {
    plan: files::plan,
    rig: files::rig,
    truth: files::truth,
    transducer: files::transducer,
    calibration: files::calibration,
    display: files::display,
    study: files::study,
    campaign: files::campaign,
    record: records::record,
    elements: records::elements,
    journal: records::journal,
    events: records::events,
    campaign_log: records::campaign_log,
    rounds: records::rounds,
    map_rounds: records::map_rounds,
    sounding: records::sounding,
    figures: records::figures,
    thesis_log: records::thesis_log,
    grid: records::grid,
    points: records::points,
    batch: batches::batch,
    results: batches::results,
    slurm: batches::slurm,
}

macro_rules! devices {
    ($($target:ident,)*) => {$(
        #[test]
        fn $target() {
            fuzz_devices(stringify!($target));
        }
    )*};
}

devices! { marlin, grbl, klipper, stream_binary, stream_iq, stream_text, free_running, scpi, marlin_pin, thesis_array, sonic_surface, ultraino, }

/// The text of a wire log itself.
#[test]
fn wire_log() {
    let devices = devices("");
    let logs: Vec<Vec<u8>> =
        devices.iter().map(|device| device.log().as_bytes().to_vec()).collect();
    bolero::check!().with_type::<Recipe>().for_each(|(which, steps)| {
        let which = usize::from(*which) % devices.len();
        let log = mutated(&logs[which], steps, &logs);
        bounded("wire_log", &log, |log| devices[which].run(log));
    });
}
