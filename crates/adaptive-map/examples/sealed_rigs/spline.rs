//! A plane grid interpolated by natural cubic splines, along x and then along y.

/// Values of the natural cubic spline through `values`, equally spaced from 0 to 1, at some places there.
fn spline(values: &[f64], at: &[f64]) -> Vec<f64> {
    let n = values.len();
    if n < 3 {
        return at.iter().map(|t| values[0] + t * (values[n - 1] - values[0])).collect();
    }
    // Second differences by the Thomas algorithm; zero at both ends.
    let (mut c, mut d) = (vec![0.0; n], vec![0.0; n]);
    for i in 1..n - 1 {
        let right = 6.0 * (values[i + 1] - 2.0 * values[i] + values[i - 1]);
        let pivot = 4.0 - c[i - 1];
        c[i] = 1.0 / pivot;
        d[i] = (right - d[i - 1]) / pivot;
    }
    let mut bend = vec![0.0; n];
    for i in (1..n - 1).rev() {
        bend[i] = d[i] - c[i] * bend[i + 1];
    }
    at.iter()
        .map(|t| {
            let place = t * (n - 1) as f64;
            let i = (place as usize).min(n - 2);
            let (u, v) = (place - i as f64, 1.0 - (place - i as f64));
            v * values[i]
                + u * values[i + 1]
                + (bend[i] * (v.powi(3) - v) + bend[i + 1] * (u.powi(3) - u)) / 6.0
        })
        .collect()
}

/// A grid of `columns` by `rows`, row by row, at `wide` by `high` places that span the same.
pub fn interpolated(values: &[f64], columns: usize, wide: usize, high: usize) -> Vec<f64> {
    let fractions = |n: usize| -> Vec<f64> { (0..n).map(|i| i as f64 / (n - 1) as f64).collect() };
    let rows: Vec<Vec<f64>> =
        values.chunks(columns).map(|row| spline(row, &fractions(wide))).collect();
    let along: Vec<Vec<f64>> = (0..wide)
        .map(|x| {
            let column: Vec<f64> = rows.iter().map(|row| row[x]).collect();
            spline(&column, &fractions(high))
        })
        .collect();
    (0..high).flat_map(|y| along.iter().map(move |column| column[y])).collect()
}
