//! Where a collocation scheme has to restart: the first impact, or crossing of the cut-off or of the activation distance.
//!
//! A scheme of high order keeps its order only where motion is smooth, so its steps end where a force or a velocity jumps. The
//! event is looked for along the dense output, the step is solved again with the length found, and so on until both agree:
//! then no point of the step lies behind the event, and the polynomial is that of a smooth motion.

use super::paths::{Launch, at_rest, image};
use super::roots::first_closing;
use crate::collocation::Path;
use crate::contact::search::{TOUCHING, visit_close};
use crate::force::Field;
use crate::simd::vectorized;
use nalgebra::Vector3;

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

/// The first impact on the paths of an attempt, as a share of its length in [0, [`BEYOND`]]. Contacts that are closed when the
/// step begins have been solved.
#[must_use]
pub fn first_impact(launch: &Launch<'_>, paths: &[Path]) -> Option<f64> {
    let radius = &launch.particles.radius;
    let grown: Vec<f64> =
        radius.iter().zip(paths).map(|(b, path)| b * (1.0 + 2.0 * TOUCHING) + path.reach(BEYOND)).collect();
    let mut first: Option<f64> = None;
    let mut note = |found: Option<f64>| first = [first, found].into_iter().flatten().reduce(f64::min);
    visit_close(launch.position, &grown, &launch.domain.periodic, 1.0, |pair| {
        let (i, j) = (pair.i as usize, pair.j as usize);
        note(match paths[i].coefficients().len() {
            6 => meeting::<6, 11>(launch, (i, j), (&paths[i], &paths[j])),
            _ => meeting::<10, 19>(launch, (i, j), (&paths[i], &paths[j])),
        });
    });
    for wall in &launch.domain.walls {
        for (i, path) in paths.iter().enumerate() {
            if wall.distance(&launch.position.get(i)) <= grown[i] {
                let open = wall.distance(&launch.position.get(i)) - radius[i];
                let height = |c: &Vector3<f64>| c.dot(&wall.normal);
                note(match path.coefficients().len() {
                    6 => landing::<6>(open, radius[i], path, height),
                    _ => landing::<10>(open, radius[i], path, height),
                });
            }
        }
    }
    first
}

/// When the gap of two closes.
fn meeting<const PATH: usize, const SQUARE: usize>(
    launch: &Launch<'_>,
    (i, j): (usize, usize),
    paths: (&Path, &Path),
) -> Option<f64> {
    let (a, b) = (launch.particles.radius[i], launch.particles.radius[j]);
    let mut square = square_of_distance::<PATH, SQUARE>(launch, (i, j), paths);
    square[0] -= (a + b) * (a + b);
    if square[0] <= 4.0 * TOUCHING * a.min(b) * (a + b) {
        at_rest(&mut square);
    }
    first_closing(&square, BEYOND)
}

/// When the gap, `open` at the start, to a wall closes.
fn landing<const PATH: usize>(
    open: f64,
    radius: f64,
    path: &Path,
    height: impl Fn(&Vector3<f64>) -> f64,
) -> Option<f64> {
    let mut gap = [0.0; PATH];
    for (gap, c) in gap.iter_mut().zip(path.coefficients()) {
        *gap = height(c);
    }
    gap[0] = open;
    if open <= 2.0 * TOUCHING * radius {
        at_rest(&mut gap);
    }
    first_closing(&gap, BEYOND)
}

fn crossing(launch: &Launch<'_>, (i, j): (usize, usize), (a, b): (&Path, &Path), shell: f64) -> Option<f64> {
    match a.coefficients().len() {
        6 => on_polynomial::<6, 11>(launch, (i, j), (a, b), shell),
        _ => on_polynomial::<10, 19>(launch, (i, j), (a, b), shell),
    }
}

fn on_polynomial<const PATH: usize, const SQUARE: usize>(
    launch: &Launch<'_>,
    (i, j): (usize, usize),
    (a, b): (&Path, &Path),
    shell: f64,
) -> Option<f64> {
    let mut square = square_of_distance::<PATH, SQUARE>(launch, (i, j), (a, b));
    let sign = if square[0] <= shell * shell { -1.0 } else { 1.0 };
    square[0] -= shell * shell;
    let signed = square.map(|c| sign * c);
    let at = first_closing(&signed, BEYOND)?;
    let slope = signed.iter().enumerate().skip(1).rev().fold(0.0, |sum, (k, c)| sum * at + k as f64 * c).abs();
    Some(at + (BEHIND * shell * shell / slope).min(GRAZING))
}

/// The square of a distance [m^2], a polynomial of SQUARE coefficients from paths of PATH coefficients.
fn square_of_distance<const PATH: usize, const SQUARE: usize>(
    launch: &Launch<'_>,
    (i, j): (usize, usize),
    (a, b): (&Path, &Path),
) -> [f64; SQUARE] {
    let mut apart = [Vector3::zeros(); PATH];
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
    square
}
