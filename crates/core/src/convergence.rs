//! The errors of the iteration within a step, and when to stop: (52), (53), (55) steps 4 to 6.

use crate::scene::ModelKind;
use crate::state::Columns;

/// How much slower than it just did an iteration may be taken to converge from here on [-].
const RATE: f64 = 4.0;

/// What an iteration's errors say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Z_K <= 1.
    Converged,
    /// Go on.
    Continue,
    /// K = K_d and Z_K > 1.
    Exhausted,
    /// A value is not finite.
    NotFinite,
}

/// Errors of the iterations K = 1, 2, .. of one attempt at a step.
#[derive(Clone, Debug)]
pub struct Convergence {
    measure: ModelKind,
    /// Tolerances of positions and temperatures [-].
    tolerance: (f64, f64),
    max_iterations: usize,
    mean_diameter: f64,
    /// Position errors so far [-].
    pub position: Vec<f64>,
    /// Temperature errors so far [-]; empty without temperatures.
    pub temperature: Vec<f64>,
    /// Z_K of the last iteration, equation (53) [-].
    pub violation: f64,
    /// Particle that moved most in the last iteration.
    pub worst: u32,
}

impl Convergence {
    /// For a model, with tolerances of positions and temperatures [-], at most K_d iterations, lengths against a mean
    /// diameter [m] (in `consistent`).
    #[must_use]
    pub fn new(measure: ModelKind, tolerance: (f64, f64), max_iterations: u32, mean_diameter: f64) -> Self {
        Self {
            measure,
            tolerance,
            max_iterations: max_iterations as usize,
            mean_diameter,
            position: Vec::new(),
            temperature: Vec::new(),
            violation: 0.0,
            worst: 0,
        }
    }

    /// Forgets the last attempt.
    pub fn restart(&mut self) {
        self.position.clear();
        self.temperature.clear();
        self.violation = 0.0;
    }

    /// Number of iterations so far.
    #[must_use]
    pub fn iterations(&self) -> usize {
        self.position.len()
    }

    /// Notes iteration K: positions moved from `previous` to `current`, temperatures likewise where there are any.
    pub fn note(
        &mut self,
        (previous, current): (&Columns, &Columns),
        temperatures: Option<(&[f64], &[f64])>,
    ) -> Verdict {
        let position = match self.measure {
            ModelKind::Paper => self.relative_sum(previous, current),
            ModelKind::Consistent => self.largest_move(previous, current),
        };
        self.position.push(position);
        let mut violation = position / self.tolerance.0;
        let mut finite = position.is_finite();
        if let Some((previous, current)) = temperatures {
            let error = match self.measure {
                ModelKind::Paper => {
                    let change: f64 = previous.iter().zip(current).map(|(p, c)| (c - p).abs()).sum();
                    ratio(change, current.iter().map(|c| c.abs()).sum())
                }
                ModelKind::Consistent => {
                    previous.iter().zip(current).map(|(p, c)| (c - p).abs() / c.max(1.0)).fold(0.0, f64::max)
                }
            };
            finite &= error.is_finite();
            self.temperature.push(error);
            violation = violation.max(error / self.tolerance.1);
        }
        self.violation = violation;
        self.verdict(finite)
    }

    fn verdict(&self, finite: bool) -> Verdict {
        if !finite {
            Verdict::NotFinite
        } else if self.violation <= 1.0 {
            Verdict::Converged
        } else if self.iterations() >= self.max_iterations {
            Verdict::Exhausted
        } else {
            Verdict::Continue
        }
    }

    /// Notes iteration K of a scheme that measures its own change of position, in mean diameters; below `round_off` it
    /// stands still. Temperatures, where there are any, are not iterated.
    pub fn note_change(&mut self, change: f64, round_off: f64, worst: u32, temperatures: bool) -> Verdict {
        self.position.push(change);
        if temperatures {
            self.temperature.push(0.0);
        }
        self.worst = worst;
        // The change that is left for the next iteration, not the one just made: saves one sweep in four.
        let left = match self.position.as_slice() {
            [.., before, last] => (RATE * last / before).min(1.0) * last,
            _ => change,
        };
        self.violation = left / self.tolerance.0.max(round_off);
        self.verdict(change.is_finite())
    }

    /// (52): sum |r^K - r^(K-1)| / sum |r^K|.
    fn relative_sum(&mut self, previous: &Columns, current: &Columns) -> f64 {
        let (mut change, mut size, mut most) = (0.0, 0.0, -1.0);
        for i in 0..current.len() {
            let moved = (current.get(i) - previous.get(i)).norm();
            change += moved;
            size += current.get(i).norm();
            if moved > most {
                most = moved;
                self.worst = i as u32;
            }
        }
        ratio(change, size)
    }

    /// max |r^K - r^(K-1)| / mean diameter: free of the origin, and no bad particle hides among many good ones.
    fn largest_move(&mut self, previous: &Columns, current: &Columns) -> f64 {
        let mut most = 0.0;
        for i in 0..current.len() {
            let moved = (current.get(i) - previous.get(i)).norm_squared();
            // A NaN is kept.
            if moved > most || moved.is_nan() {
                most = moved;
                self.worst = i as u32;
                if moved.is_nan() {
                    break;
                }
            }
        }
        most.sqrt() / self.mean_diameter
    }
}

/// change / size, and zero where nothing changed (a single particle may sit at the origin).
fn ratio(change: f64, size: f64) -> f64 {
    if change == 0.0 { 0.0 } else { change / size }
}
