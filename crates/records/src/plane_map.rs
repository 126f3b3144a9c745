//! The samples of a plane as a map on a regular grid, if they were taken on one.

use super::planes::Plane;
use super::sample::RecordedSample;
use fieldgap_acoustics::metrics::PlaneMap;

/// Largest distance of a reported position from its grid line, millimetres.
pub const OFF_LINE_MM: f64 = 0.1;

/// Largest share of samples off the grid: points revisited or added between those of a plane.
const MAX_OFF_GRID: f64 = 0.1;

/// Smallest share of the grid's points that must have been measured for a useful map.
const MIN_MEASURED: f64 = 0.5;

/// A plane that was scanned on a regular grid.
#[derive(Debug, Clone, PartialEq)]
pub struct MappedPlane {
    /// The readings, repeats averaged; NaN where nothing was measured.
    pub map: PlaneMap,
    /// Steps of the grid along x and y, millimetres.
    pub step_mm: [f64; 2],
    /// Number of samples off the grid, which are not in the map.
    pub off_grid: usize,
}

/// Why the samples of a plane are not a map.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotAGrid {
    /// Fewer than two columns or two rows with two points each.
    #[error(
        "the points lie on {columns} columns and {rows} rows of two points or more; a map needs two of each"
    )]
    TooFewLines {
        /// Columns (x) that hold two points or more.
        columns: usize,
        /// Rows (y) that hold two points or more.
        rows: usize,
    },
    /// The lines are not at multiples of one step.
    #[error(
        "the line at {axis} = {at_mm:.3} mm does not lie on the regular step of {step_mm:.3} mm"
    )]
    Irregular {
        /// `x` or `y`.
        axis: char,
        /// Position of the line, millimetres.
        at_mm: f64,
        /// The step of the others, millimetres.
        step_mm: f64,
    },
    /// Too many samples are off the grid of the others.
    #[error("{off_grid} of {samples} samples are off the grid of the others")]
    Scattered {
        /// Samples off the grid.
        off_grid: usize,
        /// Samples in all.
        samples: usize,
    },
    /// Most points of the grid were not measured.
    #[error("only {measured} of the grid's {columns} x {rows} points were measured")]
    Sparse {
        /// Points measured.
        measured: usize,
        /// Columns of the grid.
        columns: usize,
        /// Rows of the grid.
        rows: usize,
    },
}

/// The samples of a plane as a map on the regular grid on which they were taken.
///
/// Columns and rows are positions with two points or more. Positions are distinct if they are more than `tolerance_mm` apart.
///
/// # Errors
/// [`NotAGrid`] with the reason, if the samples are not on a grid.
pub fn plane_map(plane: &Plane<'_>, tolerance_mm: f64) -> Result<MappedPlane, NotAGrid> {
    let along = |axis: usize| -> Vec<f64> {
        plane.samples.iter().map(|sample| sample.position_mm[axis]).collect()
    };
    let x = Clusters::of(&along(0), tolerance_mm);
    let y = Clusters::of(&along(1), tolerance_mm);
    let columns = x.holding_two_points_or_more(&y);
    let rows = y.holding_two_points_or_more(&x);
    if columns.len() < 2 || rows.len() < 2 {
        return Err(NotAGrid::TooFewLines { columns: columns.len(), rows: rows.len() });
    }
    let columns = RegularLines::through(&x, &columns, 'x', tolerance_mm)?;
    let rows = RegularLines::through(&y, &rows, 'y', tolerance_mm)?;
    fill(&plane.samples, (&x, &columns), (&y, &rows))
}

fn fill(
    samples: &[&RecordedSample],
    (x, columns): (&Clusters, &RegularLines),
    (y, rows): (&Clusters, &RegularLines),
) -> Result<MappedPlane, NotAGrid> {
    let sparse = |measured| NotAGrid::Sparse { measured, columns: columns.count, rows: rows.count };
    // Checked before the map is allocated: a grid of a few points far apart could have any number of lines.
    let points = columns.count.saturating_mul(rows.count);
    if (samples.len() as f64) < MIN_MEASURED * points as f64 {
        return Err(sparse(samples.len()));
    }
    let mut sums = vec![(0.0, 0_u32); points];
    let mut off_grid = 0;
    for (index, sample) in samples.iter().enumerate() {
        match (columns.line_of[x.of[index]], rows.line_of[y.of[index]]) {
            (Some(column), Some(row)) => {
                let (sum, count) = &mut sums[row * columns.count + column];
                *sum += sample.reading;
                *count += 1;
            }
            _ => off_grid += 1,
        }
    }
    if off_grid as f64 > MAX_OFF_GRID * samples.len() as f64 {
        return Err(NotAGrid::Scattered { off_grid, samples: samples.len() });
    }
    let measured = sums.iter().filter(|(_, count)| *count > 0).count();
    if (measured as f64) < MIN_MEASURED * points as f64 {
        return Err(sparse(measured));
    }
    let means = sums
        .into_iter()
        .map(|(sum, count)| if count == 0 { f64::NAN } else { sum / f64::from(count) })
        .collect();
    let map = PlaneMap::new(columns.positions_m(), rows.positions_m(), means)
        .expect("lines rise by a step above zero, and there is a value for each point");
    Ok(MappedPlane { map, step_mm: [columns.step_mm, rows.step_mm], off_grid })
}

/// Positions along an axis that are equal within the tolerance.
struct Clusters {
    /// Mean position of each cluster, millimetres, ascending.
    centres_mm: Vec<f64>,
    /// The cluster of each sample.
    of: Vec<usize>,
}

impl Clusters {
    fn of(along_mm: &[f64], tolerance_mm: f64) -> Self {
        let mut order: Vec<usize> = (0..along_mm.len()).collect();
        order.sort_by(|&a, &b| along_mm[a].total_cmp(&along_mm[b]));
        let mut of = vec![0; along_mm.len()];
        let mut centres_mm = Vec::new();
        for same in order.chunk_by(|&a, &b| along_mm[b] - along_mm[a] <= tolerance_mm) {
            same.iter().for_each(|&sample| of[sample] = centres_mm.len());
            let sum_mm: f64 = same.iter().map(|&sample| along_mm[sample]).sum();
            centres_mm.push(sum_mm / same.len() as f64);
        }
        Self { centres_mm, of }
    }

    /// The clusters whose samples are in two or more clusters of the other axis.
    fn holding_two_points_or_more(&self, across: &Self) -> Vec<usize> {
        let mut first = vec![None; self.centres_mm.len()];
        let mut holds = vec![false; self.centres_mm.len()];
        for (&here, &there) in self.of.iter().zip(&across.of) {
            match first[here] {
                None => first[here] = Some(there),
                Some(known) => holds[here] |= known != there,
            }
        }
        (0..holds.len()).filter(|&cluster| holds[cluster]).collect()
    }
}

/// Lines at multiples of one step.
struct RegularLines {
    first_mm: f64,
    step_mm: f64,
    count: usize,
    /// The line of each cluster.
    line_of: Vec<Option<usize>>,
}

impl RegularLines {
    fn through(
        clusters: &Clusters,
        lines: &[usize],
        axis: char,
        tolerance_mm: f64,
    ) -> Result<Self, NotAGrid> {
        let at_mm = |line: usize| clusters.centres_mm[lines[line]];
        let gaps_mm = (1..lines.len()).map(|line| at_mm(line) - at_mm(line - 1));
        let narrowest_mm = gaps_mm.clone().fold(f64::INFINITY, f64::min);
        // Counted gap by gap, so that an error in the narrowest gap does not accumulate over the whole width.
        let mut numbers = vec![0.0];
        for gap_mm in gaps_mm {
            numbers.push(numbers[numbers.len() - 1] + (gap_mm / narrowest_mm).round());
        }
        let (first_mm, last) = (at_mm(0), lines.len() - 1);
        let step_mm = (at_mm(last) - first_mm) / numbers[last];
        let mut line_of = vec![None; clusters.centres_mm.len()];
        for (line, &number) in numbers.iter().enumerate() {
            if (at_mm(line) - (first_mm + number * step_mm)).abs() > tolerance_mm {
                return Err(NotAGrid::Irregular { axis, at_mm: at_mm(line), step_mm });
            }
            line_of[lines[line]] = Some(number as usize);
        }
        Ok(Self { first_mm, step_mm, count: numbers[last] as usize + 1, line_of })
    }

    fn positions_m(&self) -> Vec<f64> {
        (0..self.count).map(|line| (self.first_mm + line as f64 * self.step_mm) / 1e3).collect()
    }
}

#[cfg(test)]
mod tests;
