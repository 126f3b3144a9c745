//! Since when a figure is changed.

/// Place of the first score after the change: the most likely one, if the scores before it have mean zero and those from it on another mean
/// of the sign of `direction` (Samuel, Pignatiello and Calvin, Quality Engineering 10, 521, 1998). `None` without scores of that sign.
pub fn change_point(scores: &[f64], direction: f64) -> Option<usize> {
    let mut sum = 0.0;
    let mut best: Option<(usize, f64)> = None;
    for (count, (place, score)) in (1u32..).zip(scores.iter().enumerate().rev()) {
        sum += score * direction.signum();
        // Twice the logarithm of the likelihood ratio.
        let evidence = sum.max(0.0).powi(2) / f64::from(count);
        if evidence > best.map_or(0.0, |(_, evidence)| evidence) {
            best = Some((place, evidence));
        }
    }
    best.map(|(place, _)| place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_found_at_its_place() {
        let scores = [0.3, -0.8, 1.1, -0.2, 0.4, 3.2, 2.7, 3.9];
        assert_eq!(change_point(&scores, 1.0), Some(5));
        assert_eq!(change_point(&scores.map(|score| -score), -1.0), Some(5));
        assert_eq!(change_point(&[0.1, 0.2], -1.0), None);
        assert_eq!(change_point(&[], 1.0), None);
    }
}
