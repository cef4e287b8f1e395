//! Where a cloud is seen from, and the nearest place from which all of it is.

use nalgebra::Vector3;

use crate::error::RenderError;
use crate::options::View;

/// Half the angle of view along the shorter side of a picture, as its tangent: 30 degrees in all.
const HALF_VIEW: f64 = 0.268;
/// Part of a side that is filled by what a camera is fitted to [-].
const FILLED: f64 = 0.92;

/// Directions of a camera: right, up and forward, as unit vectors.
pub type Axes = [Vector3<f64>; 3];

/// The directions of a view.
///
/// # Errors
/// A camera at its own target, or numbers too large to tell where it looks.
pub fn axes(view: View) -> Result<Axes, RenderError> {
    let forward = match view {
        View::From { azimuth, elevation } => {
            let (sin_a, cos_a) = libm::sincos(azimuth.to_radians());
            let (sin_e, cos_e) = libm::sincos(elevation.to_radians());
            let right = Vector3::new(-sin_a, cos_a, 0.0);
            let forward = -Vector3::new(cos_e * cos_a, cos_e * sin_a, sin_e);
            return Ok([right, right.cross(&forward), forward]);
        }
        View::Placed { eye, target } => Vector3::from(target) - Vector3::from(eye),
    };
    let length = forward.norm();
    if !(length > 0.0 && length.is_finite()) {
        return Err(RenderError::asked(
            "a camera at its own target sees nothing",
            "give --camera and --target different places",
        ));
    }
    let forward = forward / length;
    // Up is z as far as it can be; a camera that looks along z has y up.
    let right = forward.cross(&Vector3::z()).try_normalize(1e-9).unwrap_or_else(Vector3::x);
    Ok([right, right.cross(&forward), forward])
}

/// A camera of one picture of `size` pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Its place [m].
    pub eye: Vector3<f64>,
    /// Right, up, forward.
    pub axes: Axes,
    /// Whether rays come from all around to the eye, rather than side by side.
    pub perspective: bool,
    /// Pixels per metre: at a distance of 1 m in perspective.
    pub scale: f64,
    /// The pixel that it looks at.
    pub centre: [f64; 2],
}

impl Camera {
    /// A point in the directions of the camera: metres to the right, up and forward of the eye.
    pub fn view(&self, point: Vector3<f64>) -> [f64; 3] {
        let from_eye = point - self.eye;
        self.axes.map(|axis| axis.dot(&from_eye))
    }

    /// The pixel of a point in front of the eye, given as by [`Camera::view`].
    pub fn pixel(&self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        let scale = if self.perspective { self.scale / z } else { self.scale };
        [self.centre[0] + scale * x, self.centre[1] - scale * y]
    }

    /// A camera at a given place, which at zoom 1 shows as wide an angle as a fitted one.
    pub fn placed(
        eye: [f64; 3],
        target: [f64; 3],
        zoom: f64,
        perspective: bool,
        size: [usize; 2],
    ) -> Result<Self, RenderError> {
        let scale = zoom * 0.5 * size[0].min(size[1]) as f64 / HALF_VIEW;
        let (eye, target) = (Vector3::from(eye), Vector3::from(target));
        let axes = axes(View::Placed { eye: eye.into(), target: target.into() })?;
        let scale = if perspective { scale } else { scale / (target - eye).norm() };
        Ok(Self { eye, axes, perspective, scale, centre: size.map(|side| 0.5 * side as f64) })
    }
}

/// How far spheres reach, seen in given directions: what a camera has to take in.
#[derive(Clone, Debug)]
pub struct Extent {
    axes: Axes,
    /// Tangents of half the angles of view, across and along.
    slopes: [f64; 2],
    /// The farthest reach beyond the planes through the origin that bound the view: right, left, up, down.
    planes: [f64; 4],
    /// Least and greatest coordinate to the right, up, forward.
    low: [f64; 3],
    high: [f64; 3],
    size: [usize; 2],
}

impl Extent {
    /// Of nothing yet, for pictures of `size` pixels.
    pub fn new(axes: Axes, size: [usize; 2]) -> Self {
        let shorter = size[0].min(size[1]) as f64;
        let slopes = size.map(|side| FILLED * HALF_VIEW * side as f64 / shorter);
        let (least, most) = (f64::INFINITY, f64::NEG_INFINITY);
        Self { axes, slopes, planes: [most; 4], low: [least; 3], high: [most; 3], size }
    }

    /// Takes in a sphere.
    pub fn add(&mut self, centre: Vector3<f64>, radius: f64) {
        let place = self.axes.map(|axis| axis.dot(&centre));
        for (k, coordinate) in place.into_iter().enumerate() {
            self.low[k] = self.low[k].min(coordinate - radius);
            self.high[k] = self.high[k].max(coordinate + radius);
        }
        for (k, plane) in self.planes.iter_mut().enumerate() {
            let slope = self.slopes[k / 2];
            let side = if k % 2 == 0 { place[k / 2] } else { -place[k / 2] };
            let length = (1.0 + slope * slope).sqrt();
            *plane = plane.max((side - slope * place[2]) / length + radius);
        }
    }

    /// Whether anything was taken in.
    pub fn is_empty(&self) -> bool {
        self.low[0] > self.high[0]
    }

    /// Diagonal of the box around all [m].
    pub fn diagonal(&self) -> f64 {
        Vector3::from(self.high).metric_distance(&Vector3::from(self.low))
    }

    /// Least and greatest distance from a camera along its direction [m].
    pub fn depths(&self, camera: &Camera) -> [f64; 2] {
        let eye = self.axes[2].dot(&camera.eye);
        [self.low[2] - eye, self.high[2] - eye]
    }

    /// The nearest camera that sees all; at a zoom above 1 what is in the middle.
    pub fn camera(&self, perspective: bool, zoom: f64) -> Camera {
        let half = self.size.map(|side| 0.5 * side as f64);
        let shorter = half[0].min(half[1]);
        let [right, up, forward] = self.axes;
        let (place, scale) = if perspective {
            let cosine = |k: usize| 1.0 / (1.0 + self.slopes[k] * self.slopes[k]).sqrt();
            let middle = |k: usize| 0.5 * (self.planes[2 * k] - self.planes[2 * k + 1]) / cosine(k);
            // The eye is so far back that it is beyond both pairs of planes.
            let back = |k: usize| -0.5 * (self.planes[2 * k] + self.planes[2 * k + 1]) / (self.slopes[k] * cosine(k));
            ([middle(0), middle(1), back(0).min(back(1))], shorter / HALF_VIEW)
        } else {
            let middle = |k: usize| 0.5 * (self.low[k] + self.high[k]);
            let fits = |k: usize| FILLED * 2.0 * half[k] / (self.high[k] - self.low[k]);
            // Any distance will do; this one keeps all in front.
            ([middle(0), middle(1), self.low[2] - self.diagonal()], fits(0).min(fits(1)))
        };
        let eye = right * place[0] + up * place[1] + forward * place[2];
        Camera { eye, axes: self.axes, perspective, scale: scale * zoom, centre: half }
    }
}

/// The centre of mass of particles of these masses [kg] and places [m].
pub fn centre_of_mass(particles: impl Iterator<Item = (f64, Vector3<f64>)>) -> Vector3<f64> {
    let (total, sum) =
        particles.fold((0.0, Vector3::zeros()), |(total, sum), (mass, place)| (total + mass, sum + place * mass));
    if total > 0.0 { sum / total } else { Vector3::zeros() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRONT: View = View::From { azimuth: -90.0, elevation: 0.0 };

    #[test]
    fn from_minus_y_x_is_right_and_z_is_up() {
        let [right, up, forward] = axes(FRONT).unwrap();
        for (axis, expected) in [(right, Vector3::x()), (up, Vector3::z()), (forward, Vector3::y())] {
            assert!((axis - expected).norm() < 1e-15);
        }
        let above = axes(View::From { azimuth: -90.0, elevation: 90.0 }).unwrap();
        assert!((above[1] - Vector3::y()).norm() < 1e-15, "from above y is up");
        let placed = axes(View::Placed { eye: [0.0, -3.0, 0.0], target: [0.0; 3] }).unwrap();
        assert!((placed[0] - Vector3::x()).norm() < 1e-15);
        assert!(axes(View::Placed { eye: [1.0; 3], target: [1.0; 3] }).is_err());
    }

    /// The bounds of a sphere's image in perspective follow from the tangents to it.
    fn bounds(camera: &Camera, centre: Vector3<f64>, radius: f64, k: usize) -> [f64; 2] {
        let view = camera.view(centre);
        let (across, forward) = (view[k], view[2]);
        let root = radius * (across * across + forward * forward - radius * radius).sqrt();
        let slope = |sign: f64| (across * forward + sign * root) / (forward * forward - radius * radius);
        [slope(-1.0), slope(1.0)].map(|slope| camera.scale * slope)
    }

    #[test]
    fn a_fitted_camera_takes_in_every_sphere_and_touches_some() {
        let spheres = [
            (Vector3::new(0.0, 0.0, 0.0), 0.3),
            (Vector3::new(2.0, 1.0, 0.5), 0.1),
            (Vector3::new(-1.0, 3.0, -0.7), 0.2),
        ];
        for (size, view) in [([400, 300], FRONT), ([200, 500], View::default())] {
            let mut extent = Extent::new(axes(view).unwrap(), size);
            spheres.iter().for_each(|&(centre, radius)| extent.add(centre, radius));
            let camera = extent.camera(true, 1.0);
            let mut filled = [0.0_f64; 2];
            for (k, side) in size.into_iter().enumerate() {
                let all: Vec<[f64; 2]> = spheres.iter().map(|&(c, r)| bounds(&camera, c, r, k)).collect();
                let low = all.iter().fold(f64::INFINITY, |low, b| low.min(b[0]));
                let high = all.iter().fold(f64::NEG_INFINITY, |high, b| high.max(b[1]));
                filled[k] = high.max(-low) / (0.5 * side as f64);
            }
            // The side that decides is filled to the margin exactly.
            assert!((filled[0].max(filled[1]) - FILLED).abs() < 1e-9, "{filled:?}");
        }
    }

    #[test]
    fn side_by_side_rays_keep_sizes() {
        let mut extent = Extent::new(axes(FRONT).unwrap(), [100, 100]);
        extent.add(Vector3::new(0.0, 0.0, 0.0), 1.0);
        extent.add(Vector3::new(0.0, 5.0, 0.0), 1.0);
        let camera = extent.camera(false, 1.0);
        assert!((camera.scale - 0.5 * 100.0 * FILLED).abs() < 1e-9);
        let [near, far] = [0.0, 5.0].map(|y| camera.pixel(camera.view(Vector3::new(0.0, y, 0.0))));
        // To the rounding of the cosine of 90 degrees.
        assert!((near[0] - far[0]).abs() < 1e-9 && (near[1] - far[1]).abs() < 1e-9, "{near:?} {far:?}");
        assert!((camera.view(Vector3::zeros())[2]) > 1.0, "all is in front");
    }

    #[test]
    fn masses_weigh() {
        let particles = [(1.0, Vector3::new(0.0, 0.0, 1.0)), (2.0, Vector3::new(3.0, 0.0, 1.0))];
        assert_eq!(centre_of_mass(particles.into_iter()), Vector3::new(2.0, 0.0, 1.0));
    }
}
