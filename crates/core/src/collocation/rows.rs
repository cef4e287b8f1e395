//! Rows of equally long vectors, one per collocation point, and their weighted sums.

use crate::simd::{Task, vectorized};
use crate::state::Columns;
use crate::tasks;

/// Numbers that are summed side by side; rows are padded to a multiple of it.
const LANES: usize = 8;
/// Numbers per task, and the length of rows from which tasks are worth their overhead.
const SHARE: usize = 1 << 13;

/// Rows of 3 n numbers: x of all particles, then y, then z.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    n: usize,
    stride: usize,
    values: Vec<f64>,
}

impl Rows {
    pub(super) fn zeros(rows: usize, n: usize) -> Self {
        let stride = (3 * n).next_multiple_of(LANES);
        Self { n, stride, values: vec![0.0; rows * stride] }
    }

    pub(super) fn len(&self) -> usize {
        self.values.len().checked_div(self.stride).unwrap_or(0)
    }

    /// Row k, with its padding.
    pub(super) fn row(&self, k: usize) -> &[f64] {
        &self.values[k * self.stride..(k + 1) * self.stride]
    }

    pub(super) fn row_mut(&mut self, k: usize) -> &mut [f64] {
        &mut self.values[k * self.stride..(k + 1) * self.stride]
    }

    /// Rows from..to, one behind the other, with their padding.
    pub(super) fn rows(&self, from: usize, to: usize) -> &[f64] {
        &self.values[from * self.stride..to * self.stride]
    }

    pub(super) fn rows_mut(&mut self, from: usize, to: usize) -> &mut [f64] {
        &mut self.values[from * self.stride..to * self.stride]
    }

    /// Row k as three columns of length n.
    pub(super) fn axes(&self, k: usize) -> [&[f64]; 3] {
        let row = self.row(k);
        std::array::from_fn(|axis| &row[axis * self.n..(axis + 1) * self.n])
    }

    pub(super) fn axes_mut(&mut self, k: usize) -> [&mut [f64]; 3] {
        let n = self.n;
        let (x, rest) = self.row_mut(k).split_at_mut(n);
        let (y, rest) = rest.split_at_mut(n);
        [x, y, &mut rest[..n]]
    }

    pub(super) fn set(&mut self, k: usize, columns: &Columns) {
        for (own, other) in self.axes_mut(k).into_iter().zip(columns.axes()) {
            own.copy_from_slice(other);
        }
    }

    pub(super) fn columns(&self, k: usize) -> Columns {
        let [x, y, z] = self.axes(k).map(<[f64]>::to_vec);
        Columns { x, y, z }
    }

    /// out = sum over k of weights[k] times row first + k.
    pub(super) fn combine(&self, first: usize, weights: &[f64], out: &mut [f64]) {
        let combine = |from: usize, out: &mut [f64]| {
            vectorized(Combine {
                values: &self.values[first * self.stride..],
                stride: self.stride,
                from,
                weights,
                out,
            });
        };
        let parallel = out.len() >= 2 * SHARE;
        tasks::each(out, SHARE, parallel, &|task, out| combine(task * SHARE, out));
    }
}

/// Sums of one stretch of the rows.
struct Combine<'a> {
    values: &'a [f64],
    stride: usize,
    from: usize,
    weights: &'a [f64],
    out: &'a mut [f64],
}

impl Task for Combine<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (lanes, _) = self.out.as_chunks_mut::<LANES>();
        for (chunk, out) in lanes.iter_mut().enumerate() {
            let mut sum = [0.0; LANES];
            let mut at = self.from + chunk * LANES;
            for &weight in self.weights {
                if let Some(values) = self.values.get(at..).and_then(<[f64]>::first_chunk::<LANES>) {
                    for l in 0..LANES {
                        sum[l] += weight * values[l];
                    }
                }
                at += self.stride;
            }
            *out = sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Combine, Rows};
    use crate::simd::{Task, vectorized};

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        for n in [1, 7, 33] {
            let mut rows = Rows::zeros(5, n);
            for (k, value) in rows.values.iter_mut().enumerate() {
                *value = 1.0 / (k as f64 + 0.3);
            }
            let weights = [0.1, -0.7, 1e3, 0.3];
            let sums = |wide: bool| {
                let mut out = rows.row(0).to_vec();
                let values = &rows.values[rows.stride..];
                let task = Combine { values, stride: rows.stride, from: 0, weights: &weights, out: &mut out };
                if wide {
                    vectorized(task)
                } else {
                    task.run()
                }
                out.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
            };
            assert_eq!(sums(true), sums(false));
            let plain: f64 = (0..4).map(|k| weights[k] * rows.row(k + 1)[0]).sum();
            assert_eq!(f64::from_bits(sums(true)[0]), plain);
        }
    }
}
