//! Focal radius, peak and sub-peaks against the swept parameters of a study.

use super::axes::{Axes, LABEL_TEXT};
use super::marker::Series;
use super::panel_row::PanelRow;
use super::{Picture, panel_row};
use fieldgap_canvas::{Align, Canvas, CanvasError, Pen, Point};
use fieldgap_study::{Figure, Row, Study, StudyResult};

/// Values of the second sweep that get a curve each, at most.
const MOST_CURVES: usize = 5;

/// The three panels of a study.
pub(crate) struct StudyCurves<'a> {
    study: &'a Study,
    result: &'a StudyResult,
    along: Along,
    row: PanelRow,
}

/// An entry of the legend.
enum Entry {
    Words(String),
    Curve(usize, String),
    CutOff,
    Outside,
}

const CUT_OFF: &str = "open: cut off by the edge of the map";
const OUTSIDE: &str = "peak outside the map";

impl Entry {
    fn width(&self) -> f64 {
        let of = |words: &str, character: f64| character * words.chars().count() as f64;
        match self {
            Self::Words(words) => 24.0 + of(words, 7.5),
            Self::Curve(_, label) => 44.0 + of(label, 7.5),
            Self::CutOff => 44.0 + of(CUT_OFF, 7.0),
            Self::Outside => 44.0 + of(OUTSIDE, 7.0),
        }
    }
}

/// The values along x.
enum Along {
    Numbers(Vec<f64>),
    Names(Vec<String>),
}

impl Along {
    fn at(&self, index: usize) -> f64 {
        match self {
            Self::Numbers(numbers) => numbers[index],
            Self::Names(_) => index as f64,
        }
    }
}

impl<'a> StudyCurves<'a> {
    /// The curves of a study, its first sweep along x, a curve for each value of its second; `None` if that has too many.
    pub fn new(study: &'a Study, result: &'a StudyResult) -> Option<Self> {
        let first = study.sweeps.first()?;
        let few = study.sweeps.get(1).is_none_or(|second| second.values.len() <= MOST_CURVES);
        let along = match first.ascending_numbers() {
            Some(numbers) => Along::Numbers(numbers),
            None => Along::Names(first.values.iter().map(|value| value.label.clone()).collect()),
        };
        few.then_some(Self { study, result, along, row: PanelRow::new(Figure::ALL.len()) })
    }

    /// The rows of each curve: one, or one for each value of the second sweep.
    fn curves(&self) -> Vec<Vec<&'a Row>> {
        let count = self.study.sweeps.get(1).map_or(1, |second| second.values.len());
        let own = |curve: usize| {
            let belongs = move |row: &&Row| row.values.get(1).is_none_or(|&value| value == curve);
            self.result.rows.iter().filter(belongs).collect()
        };
        (0..count).map(own).collect()
    }

    fn range(&self) -> (f64, f64) {
        match &self.along {
            Along::Names(names) => (-0.5, names.len() as f64 - 0.5),
            Along::Numbers(numbers) => {
                let (from, to) = (numbers[0], numbers[numbers.len() - 1]);
                let margin = if to > from { 0.06 * (to - from) } else { 1.0 };
                (from - margin, to + margin)
            }
        }
    }

    fn legend(&self) -> Vec<Entry> {
        let mut entries = Vec::new();
        if let Some(second) = self.study.sweeps.get(1) {
            entries.push(Entry::Words(format!("{}:", axis_label(&second.parameters))));
            let values = second.values.iter().enumerate();
            entries.extend(values.map(|(number, value)| Entry::Curve(number, value.label.clone())));
        }
        if self.result.rows.iter().any(|row| row.draws.len() > 1) {
            entries.push(Entry::Words("bars: central 90 % of the random arrays".to_owned()));
        }
        if self.result.rows.iter().any(is_cut_off) {
            entries.push(Entry::CutOff);
        }
        if self.is_outside_somewhere() {
            entries.push(Entry::Outside);
        }
        entries
    }

    fn is_outside_somewhere(&self) -> bool {
        self.result.rows.iter().any(|row| row.outside() == row.draws.len())
    }

    fn panel(&self, canvas: &mut Canvas, index: usize, figure: Figure) -> Result<(), CanvasError> {
        let curves = self.curves();
        let reach =
            |row: &&Row| row.figure(figure).map_or(0.0, |found| found.p95.max(found.median));
        let top = curves.iter().flatten().map(reach).fold(0.0, f64::max);
        let axes = self.row.axes(index, self.range(), (0.0, panel_row::a_little_above(top)));
        let (title, label) = titles(figure);
        panel_row::frame(canvas, &axes, title, label)?;
        let label = axis_label(&self.study.sweeps[0].parameters);
        match &self.along {
            Along::Numbers(_) => axes.x_axis(canvas, &label)?,
            Along::Names(names) => axes.x_names(canvas, names, &label)?,
        }
        for (number, rows) in curves.iter().enumerate() {
            self.curve(canvas, &axes, (number, curves.len()), rows, figure)?;
        }
        Ok(())
    }

    fn curve(
        &self,
        canvas: &mut Canvas,
        axes: &Axes,
        (number, of): (usize, usize),
        rows: &[&Row],
        figure: Figure,
    ) -> Result<(), CanvasError> {
        let series = Series::Numbered(number);
        let pen = Pen { colour: series.colour(), width: 1.75 };
        // Names have no order that a line could show; beside one another their marks stay apart.
        let aside = match self.along {
            Along::Names(_) => 0.12 * (number as f64 - 0.5 * (of as f64 - 1.0)),
            Along::Numbers(_) => 0.0,
        };
        let found: Vec<_> = rows
            .iter()
            .filter_map(|row| {
                Some((self.along.at(row.values[0]) + aside, *row, row.figure(figure)?))
            })
            .collect();
        if let Along::Numbers(_) = self.along {
            // No line crosses a value whose peak is outside the map.
            for part in rows.split(|row| row.figure(figure).is_none()) {
                let place = |row: &&Row| {
                    let x = self.along.at(row.values[0]);
                    row.figure(figure).map(|found| axes.place(x, found.median))
                };
                let line: Vec<Point> = part.iter().filter_map(place).collect();
                canvas.dashed(&line, series.dash(), pen)?;
            }
        }
        for row in rows.iter().filter(|row| row.outside() == row.draws.len()) {
            let x = self.along.at(row.values[0]) + aside;
            outside_mark(canvas, axes.place(x, axes.y.0), series)?;
        }
        for (x, row, found) in found {
            if row.draws.len() > 1 {
                let (low, high) = (axes.place(x, found.p05), axes.place(x, found.p95));
                canvas.line(low, high, pen)?;
                for end in [low, high] {
                    canvas.line((end.0 - 5.0, end.1), (end.0 + 5.0, end.1), pen)?;
                }
            }
            let whole = match figure {
                Figure::FocalRadius => !is_cut_off(row),
                Figure::Peak | Figure::SubPeaks => true,
            };
            series.mark_on_curve(canvas, axes.place(x, found.median), whole)?;
        }
        Ok(())
    }
}

impl Picture for StudyCurves<'_> {
    fn size(&self) -> (u32, u32) {
        self.row.size()
    }

    fn fit(&mut self, width: f64) -> Result<(), f64> {
        let legend: Vec<f64> = self.legend().iter().map(Entry::width).collect();
        self.row.fit(width, &legend)
    }

    fn description(&self) -> String {
        let sweeps: Vec<String> = self.study.sweeps.iter().map(|sweep| sweep.name()).collect();
        let outside = match self.is_outside_somewhere() {
            true => " Where the peak is outside the map, there is no figure.",
            false => "",
        };
        let sweeps = sweeps.join(" and ");
        format!("Focal radius, peak and number of sub-peaks against {sweeps}.{outside}")
    }

    fn draw(&self, canvas: &mut Canvas) -> Result<(), CanvasError> {
        for (index, figure) in Figure::ALL.into_iter().enumerate() {
            self.panel(canvas, index, figure)?;
        }
        let entries = self.legend();
        let widths: Vec<f64> = entries.iter().map(Entry::width).collect();
        for (index, entry) in entries.iter().enumerate() {
            let (x, y) = self.row.legend_place(index, &widths);
            let (words, from) = match entry {
                Entry::Words(words) => (words.as_str(), x),
                Entry::Curve(number, label) => {
                    Series::Numbered(*number).mark_on_curve(canvas, (x, y), true)?;
                    (label.as_str(), x + 14.0)
                }
                Entry::CutOff => {
                    Series::Numbered(0).mark_on_curve(canvas, (x + 6.0, y), false)?;
                    (CUT_OFF, x + 20.0)
                }
                Entry::Outside => {
                    outside_mark(canvas, (x + 6.0, y + 4.0), Series::Numbered(0))?;
                    (OUTSIDE, x + 20.0)
                }
            };
            canvas.text(words, (from, y), LABEL_TEXT, Align::Right)?;
        }
        Ok(())
    }
}

/// Whether the map cuts off the focus of the first draw.
fn is_cut_off(row: &Row) -> bool {
    row.first().figures().is_some_and(|figures| !figures.cut_off.is_empty())
}

/// The mark of a value whose peak is outside the map: a cross that stands on the axis.
fn outside_mark(canvas: &mut Canvas, (x, y): Point, series: Series) -> Result<(), CanvasError> {
    let pen = Pen { colour: series.colour(), width: 1.75 };
    canvas.line((x - 4.0, y - 8.0), (x + 4.0, y), pen)?;
    canvas.line((x - 4.0, y), (x + 4.0, y - 8.0), pen)
}

/// Title of a figure's panel, and label of its axis.
pub(super) fn titles(figure: Figure) -> (&'static str, &'static str) {
    match figure {
        Figure::FocalRadius => ("focal radius", "radius (mm)"),
        Figure::Peak => ("peak", "pressure (simulator's unit)"),
        Figure::SubPeaks => ("sub-peaks", "number"),
    }
}

/// Keys as the label of an axis: `array.spacing_mm` is "array: spacing (mm)".
pub(super) fn axis_label(parameters: &[String]) -> String {
    const UNITS: [(&str, &str); 9] = [
        ("_mm", "mm"),
        ("_hz", "Hz"),
        ("_m_s", "m/s"),
        ("_c", "°C"),
        ("_percent", "%"),
        ("_kpa", "kPa"),
        ("_rad", "rad"),
        ("_deg", "°"),
        ("_pct", "%"),
    ];
    let keys: Vec<&str> =
        parameters.iter().map(|key| key.rsplit('.').next().unwrap_or(key)).collect();
    let section = parameters[0].rsplit_once('.').map_or("", |(section, _)| section);
    let unit = UNITS.iter().find(|(ending, _)| keys.iter().all(|key| key.ends_with(ending)));
    let ending = unit.map_or("", |(ending, _)| ending);
    let words: Vec<String> =
        keys.iter().map(|key| key.trim_end_matches(ending).replace('_', " ")).collect();
    let words = words.join(" = ");
    let named =
        if section.is_empty() { words } else { format!("{}: {words}", section.replace('.', " ")) };
    unit.map_or(named.clone(), |(_, unit)| format!("{named} ({unit})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_become_labels_with_their_units() {
        let label = |keys: &[&str]| {
            axis_label(&keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(label(&["array.spacing_mm"]), "array: spacing (mm)");
        assert_eq!(label(&["array.columns", "array.rows"]), "array: columns = rows");
        assert_eq!(label(&["medium.speed_of_sound_m_s"]), "medium: speed of sound (m/s)");
        assert_eq!(label(&["focus"]), "focus");
    }
}
