//! Statistics over seeds, and curves on a common time grid.

/// Mean and standard error of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean.
    pub mean: f64,
    /// Standard error of the mean, the sample's standard deviation over the root of its size; NaN for fewer than two
    /// values.
    pub error: f64,
}

impl Estimate {
    /// Of a sample; NaN where it is empty.
    #[must_use]
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Self { mean, error: (squares / (n - 1.0) / n).sqrt() }
    }

    /// Difference of the means over the standard error of that difference, for independent samples [-].
    #[must_use]
    pub fn distance(&self, other: &Self) -> f64 {
        (self.mean - other.mean).abs() / self.error.hypot(other.error)
    }
}

/// Median: the middle value, or the mean of the two in the middle; NaN where there is none.
#[must_use]
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[middle],
        _ => 0.5 * (sorted[middle - 1] + sorted[middle]),
    }
}

/// Smallest and largest value; (infinity, -infinity) where there is none.
#[must_use]
pub fn range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| (low.min(value), high.max(value)))
}

/// Sample standard deviation; NaN for fewer than two values.
#[must_use]
pub fn deviation(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
}

/// Root of the mean square; NaN where there is no value.
#[must_use]
pub fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Values of a curve, given at rising times, at the times of `grid`: linear between neighbours, constant outside. NaN
/// where the curve is empty.
#[must_use]
pub fn resample(times: &[f64], values: &[f64], grid: &[f64]) -> Vec<f64> {
    let at = |t: f64| {
        let after = times.partition_point(|&time| time < t);
        let (Some(&last), Some(before)) = (values.last(), after.checked_sub(1)) else {
            return values.first().copied().unwrap_or(f64::NAN);
        };
        if after == times.len() {
            return last;
        }
        let share = (t - times[before]) / (times[after] - times[before]);
        values[before] + share * (values[after] - values[before])
    };
    grid.iter().map(|&t| at(t)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_is_the_middle_or_between_the_two_middle_values() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), 2.5);
        assert_eq!(median(&[7.0]), 7.0);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn standard_error_by_hand() {
        // Mean 5, squares 9 + 1 + 1 + 9 = 20, variance 20/3, over n = 4. One operation each way: round-off only.
        let estimate = Estimate::of(&[2.0, 4.0, 6.0, 8.0]);
        assert_eq!(estimate.mean, 5.0);
        assert!((estimate.error - (20.0_f64 / 3.0 / 4.0).sqrt()).abs() < 1e-15, "{estimate:?}");
        assert!(Estimate::of(&[1.0]).error.is_nan());
        assert!((deviation(&[2.0, 4.0, 6.0, 8.0]) - (20.0_f64 / 3.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn distance_counts_standard_errors() {
        let (a, b) = (Estimate { mean: 1.0, error: 0.3 }, Estimate { mean: 3.0, error: 0.4 });
        // 3-4-5: the error of the difference is 0.5.
        assert!((a.distance(&b) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn range_and_root_mean_square() {
        assert_eq!(range(&[2.0, -1.0, 5.0]), (-1.0, 5.0));
        assert!((root_mean_square(&[3.0, 4.0]) - 12.5_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn resampling_is_linear_between_and_constant_outside() {
        let (times, values) = ([0.0, 1.0, 3.0], [10.0, 20.0, 0.0]);
        assert_eq!(
            resample(&times, &values, &[-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 9.0]),
            [10.0, 10.0, 15.0, 20.0, 10.0, 0.0, 0.0]
        );
        assert!(resample(&[], &[], &[0.0])[0].is_nan());
    }
}
