//! Where a collocation scheme has to restart: the first crossing of the cut-off or of the activation distance in a step.
//!
//! A scheme of high order keeps its order only where forces are smooth, so its steps end where one jumps. The crossing is
//! looked for along the dense output, the step is solved again with the length found, and so on until both agree: then no
//! point of the step lies behind the crossing, and the polynomial is that of a smooth force.

use super::paths::{Launch, image};
use super::roots::first_closing;
use crate::collocation::Path;
use crate::force::Field;
use crate::simd::vectorized;

/// How far beyond its end a step's polynomial is looked at [-]: a length that is a little too short is found as well as one
/// that is too long.
pub const BEYOND: f64 = 1.05;
/// Steps end this far behind a crossing, in round-offs of the distance, so that the next one starts on the other side.
const BEHIND: f64 = 8.0 * f64::EPSILON;
/// And no farther than this share of the step, where a pair grazes the distance.
const GRAZING: f64 = 1e-9;

/// The first crossing on the paths of an attempt, as a share of its length in (0, [`BEYOND`]].
#[must_use]
pub fn first_crossing(field: &Field, launch: &Launch<'_>, paths: &[Path]) -> Option<f64> {
    let reach: Vec<f64> = paths.iter().map(|path| path.reach(BEYOND)).collect();
    let mut pairs = Vec::new();
    vectorized(super::crossings::Scan { field, launch, reach: &reach, pairs: &mut pairs });
    let mut first: Option<f64> = None;
    for (i, j) in pairs {
        let (i, j) = (i as usize, j as usize);
        let shells = [field.jumping_cutoff(), field.activation(i, j)];
        for shell in shells.into_iter().flatten() {
            let found = crossing(launch, (i, j), (&paths[i], &paths[j]), shell);
            first = [first, found].into_iter().flatten().reduce(f64::min);
        }
    }
    first
}

fn crossing(launch: &Launch<'_>, (i, j): (usize, usize), (a, b): (&Path, &Path), shell: f64) -> Option<f64> {
    match a.coefficients().len() {
        6 => on_polynomial::<6, 11>(launch, (i, j), (a, b), shell),
        _ => on_polynomial::<10, 19>(launch, (i, j), (a, b), shell),
    }
}

/// The distance's square less the shell's, a polynomial of SQUARE coefficients from paths of PATH coefficients.
fn on_polynomial<const PATH: usize, const SQUARE: usize>(
    launch: &Launch<'_>,
    (i, j): (usize, usize),
    (a, b): (&Path, &Path),
    shell: f64,
) -> Option<f64> {
    let mut apart = [nalgebra::Vector3::zeros(); PATH];
    for ((apart, a), b) in apart.iter_mut().zip(a.coefficients()).zip(b.coefficients()) {
        *apart = b - a;
    }
    apart[0] += image(launch, i, j);
    let mut square = [0.0; SQUARE];
    for (k, first) in apart.iter().enumerate() {
        for (l, second) in apart.iter().enumerate() {
            square[k + l] += first.dot(second);
        }
    }
    let sign = if square[0] <= shell * shell { -1.0 } else { 1.0 };
    square[0] -= shell * shell;
    let signed = square.map(|c| sign * c);
    let at = first_closing(&signed, BEYOND)?;
    let slope = signed.iter().enumerate().skip(1).rev().fold(0.0, |sum, (k, c)| sum * at + k as f64 * c).abs();
    Some(at + (BEHIND * shell * shell / slope).min(GRAZING))
}
