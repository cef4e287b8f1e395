//! A curve of bounded size: however many points go in, what comes out is drawn in the same picture.

/// Most spans that a curve is kept in.
const SPANS: usize = 1024;

/// Consecutive points of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// The first point (t, value).
    pub first: (f64, f64),
    /// The point of the least value.
    pub low: (f64, f64),
    /// The point of the greatest value.
    pub high: (f64, f64),
    /// The last point.
    pub last: (f64, f64),
}

/// A curve as spans of equally many points, each with its extremes at their own times: no peak is lost.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    spans: Vec<Span>,
    /// Points in a full span.
    width: u64,
    /// Points in the last span.
    filled: u64,
    /// Points that were no numbers, which are left out.
    pub skipped: u64,
    /// Points taken.
    pub points: u64,
}

impl Default for Series {
    fn default() -> Self {
        Self { spans: Vec::new(), width: 1, filled: 1, skipped: 0, points: 0 }
    }
}

impl Series {
    /// Takes the next point.
    pub fn push(&mut self, t: f64, value: f64) {
        if !t.is_finite() || !value.is_finite() {
            self.skipped += 1;
            return;
        }
        self.points += 1;
        let point = (t, value);
        let span = Span { first: point, low: point, high: point, last: point };
        match self.spans.last_mut() {
            Some(last) if self.filled < self.width => {
                *last = join(last, &span);
                self.filled += 1;
            }
            _ => {
                if self.spans.len() == SPANS {
                    self.spans = self.spans.chunks(2).map(|pair| join(&pair[0], &pair[pair.len() - 1])).collect();
                    self.width *= 2;
                }
                self.spans.push(span);
                self.filled = 1;
            }
        }
    }

    /// The spans.
    #[must_use]
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// Points in a span; 1: the curve is whole.
    #[must_use]
    pub fn width(&self) -> u64 {
        self.width
    }

    /// The points to draw, in order of time within each span.
    pub fn line(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.spans.iter().flat_map(|span| {
            let (a, b) = if span.low.0 <= span.high.0 { (span.low, span.high) } else { (span.high, span.low) };
            [span.first, a, b, span.last]
        })
    }
}

fn join(a: &Span, b: &Span) -> Span {
    Span {
        first: a.first,
        low: if b.low.1 < a.low.1 { b.low } else { a.low },
        high: if b.high.1 > a.high.1 { b.high } else { a.high },
        last: b.last,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_curve_keeps_its_peaks() {
        let mut series = Series::default();
        let value = |k: u32| {
            if k == 54_321 {
                9.0
            } else if k == 12_345 {
                -7.0
            } else {
                f64::from(k % 10) / 10.0
            }
        };
        for k in 0..100_000 {
            series.push(f64::from(k), value(k));
        }
        series.push(1e6, f64::NAN);
        assert!(series.spans().len() <= SPANS && series.spans().len() > SPANS / 2 - 2);
        assert_eq!((series.points, series.skipped), (100_000, 1));
        let line: Vec<_> = series.line().collect();
        assert!(line.contains(&(54_321.0, 9.0)) && line.contains(&(12_345.0, -7.0)));
        assert_eq!((line[0], line[line.len() - 1]), ((0.0, 0.0), (99_999.0, 0.9)));
        assert!(line.is_sorted_by_key(|point| point.0));
        assert_eq!(series.spans().iter().filter(|span| span.high.1 > 1.0).count(), 1);
    }

    #[test]
    fn a_short_curve_is_whole() {
        let mut series = Series::default();
        for k in 0..SPANS {
            series.push(k as f64, -(k as f64));
        }
        assert_eq!((series.width(), series.spans().len()), (1, SPANS));
    }
}
