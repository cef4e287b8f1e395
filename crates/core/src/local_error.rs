//! The local error of a step of first or second order and its kicks, over all particles, on the widest vectors.

use crate::simd::Task;
use crate::state::Columns;
use crate::step_control::{Leaders, Worst};
use std::ops::Range;

/// Particles looked at together.
const CHUNK: usize = 64;

/// What a step began and ended with; columns have length n.
pub(crate) struct LocalErrors<'a> {
    /// Accelerations at the step's start [m/s^2].
    pub(crate) before: &'a Columns,
    /// Forces at its end [N].
    pub(crate) force: &'a Columns,
    /// What crossings added to accelerations, which is no error [m/s^2].
    pub(crate) jump: Option<&'a Columns>,
    /// Masses [kg].
    pub(crate) mass: &'a [f64],
    /// Velocities at the step's start [m/s].
    pub(crate) velocity: &'a Columns,
    /// The step [s].
    pub(crate) dt: f64,
    /// dt^2 over the length that an error may have.
    pub(crate) scale: f64,
    /// The integrator's weights of new and old accelerations, less those of the third order.
    pub(crate) weights: (f64, f64),
    /// Share of an acceleration by which it may change before it counts as unresolved [-].
    pub(crate) unresolved: f64,
}

impl Task for LocalErrors<'_> {
    /// The worst error, and the worst kick of an unresolved acceleration over the fastest speed.
    type Output = (Worst, Worst);

    #[inline(always)]
    fn run(self) -> (Worst, Worst) {
        let n = self.before.len();
        let fastest = fastest(self.velocity);
        let (mut errors, mut kicks) = (Leaders::default(), Leaders::default());
        let mut first = 0;
        while first < n {
            let count = CHUNK.min(n - first);
            let (error, kick) = self.chunk(first, count, fastest);
            for k in 0..count {
                errors.see(first + k, error[k]);
                kicks.see(first + k, kick[k]);
            }
            first += count;
        }
        (errors.worst(), kicks.worst())
    }
}

impl LocalErrors<'_> {
    #[inline(always)]
    fn chunk(&self, first: usize, count: usize, fastest: f64) -> ([f64; CHUNK], [f64; CHUNK]) {
        let (mut error, mut kick) = ([0.0; CHUNK], [0.0; CHUNK]);
        let Self { dt, scale, weights: (new, old), unresolved, .. } = *self;
        let cut = first..first + count;
        let mut mass = [1.0; CHUNK];
        mass[..count].copy_from_slice(&self.mass[cut.clone()]);
        let (a, v) = (part(self.before, &cut), part(self.velocity, &cut));
        let mut b = part(self.force, &cut);
        for axis in 0..3 {
            for k in 0..CHUNK {
                b[axis][k] /= mass[k];
            }
        }
        if let Some(jump) = self.jump {
            let jump = part(jump, &cut);
            for axis in 0..3 {
                for k in 0..CHUNK {
                    b[axis][k] -= jump[axis][k];
                }
            }
        }
        for k in 0..CHUNK {
            let (a, b, v) = ([a[0][k], a[1][k], a[2][k]], [b[0][k], b[1][k], b[2][k]], [v[0][k], v[1][k], v[2][k]]);
            error[k] = scale * norm([b[0] * new + a[0] * old, b[1] * new + a[1] * old, b[2] * new + a[2] * old]);
            let change = norm([b[0] - a[0], b[1] - a[1], b[2] - a[2]]);
            let size = norm(a).max(norm(b));
            let half = 0.5 * dt;
            let own = norm([v[0] + (a[0] + b[0]) * half, v[1] + (a[1] + b[1]) * half, v[2] + (a[2] + b[2]) * half]);
            let relative = dt * change / fastest.max(own).max(half * size);
            kick[k] = if change > unresolved * size { relative } else { 0.0 };
        }
        (error, kick)
    }
}

/// Some vectors of columns; zeros behind the last.
#[inline(always)]
fn part(columns: &Columns, cut: &Range<usize>) -> [[f64; CHUNK]; 3] {
    let mut part = [[0.0; CHUNK]; 3];
    for axis in 0..3 {
        part[axis][..cut.len()].copy_from_slice(&columns.axes()[axis][cut.clone()]);
    }
    part
}

#[inline(always)]
fn norm(f: [f64; 3]) -> f64 {
    (f[0] * f[0] + f[1] * f[1] + f[2] * f[2]).sqrt()
}

/// The largest speed [m/s].
#[inline(always)]
fn fastest(velocity: &Columns) -> f64 {
    let [x, y, z] = velocity.axes();
    let mut most = [0.0_f64; 8];
    let n = x.len().min(y.len()).min(z.len());
    let mut first = 0;
    while first + 8 <= n {
        for k in 0..8 {
            let (x, y, z) = (x[first + k], y[first + k], z[first + k]);
            most[k] = most[k].max(x * x + y * y + z * z);
        }
        first += 8;
    }
    let rest = (first..n).map(|i| x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).fold(0.0, f64::max);
    most.into_iter().fold(rest, f64::max).sqrt()
}
