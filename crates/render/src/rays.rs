//! Rays from the eye through places on the page to spheres, and the part of the page that a sphere can cover.

use crate::camera::Camera;
use crate::occlusion::Sphere;

/// Rays from the eye to a sphere.
pub struct Rays<'a> {
    camera: &'a Camera,
    sphere: Sphere,
    per_pixel: f64,
    /// |c|^2 - r^2.
    excess: f64,
}

impl<'a> Rays<'a> {
    /// To this sphere.
    pub fn new(camera: &'a Camera, sphere: Sphere) -> Self {
        let Sphere { centre: [x, y, z], radius } = sphere;
        Self { camera, sphere, per_pixel: 1.0 / camera.scale, excess: x * x + y * y + z * z - radius * radius }
    }

    /// Distance along the view at which the ray through a place on the page enters the sphere [m].
    #[inline]
    pub fn depth(&self, px: f64, py: f64) -> Option<f64> {
        let [cx, cy, cz] = self.sphere.centre;
        let x = (px - self.camera.centre[0]) * self.per_pixel;
        let y = (self.camera.centre[1] - py) * self.per_pixel;
        if self.camera.perspective {
            let (along, square) = (x * cx + y * cy + cz, x * x + y * y + 1.0);
            let root = along * along - square * self.excess;
            let depth = (along - root.max(0.0).sqrt()) / square;
            (root >= 0.0 && depth > 0.0).then_some(depth)
        } else {
            let (x, y) = (x - cx, y - cy);
            let root = self.sphere.radius * self.sphere.radius - x * x - y * y;
            (root >= 0.0).then(|| cz - root.sqrt())
        }
    }

    /// As [`Rays::depth`], of the nearest ray where this one passes by, and the ray's direction for a depth of 1.
    pub fn nearest(&self, px: f64, py: f64) -> (f64, [f64; 3]) {
        let [cx, cy, cz] = self.sphere.centre;
        if self.camera.perspective {
            let x = (px - self.camera.centre[0]) * self.per_pixel;
            let y = (self.camera.centre[1] - py) * self.per_pixel;
            let (along, square) = (x * cx + y * cy + cz, x * x + y * y + 1.0);
            let root = (along * along - square * self.excess).max(0.0);
            ((along - root.sqrt()) / square, [x, y, 1.0])
        } else {
            let [x, y, _] = self.offset(px, py);
            let root = (self.sphere.radius * self.sphere.radius - x * x - y * y).max(0.0);
            (cz - root.sqrt(), [0.0, 0.0, 1.0])
        }
    }

    /// From the sphere's centre to a place on the page, in parallel projection [m].
    pub fn offset(&self, px: f64, py: f64) -> [f64; 3] {
        let [cx, cy, _] = self.sphere.centre;
        let x = (px - self.camera.centre[0]) * self.per_pixel;
        let y = (self.camera.centre[1] - py) * self.per_pixel;
        [x - cx, y - cy, 0.0]
    }
}

/// A range of pixels, right and lower end excluded.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Left and upper end.
    pub low: [f64; 2],
    /// Right and lower end.
    pub high: [f64; 2],
}

impl Bounds {
    const NONE: Self = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };
    const ALL: Self = Self { low: [f64::NEG_INFINITY; 2], high: [f64::INFINITY; 2] };

    /// The box around a sphere's image.
    pub fn of(sphere: Sphere, camera: &Camera) -> Self {
        let Sphere { centre: [x, y, z], radius } = sphere;
        if !camera.perspective {
            let [px, py] = camera.pixel([x, y, z]);
            let reach = camera.scale * radius;
            return Self { low: [px - reach, py - reach], high: [px + reach, py + reach] };
        }
        let square = x * x + y * y + z * z;
        if z < -radius || square <= radius * radius {
            // Behind the eye, or around it: from inside, a sphere is not drawn.
            return Self::NONE;
        }
        if z <= radius {
            return Self::ALL;
        }
        // Tangents from the eye, in the planes of either side with the direction of view.
        let tangents = |across: f64| {
            let root = radius * (across * across + z * z - radius * radius).max(0.0).sqrt();
            let below = z * z - radius * radius;
            [(across * z - root) / below, (across * z + root) / below].map(|slope| camera.scale * slope)
        };
        let ([left, right], [down, up]) = (tangents(x), tangents(y));
        let [cx, cy] = camera.centre;
        Self { low: [cx + left, cy - up], high: [cx + right, cy - down] }
    }

    /// Whether it has any pixels.
    pub fn is_empty(&self) -> bool {
        self.low[0] > self.high[0]
    }

    /// Whether it shares anything with this range along one side.
    pub fn meets(&self, k: usize, from: usize, to: usize) -> bool {
        self.low[k] < to as f64 && self.high[k] > from as f64
    }
}
