//! Small records as files, as many as wanted, without a scan: the same number gives the same record.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Pseudo-random numbers, 0 to 1, from a number (SplitMix64).
pub struct Draws(u64);

impl Draws {
    /// Those of a number.
    pub fn of(number: u64) -> Self {
        Self(number.wrapping_mul(0x2545_f491_4f6c_dd1d))
    }

    /// The next.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// One of some.
    pub fn one<'t, T>(&mut self, of: &'t [T]) -> &'t T {
        &of[((self.next() * of.len() as f64) as usize).min(of.len() - 1)]
    }
}

const RIGS: [&str; 3] = ["bench A", "bench B", "field rig"];
const EFFECTS: [&str; 3] = ["sound-speed", "array-tilt", "lag"];
const NOTES: [(&str, &str); 4] = [
    ("note", "Door was open"),
    ("repair", "Swapped the PREAMPLIFIER"),
    ("calibration", "Calibrated the microphone"),
    ("alarm", "gap left its limits"),
];

/// Writes record number `number` into a folder, which is made. A scan every three hours from the beginning of 2026 on.
pub fn write_record(folder: &Path, number: u64) {
    let mut draws = Draws::of(number);
    let report = folder.join("report");
    fs::create_dir_all(&report).expect("made");
    let put = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    let (day, hour) = (number / 8, 3 * (number % 8));
    let (year, month, day) = (2026 + day / 336, 1 + day % 336 / 28, 1 + day % 28);
    let at = format!("{year}-{month:02}-{day:02}T{hour:02}:00:00Z");
    let x_mm = *draws.one(&[0.0, 10.0, 17.5]);
    put(
        "scan.toml",
        &format!(
            "format = 1\nname = \"daily {number}\"\nrecorded = {at}\nreading = \"V\"\n[array]\nfrequency_hz = 40000.0\n\
             layout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n[medium]\n\
             speed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = {x_mm:?}\ny_mm = 0.0\nz_mm = 100.0\n\
             [[focus]]\nphases = \"all-zero\"\n"
        ),
    );
    put("rig.toml", &format!("name = \"{}\"\n", draws.one(&RIGS)));
    let state = if draws.next() < 0.05 { "partial\"\nreason = \"stopped" } else { "complete" };
    put("state.toml", &format!("state = \"{state}\"\n"));
    let mut samples = "time_s,focus,x_mm,y_mm,z_mm,reading\n".to_owned();
    for row in 0..12 {
        let reading = 1.0 + draws.next();
        let _ = writeln!(
            samples,
            "{row}.0,{},{}.0,0.0,{}.0,{reading}",
            row % 2,
            2 * row,
            80 + row % 3 * 20
        );
    }
    put("samples.csv", &samples);
    if draws.next() < 0.1 {
        let (kind, text) = draws.one(&NOTES);
        let kind = if *kind == "note" { String::new() } else { format!(",\"kind\":\"{kind}\"") };
        put(
            "notes.jsonl",
            &format!("{{\"at\":\"{at}\",\"who\":\"Ada\",\"text\":\"{text}\"{kind}}}\n"),
        );
    }
    if draws.next() < 0.1 {
        // Never compared.
        return;
    }
    fs::write(report.join("figures.json"), figures(&mut draws)).expect("written");
}

fn figures(draws: &mut Draws) -> String {
    let gap = 0.05 + 0.2 * draws.next();
    let figure =
        |value: f64, error: f64| format!("{{\"value\":{value},\"standard_error\":{error}}}");
    let mut heights = Vec::new();
    for focus in 0..2 {
        for z_mm in [80.0, 100.0, 120.0] {
            heights.push(format!(
                "{{\"focus\":{focus},\"z_mm\":{z_mm:?},\"gap\":{},\"correlation\":{},\"peak_ratio\":{},\"peak_offset_mm\":{},\
                 \"focal_radius_mm\":{}}}",
                figure(gap * (0.5 + draws.next()), 0.004),
                figure(1.0 - gap * gap, 0.001),
                figure(0.9 + 0.2 * draws.next(), 0.01),
                figure(2.0 * draws.next(), 0.1),
                figure(draws.next() - 0.5, 0.1),
            ));
        }
    }
    let cause = match draws.next() {
        none if none < 0.3 => "null".to_owned(),
        ambiguous if ambiguous < 0.5 => {
            "{\"verdict\":\"ambiguous\",\"effects\":[],\"probability\":0.4,\"parameters\":{}}"
                .to_owned()
        }
        _ => {
            let effect = draws.one(&EFFECTS);
            let parameter = match *effect {
                "sound-speed" => ("sound-speed.c_m_s", 343.0 + 4.0 * draws.next(), 0.2),
                "lag" => ("lag.lag_s", 0.02 * draws.next(), 0.001),
                _ => ("array-tilt.about_x_rad", 0.05 * draws.next(), 0.002),
            };
            format!(
                "{{\"verdict\":\"explained\",\"effects\":[\"{effect}\"],\"probability\":0.97,\"parameters\":{{\"{}\":{}}}}}",
                parameter.0,
                figure(parameter.1, parameter.2)
            )
        }
    };
    let air = figure(20.0 + 4.0 * draws.next(), 0.05);
    format!(
        "{{\"format\":1,\"software\":\"fieldgap 0.1.0\",\"simulator\":\"piston\",\"points\":12,\"gap\":{},\"noise_floor\":0.02,\
         \"level\":{},\"correlation\":{},\"heights\":[{}],\"cause\":{cause},\"air\":{{\"temperature_c\":{air},\
         \"humidity_percent\":null}}}}\n",
        figure(gap, 0.003),
        figure(8500.0 + 100.0 * draws.next(), 30.0),
        figure(1.0 - gap * gap, 0.0005),
        heights.join(",")
    )
}

/// Writes records 0 to `count` into folders of fifty below `root`.
pub fn write_records(root: &Path, count: u64) {
    for number in 0..count {
        write_record(&root.join(format!("week-{:03}/scan-{number:05}", number / 50)), number);
    }
}
