//! The domain: periodic directions with minimum image, and plane walls (no near field, no binding).

use crate::lanes;
use crate::scene;
use crate::simd::Simd;
use crate::state::Columns;
use nalgebra::Vector3;

/// Periodic lengths, as the pair loop wants them: an open direction has length and inverse zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Periodic {
    /// Box lengths L [m]; 0: open.
    pub length: [f64; 3],
    /// 1/L [1/m]; 0: open.
    pub inverse: [f64; 3],
}

impl Periodic {
    /// Whether any direction is periodic.
    #[must_use]
    pub fn any(&self) -> bool {
        self.length.iter().any(|&l| l > 0.0)
    }

    /// The shortest of all images of a separation [m].
    #[inline(always)]
    #[must_use]
    pub fn minimum_image(&self, axis: usize, d: f64) -> f64 {
        d - self.length[axis] * crate::math::round(d * self.inverse[axis])
    }

    /// The same of eight separations.
    #[inline(always)]
    pub fn minimum_images<S: Simd>(&self, simd: S, axis: usize, d: S::F) -> S::F {
        d - simd.splat(self.length[axis]) * lanes::round(simd, d * simd.splat(self.inverse[axis]))
    }

    /// r_j - r_i, minimum image [m].
    #[must_use]
    pub fn separation(&self, r: &Columns, i: usize, j: usize) -> Vector3<f64> {
        let d = r.get(j) - r.get(i);
        Vector3::new(self.minimum_image(0, d.x), self.minimum_image(1, d.y), self.minimum_image(2, d.z))
    }
}

/// A plane wall: particles stay where (r - point).normal >= radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// A point of the plane [m].
    pub point: Vector3<f64>,
    /// Unit normal into the side of the particles [-].
    pub normal: Vector3<f64>,
}

impl Wall {
    /// Distance of a point from the plane, positive on the particles' side [m].
    #[must_use]
    pub fn distance(&self, r: &Vector3<f64>) -> f64 {
        (r - self.point).dot(&self.normal)
    }
}

/// Periodic directions and walls.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Domain {
    /// Periodic directions.
    pub periodic: Periodic,
    /// Walls, in the order of the scene.
    pub walls: Vec<Wall>,
}

impl Domain {
    /// From a scene's section.
    #[must_use]
    pub fn new(domain: Option<&scene::Domain>) -> Self {
        let Some(domain) = domain else { return Self::default() };
        let mut periodic = Periodic::default();
        for (axis, length) in domain.periodic.unwrap_or_default().iter().enumerate() {
            if let Some(length) = *length {
                periodic.length[axis] = length;
                periodic.inverse[axis] = 1.0 / length;
            }
        }
        let walls = domain
            .walls
            .iter()
            .map(|w| Wall { point: Vector3::from(w.point), normal: Vector3::from(w.normal).normalize() })
            .collect();
        Self { periodic, walls }
    }

    /// Puts positions that left the box back in, and calls `moved(particle, axis, shift)` for each, shift in metres.
    pub fn wrap(&self, r: &mut Columns, mut moved: impl FnMut(usize, usize, f64)) {
        if !self.periodic.any() {
            return;
        }
        for (axis, column) in r.axes_mut().into_iter().enumerate() {
            let length = self.periodic.length[axis];
            if length == 0.0 {
                continue;
            }
            for (i, x) in column.iter_mut().enumerate() {
                if *x < 0.0 || *x >= length {
                    let before = *x;
                    *x -= length * (before / length).floor();
                    // A tiny negative coordinate rounds to the length itself.
                    if *x >= length {
                        *x = 0.0;
                    }
                    moved(i, axis, *x - before);
                }
            }
        }
    }
}
