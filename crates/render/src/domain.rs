//! Lines of the domain: the periodic box, and walls as patches of a grid.

use agglo_core::scene::{Domain, Wall};
use nalgebra::Vector3;

/// Lines of a wall's patch, each way, beside the middle one.
const LINES: i32 = 6;

/// A straight line [m].
pub type Segment = [Vector3<f64>; 2];

/// The twelve edges of the periodic box; none where there is no box. `low` and `high` are the corners of the box around
/// all that is shown: open directions are drawn as long as that.
pub fn outline(domain: &Domain, low: Vector3<f64>, high: Vector3<f64>) -> Vec<Segment> {
    let Some(lengths) = domain.periodic.filter(|lengths| lengths.iter().any(Option::is_some)) else {
        return Vec::new();
    };
    let ends: [[f64; 2]; 3] = std::array::from_fn(|k| lengths[k].map_or([low[k], high[k]], |length| [0.0, length]));
    let corner = |bits: usize| Vector3::from_fn(|k, _| ends[k][bits >> k & 1]);
    // An edge joins two corners that differ in one bit.
    let edges = (0..8_usize).flat_map(|from| (0..3).map(move |axis| (from, from | 1 << axis)));
    finite(edges.filter(|(from, to)| from != to).map(|(from, to)| [corner(from), corner(to)]).collect())
}

/// The lines of the walls.
pub fn walls(domain: &Domain, low: Vector3<f64>, high: Vector3<f64>) -> Vec<Segment> {
    finite(domain.walls.iter().flat_map(|wall| patch(wall, low, high)).collect())
}

fn finite(mut segments: Vec<Segment>) -> Vec<Segment> {
    segments.retain(|segment| segment.iter().flat_map(|end| end.iter()).all(|x| x.is_finite()));
    segments
}

/// A square grid on a wall below the middle of what is shown, as wide as that.
fn patch(wall: &Wall, low: Vector3<f64>, high: Vector3<f64>) -> Vec<Segment> {
    let Some(normal) = Vector3::from(wall.normal).try_normalize(0.0) else { return Vec::new() };
    let middle = (low + high) * 0.5;
    let foot = middle - normal * (middle - Vector3::from(wall.point)).dot(&normal);
    // Along the axes where the wall is at right angles to one.
    let least = normal.iamin();
    let across = normal.cross(&Vector3::ith(least, 1.0)).normalize();
    let along = normal.cross(&across);
    let half = 0.6 * (high - low).norm();
    let grid = |a: Vector3<f64>, b: Vector3<f64>| {
        (-LINES..=LINES).map(move |k| {
            let line = foot + a * (half * f64::from(k) / f64::from(LINES));
            [line - b * half, line + b * half]
        })
    };
    grid(across, along).chain(grid(along, across)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_twelve_edges_and_a_wall_lies_in_its_plane() {
        let (low, high) = (Vector3::new(0.0, 0.0, 1.0), Vector3::new(1.0, 1.0, 3.0));
        let periodic = Domain { periodic: Some([Some(2.0), Some(2.0), None]), walls: Vec::new() };
        let edges = outline(&periodic, low, high);
        assert_eq!(edges.len(), 12);
        assert!(edges.iter().all(|[a, b]| (a - b).norm() == 2.0));
        let wall = Wall { point: [5.0, 5.0, -1.0], normal: [0.0, 0.0, 3.0] };
        let floor = walls(&Domain { periodic: None, walls: vec![wall] }, low, high);
        assert!(!floor.is_empty() && floor.iter().flatten().all(|end| (end.z + 1.0).abs() < 1e-12));
    }
}
