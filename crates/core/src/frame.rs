//! What a run is computed in: positions about an origin near the cloud, and sums in an order that does not depend on how the
//! particles are numbered. Both follow from the scene's start alone, so that a scene far away, with other numbers or in a
//! mirror gives the same bits.

use crate::scene::{ModelKind, Scene};
use crate::state::{Columns, Particles};
use nalgebra::Vector3;

/// The origin is a multiple of a power of two that is at least this many times the cloud's extent.
const FAR: f64 = 16.0;

/// Centre and longest side of the box that holds all centres [m].
fn bounds(r: &Columns) -> (Vector3<f64>, f64) {
    let range = |column: &[f64]| column.iter().fold((f64::MAX, f64::MIN), |(l, h), &x| (l.min(x), h.max(x)));
    let ranges = r.axes().map(range);
    let centre = Vector3::from(ranges.map(|(low, high)| 0.5 * (low + high)));
    (centre, ranges.iter().map(|(low, high)| high - low).fold(0.0, f64::max))
}

/// What positions are relative to during a run [m]. Zero where the cloud is not far away compared with its extent, and where
/// walls, boxes or outer fields tell places apart, or the errors (52) do.
#[must_use]
pub fn origin(scene: &Scene, particles: &Particles, r: &Columns) -> Vector3<f64> {
    if scene.model == ModelKind::Paper || scene.domain.is_some() || scene.external.is_some() {
        return Vector3::zeros();
    }
    let (centre, extent) = bounds(r);
    let largest = particles.radius.iter().copied().fold(0.0, f64::max);
    let grid = libm::exp2(libm::ceil(libm::log2(FAR * (extent + 2.0 * largest))));
    let origin = centre.map(|x| grid * libm::round(x / grid));
    // Only where it costs no bit of any coordinate.
    let exact = r.axes().iter().zip(origin.iter()).all(|(column, o)| column.iter().all(|x| (x - o) + o == *x));
    if exact && origin.iter().all(|x| x.is_finite()) { origin } else { Vector3::zeros() }
}

/// The particles in an order that other numbers and mirrors do not change: by their distance from the middle of the cloud, then
/// by radius and mass, then by place.
#[must_use]
pub fn order(particles: &Particles, r: &Columns) -> Vec<u32> {
    let (centre, _) = bounds(r);
    let far: Vec<f64> = (0..r.len()).map(|i| (r.get(i) - centre).norm_squared()).collect();
    let key = |i: usize| [far[i], particles.radius[i], particles.mass[i], r.x[i], r.y[i], r.z[i]];
    let mut order: Vec<u32> = (0..r.len() as u32).collect();
    order.sort_by(|&a, &b| {
        let pairs = key(a as usize).into_iter().zip(key(b as usize));
        pairs.map(|(x, y)| x.total_cmp(&y)).find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    });
    order
}

/// The place of every particle in an order.
#[must_use]
pub fn ranks(order: &[u32]) -> Vec<u32> {
    let mut ranks = vec![0; order.len()];
    for (rank, &i) in order.iter().enumerate() {
        ranks[i as usize] = rank as u32;
    }
    ranks
}
