//! A characterization as text and as CSV.

use std::fmt::Write;

use super::{AppendixA, Characterization, Constant, FittedCurve, LEVELS_DB, PairFit, Readings};

/// Difference of the criterion above which one model is clearly better (Kass and Raftery, J. Am. Stat. Assoc. 90, 773,
/// 1995: "very strong").
const CLEAR_BIC: f64 = 10.0;
const DB_PER_NP: f64 = 20.0 / std::f64::consts::LN_10;

/// The axis, the laws compared, the angles, and the best model.
pub fn text(found: &Characterization, readings: &Readings) -> String {
    let best = found.best();
    let mut text = format!(
        "{} readings at {} heights, {:.1} to {:.1} mm; {} left out (too low, or too few at a height)\n\n",
        readings.values.len(),
        readings.heights_m.len(),
        readings.heights_m[0] * 1e3,
        readings.heights_m[readings.heights_m.len() - 1] * 1e3,
        readings.left_out
    );
    axis(&mut text, best);
    laws(&mut text, "on the axis", &found.axis_laws(), best, |pair| {
        (pair.axis_law.to_string(), &pair.axis_constants)
    });
    let (air_np_m, known) = readings.air_np_m;
    let _ = writeln!(
        text,
        "attenuation by ISO 9613-1: {:.2} dB/m at {:.0} Hz for {}\n",
        air_np_m * DB_PER_NP,
        readings.frequency_hz,
        if known { "the recorded air" } else { "air of 20 °C and 50 % (not recorded)" }
    );
    laws(&mut text, "directivity", &found.lobe_laws(), best, |pair| {
        (pair.lobe_law.to_string(), &pair.lobe_constants)
    });
    text += "\n";
    angles(&mut text, found);
    best_model(&mut text, found);
    text
}

fn axis(text: &mut String, best: &PairFit) {
    let (pose, errors) = (best.axis, best.axis_errors);
    let _ = writeln!(
        text,
        "axis: foot at ({:.3} ± {:.3}, {:.3} ± {:.3}) mm, tilt ({:.3} ± {:.3}, {:.3} ± {:.3})°, {:.3}° in total\n",
        pose.foot_m[0] * 1e3,
        errors.foot_m[0] * 1e3,
        pose.foot_m[1] * 1e3,
        errors.foot_m[1] * 1e3,
        pose.lean[0].atan().to_degrees(),
        errors.lean[0].to_degrees(),
        pose.lean[1].atan().to_degrees(),
        errors.lean[1].to_degrees(),
        pose.tilt_rad().to_degrees()
    );
}

fn laws<'c>(
    text: &mut String,
    heading: &str,
    pairs: &[(&'c PairFit, f64)],
    best: &PairFit,
    read: impl Fn(&'c PairFit) -> (String, &'c [Constant]),
) {
    let _ = writeln!(text, "{heading:<22} {:>8} {:>12} {:>12}  constants", "R²", "ΔAIC", "ΔBIC");
    for (pair, r_squared) in pairs {
        let (name, constants) = read(pair);
        let _ = writeln!(
            text,
            "{name:<22} {r_squared:>8.5} {:>12.1} {:>12.1}  {}",
            pair.aic - best.aic,
            pair.bic - best.bic,
            listed(constants)
        );
    }
}

fn listed(constants: &[Constant]) -> String {
    // The values of a table are in the transducer file.
    if constants.len() > 3 {
        return format!("{} angles", constants.len() + 1);
    }
    let each: Vec<String> = constants.iter().map(one).collect();
    if each.is_empty() { "none".to_owned() } else { each.join(", ") }
}

fn one(constant: &Constant) -> String {
    let Constant { name, unit, value, standard_error } = constant;
    // Two digits of the error, and as many decimals of the value.
    let decimals = (1.0 - standard_error.abs().log10().floor()).clamp(0.0, 8.0) as usize;
    let space = if unit.is_empty() { "" } else { " " };
    format!("{name} {value:.decimals$} ± {standard_error:.decimals$}{space}{unit}")
}

fn angles(text: &mut String, found: &Characterization) {
    let _ = write!(text, "{:>11}", "height (mm)");
    for level in LEVELS_DB {
        let _ = write!(text, " {:>16}", format!("{level} dB (°)"));
    }
    text.push('\n');
    for point in &found.profile.on_axis {
        let _ = write!(text, "{:>11.1}", point.height_m * 1e3);
        for level in LEVELS_DB {
            let own = found
                .profile
                .angles
                .iter()
                .find(|angle| angle.height_m == point.height_m && angle.level_db == level);
            let cell = own.map_or("-".to_owned(), |angle| {
                let [angle, error] =
                    [angle.angle_rad, angle.standard_error_rad].map(f64::to_degrees);
                format!("{angle:.2} ± {error:.2}")
            });
            let _ = write!(text, " {cell:>16}");
        }
        text.push('\n');
    }
    text.push('\n');
}

fn best_model(text: &mut String, found: &Characterization) {
    let best = found.best();
    let _ = writeln!(
        text,
        "best model: {} on the axis, {} directivity: R² {:.6}, residual {:.3e} rms",
        best.axis_law, best.lobe_law, best.r_squared, best.residual_rms
    );
    if let Some(next) = found.pairs.get(1) {
        let apart = next.bic - best.bic;
        let clear = if apart > CLEAR_BIC { "clearly" } else { "not clearly" };
        let _ = writeln!(
            text,
            "second, {clear} worse: {} and {}, ΔBIC {apart:.1}",
            next.axis_law, next.lobe_law
        );
    }
    if !best.converged {
        text.push_str("this fit did not converge; its standard errors are unreliable\n");
    }
}

/// The result of the thesis's script, with its angles.
pub fn text_of_appendix_a(found: &AppendixA) -> String {
    let value = |fit: &FittedCurve, index: usize| fit.constants[index].value;
    let [x, y, z] = found.largest_at_mm;
    let mut text = format!(
        "axis under the largest reading, at ({x}, {y}, {z}) mm; {} subtracted from every reading as noise\n\n",
        found.noise
    );
    let (axis, lobe) = (&found.on_axis, &found.lobe);
    let _ = writeln!(
        text,
        "on the axis, z in cm: {:.6} exp({:.6} z)   R² {:.6}",
        value(axis, 0),
        value(axis, 1),
        axis.r_squared
    );
    let _ = writeln!(
        text,
        "directivity, θ in degrees: {:.6} exp(-((θ - {:.6})/{:.6})²)   R² {:.6}\n",
        value(lobe, 0),
        value(lobe, 1),
        value(lobe, 2),
        lobe.r_squared
    );
    let _ = writeln!(text, "{:>11} {:>10} {:>9}", "height (mm)", "level (dB)", "angle (°)");
    for (height_mm, level_db, angle_deg) in &found.angles {
        let _ = writeln!(text, "{height_mm:>11.1} {level_db:>10} {angle_deg:>9.2}");
    }
    text
}

/// Every pair of laws, one row per constant.
pub fn csv(found: &Characterization) -> String {
    let mut text =
        "on_axis,lobe,r_squared,residual_rms,aic,bic,constant,unit,value,standard_error\n"
            .to_owned();
    for pair in &found.pairs {
        let constants = [&pair.floor, &pair.amplitude];
        let laws = pair.axis_constants.iter().chain(&pair.lobe_constants);
        for constant in constants.into_iter().chain(laws) {
            let _ = writeln!(
                text,
                "\"{}\",{},{:.8},{:.6e},{:.3},{:.3},{},{},{:.8e},{:.3e}",
                pair.axis_law,
                pair.lobe_law,
                pair.r_squared,
                pair.residual_rms,
                pair.aic,
                pair.bic,
                constant.name,
                constant.unit,
                constant.value,
                constant.standard_error
            );
        }
    }
    text
}
