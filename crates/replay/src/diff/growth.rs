//! How fast two runs part: in a chaotic cloud the distance of their states grows exponentially.

/// Distances above this many mean diameters have left the linear regime [-].
const SATURATED: f64 = 1e-2;
/// Points that a fit needs.
const LEAST_POINTS: usize = 8;
/// Factor over which distances must grow to tell a rate.
const LEAST_GROWTH: f64 = 30.0;
/// Points kept; beyond it every other one is dropped.
const MOST_POINTS: usize = 4096;

/// Gathers the distance of two runs over time.
#[derive(Clone, Debug, Default)]
pub struct Growth {
    points: Vec<(f64, f64)>,
    stride: usize,
    seen: usize,
    over: bool,
}

/// A fitted rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// Slope of ln distance over time [1/s].
    pub rate: f64,
    /// Its standard error [1/s].
    pub error: f64,
    /// The span it was fitted over [s].
    pub span: (f64, f64),
}

impl Growth {
    /// Takes the root mean square distance of the two states at time t [s], in mean diameters [-].
    pub fn add(&mut self, t: f64, distance: f64) {
        if self.over || distance <= 0.0 || distance.is_nan() {
            return;
        }
        if distance > SATURATED || !distance.is_finite() {
            self.over = true;
            return;
        }
        self.seen += 1;
        if !self.seen.is_multiple_of(self.stride.max(1)) {
            return;
        }
        self.points.push((t, distance.ln()));
        if self.points.len() > MOST_POINTS {
            self.points = self.points.iter().copied().step_by(2).collect();
            self.stride = self.stride.max(1) * 2;
        }
    }

    /// The rate by least squares; `None` where distances do not grow over a range that tells one.
    #[must_use]
    pub fn rate(&self) -> Option<Rate> {
        let n = self.points.len() as f64;
        let (first, last) = (self.points.first()?, self.points.last()?);
        if self.points.len() < LEAST_POINTS || last.1 - first.1 < LEAST_GROWTH.ln() || last.0 <= first.0 {
            return None;
        }
        let mean = |of: fn(&(f64, f64)) -> f64| self.points.iter().map(of).sum::<f64>() / n;
        let (t, y) = (mean(|p| p.0), mean(|p| p.1));
        let sum = |of: &dyn Fn(&(f64, f64)) -> f64| self.points.iter().map(of).sum::<f64>();
        let spread = sum(&|p| (p.0 - t) * (p.0 - t));
        let rate = sum(&|p| (p.0 - t) * (p.1 - y)) / spread;
        let rest = sum(&|p| (p.1 - y - rate * (p.0 - t)).powi(2));
        let error = (rest / ((n - 2.0) * spread)).sqrt();
        Some(Rate { rate, error, span: (first.0, last.0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponential_has_its_rate() {
        let mut growth = Growth::default();
        for k in 0..20_000 {
            let t = f64::from(k) * 1e-3;
            growth.add(t, 1e-14 * (2.5 * t).exp());
        }
        let rate = growth.rate().unwrap();
        // A straight line through points that lie on one: only rounding is left.
        assert!((rate.rate - 2.5).abs() < 1e-9 && rate.error < 1e-9, "{rate:?}");
        assert!(rate.span.1 < 11.1, "what is saturated does not count: {rate:?}");
    }

    #[test]
    fn what_does_not_grow_has_none() {
        let mut growth = Growth::default();
        (0..100).for_each(|k| growth.add(f64::from(k), 1e-12));
        assert_eq!(growth.rate(), None);
    }
}
