//! What changed, as text of 80 columns and as CSV.

use super::Change;
use super::alignment::{Aligning, Alignment};
use fieldgap_text::{
    Uncertain, height_mm, millimetres, paragraph, percent, significant, table, uncertain,
};

impl Alignment {
    /// Whether the second record was moved.
    pub fn is_applied(&self) -> bool {
        self.chosen != Aligning::None
    }

    /// Where B was laid, in a few sentences.
    pub fn to_text(&self) -> String {
        let [x, y] = self.shift_m.map(|of| in_words(of.value * 1e3, of.standard_error * 1e3, "mm"));
        let turn = match self.turn_rad.estimated {
            true => {
                let of = self.turn_rad;
                let degrees = in_words(of.value.to_degrees(), of.standard_error.to_degrees(), "°");
                format!("turned by {degrees} about z and ")
            }
            false => String::new(),
        };
        let what = match self.is_applied() {
            true => format!("B was {turn}shifted by {x} along x and {y} along y"),
            false => "B was not moved".to_owned(),
        };
        let gap = |gap: Option<f64>| gap.map_or("–".to_owned(), percent);
        let mut text = paragraph(
            &format!(
                "{what} ({}). Difference as read {}, after the gain {}, after gain and alignment {}.",
                self.why,
                gap(self.gap_as_read),
                gap(self.gap_after_gain),
                percent(self.gap_after_alignment)
            ),
            0,
            2,
        );
        for words in &self.undetermined {
            text += &paragraph(&format!("Not determined: {words}."), 0, 2);
        }
        text
    }
}

/// An estimate with its error; says so where there is none.
fn in_words(value: f64, standard_error: f64, unit: &str) -> String {
    match standard_error.is_finite() {
        true => {
            let unit = if unit == "°" { unit.to_owned() } else { format!(" {unit}") };
            format!("{}{unit}", uncertain(Uncertain { value, standard_error }))
        }
        false => "an unknown length".to_owned(),
    }
}

impl Change {
    /// What changed, for a terminal.
    pub fn to_text(&self) -> String {
        let overall = &self.overall;
        let unit = &self.unit;
        let scaled = if self.scale == 1.0 {
            String::new()
        } else {
            format!(" B was divided by {}.", significant(self.scale, 4))
        };
        let aligned = self.alignment.as_ref().is_some_and(Alignment::is_applied);
        let (read_between, without) = if aligned { ("A", ["B", "A"]) } else { ("B", ["A", "B"]) };
        let interpolated = match overall.interpolated {
            0 => String::new(),
            n => format!(" At {n} of them {read_between} was interpolated."),
        };
        let left_out = match self.left_out {
            0 => String::new(),
            n => format!(" {n} places of {} are not in {}.", without[0], without[1]),
        };
        let mut text = paragraph(&self.sentence(), 0, 0);
        text += &format!("\nA: {}\nB: {}\n\n", self.a, self.b);
        text += &paragraph(
            &format!("{} common places.{interpolated}{left_out}{scaled}", overall.points),
            0,
            2,
        );
        text += &paragraph(
            &format!(
                "The difference is {} of the rms of A; {} of the places differ by more than 3 standard errors (noise alone: 0.27 %). Gain B/A {}, \
                 correlation {:.4}, χ² {} a place (noise alone: 1).",
                percent(overall.gap),
                percent(overall.beyond_three),
                uncertain(overall.gain),
                overall.correlation,
                significant(overall.chi_square_per_point, 3),
            ),
            0,
            2,
        );
        text += &self.alignment.as_ref().map_or(String::new(), Alignment::to_text);
        let mut rows = vec![
            ["", "difference", "gain", "χ²", "peak A", "peak B", "moved"].map(str::to_owned),
            ["", "", "", "", unit, unit, "mm"].map(str::to_owned),
        ];
        let mut radii = vec![["", "focal radius A (mm)", "B (mm)"].map(str::to_owned)];
        for height in &self.heights {
            let name = format!("drive {}, z = {} mm", height.focus, height_mm(height.z_m));
            let figures = [&height.a_figures, &height.b_figures].map(Option::as_ref);
            let peak =
                |n: usize| figures[n].map_or("–".to_owned(), |of| significant(of.peak.value, 4));
            let moved = match figures {
                [Some(a), Some(b)] => {
                    let [x, y] = [0, 1]
                        .map(|axis| b.peak_position_m[axis].value - a.peak_position_m[axis].value);
                    format!("{:.2}", x.hypot(y) * 1e3)
                }
                _ => "–".to_owned(),
            };
            let of = &height.figures;
            rows.push([
                name.clone(),
                percent(of.gap),
                format!("{:.4}", of.gain.value),
                significant(of.chi_square_per_point, 3),
                peak(0),
                peak(1),
                moved,
            ]);
            let radius = |n: usize| {
                let radius = figures[n].and_then(|of| of.focal_radius.as_ref()?.radius_m);
                radius.map_or("–".to_owned(), |radius: Uncertain| millimetres(radius))
            };
            radii.push([name, radius(0), radius(1)]);
        }
        text += &format!("\n{}\n{}", table(&rows), table(&radii));
        if !self.conditions.is_empty() {
            let mut rows = vec![["What differs", "A", "B"].map(str::to_owned)];
            rows.extend(self.conditions.iter().map(|condition| {
                [condition.what.to_owned(), condition.a.clone(), condition.b.clone()]
            }));
            text += &format!("\n{}", table(&rows));
        }
        if let Some(share) = self.explained_by_set_up {
            text += "\n";
            text += &paragraph(
                &if share > 0.0 {
                    format!(
                        "The simulations of the two set-ups predict {} of the squared difference.",
                        percent(share)
                    )
                } else {
                    "The simulations of the two set-ups predict another change than the readings show.".to_owned()
                },
                0,
                2,
            );
        }
        text.replace('\u{a0}', " ")
    }

    /// One row per drive and height.
    pub fn to_csv(&self) -> String {
        let mut csv = "focus,z_mm,points,interpolated,gap,gain,gain_error,correlation,chi_square_per_point,beyond_three,interpolation_error\n".to_owned();
        for height in &self.heights {
            let of = &height.figures;
            let interpolation = height.interpolation_error.map(|error| error.to_string());
            csv += &format!(
                "{},{},{},{},{},{},{},{},{},{},{}\n",
                height.focus,
                height.z_m * 1e3,
                of.points,
                of.interpolated,
                of.gap,
                of.gain.value,
                of.gain.standard_error,
                of.correlation,
                of.chi_square_per_point,
                of.beyond_three,
                interpolation.unwrap_or_default()
            );
        }
        csv
    }
}
