//! One moment as a picture: its spheres and lines in the directions of the camera, and what is written beside them.

use agglo_core::state::Particles;
use agglo_replay::Frame;
use nalgebra::Vector3;

use crate::camera::Camera;
use crate::canvas::{Canvas, Rgb};
use crate::clusters::ClusterColors;
use crate::colors::{PLAIN, SINGLE, Scale};
use crate::domain::Segment;
use crate::occlusion::{Occlusion, Sphere};
use crate::options::Quantity;
use crate::quantity::Clock;
use crate::shading::light;
use crate::sheet::{self, Corners, Theme};
use crate::spheres::{Ball, Line, Stage, paint};
use crate::survey::{Subject, is_finite, value};
use crate::text::Text;

/// Share of the ground's colour that the farthest part of a large cloud takes on [-]: enough to see what is behind, too
/// little to take one value of the colour bar for another.
const HAZE: f32 = 0.12;

/// Steps of the colour bar in a picture of few colours, which keeps them as they are.
pub const BAR_STEPS: u32 = 48;

/// Draws single moments.
pub struct Artist<'a> {
    pub particles: &'a Particles,
    pub subject: &'a Subject,
    pub quantity: Quantity,
    pub scale: Option<Scale>,
    pub camera: Camera,
    pub depths: [f64; 2],
    pub segments: Vec<Segment>,
    pub clock: Clock,
    pub theme: Theme,
    pub text: Text,
    pub em: f32,
    pub size: [usize; 2],
}

impl Artist<'_> {
    /// A moment; one that is alone has axes and a length in its corners.
    pub fn moment(&self, frame: &Frame, colors: &mut ClusterColors, alone: bool) -> Canvas {
        let anchor = self.subject.anchor(self.particles, frame);
        let camera = Camera { eye: self.camera.eye + anchor, ..self.camera };
        let balls = self.balls(frame, &camera, colors);
        let spheres: Vec<Sphere> = balls.iter().filter(|ball| !ball.faded).map(|ball| ball.sphere).collect();
        let lines = self.lines(&camera);
        let stage = Stage {
            camera: &camera,
            balls: &balls,
            lines: &lines,
            occlusion: &Occlusion::new(spheres),
            ground: light(self.theme.ground),
            depths: self.depths,
            haze: self.haze(),
        };
        let mut canvas = Canvas::new(self.size[0], self.size[1], self.theme.ground);
        paint(&stage, &mut canvas);
        let em = self.em;
        sheet::time(&mut canvas, em, &self.text, &self.theme, &self.clock.text(frame.t));
        if let Some(corners) = Corners::of_picture(self.size, em).filter(|_| alone) {
            self.measures(&mut canvas, &corners);
        }
        canvas
    }

    /// Colours that a picture of few colours keeps as they are: those of the page, and steps of the colour bar.
    pub fn exact(&self) -> Vec<Rgb> {
        let bar = self
            .scale
            .iter()
            .flat_map(|scale| (0..BAR_STEPS).map(|k| scale.at(f64::from(k) / f64::from(BAR_STEPS - 1))));
        self.theme.exact().into_iter().chain(bar).collect()
    }

    /// Haze sets what is behind apart from what is in front, not the parts of one sphere.
    fn haze(&self) -> f32 {
        let radii = self.particles.radius.iter().copied().filter(|radius| radius.is_finite());
        let (largest, deep) = (2.0 * radii.fold(0.0, f64::max), self.depths[1] - self.depths[0]);
        if deep > largest { HAZE * (1.0 - largest / deep) as f32 } else { 0.0 }
    }

    /// Axes and a length.
    pub fn measures(&self, canvas: &mut Canvas, corners: &Corners) {
        let (pen, middle) = ((&self.text, &self.theme), 0.5 * (self.depths[0] + self.depths[1]));
        sheet::triad(canvas, corners, pen, &self.camera);
        sheet::ruler(canvas, corners, pen, (&self.camera, middle, self.size[0]));
    }

    fn balls(&self, frame: &Frame, camera: &Camera, colors: &mut ClusterColors) -> Vec<Ball> {
        let particles = self.particles;
        let by_cluster = match (&frame.cluster, self.quantity) {
            (Some(numbers), Quantity::Cluster) => Some(colors.next(numbers)),
            _ => None,
        };
        let color = |i: usize| -> Rgb {
            match (&by_cluster, &self.scale) {
                (Some(colors), _) => colors.get(i).copied().unwrap_or(SINGLE),
                (None, Some(scale)) => scale.color(value(self.quantity, particles, frame, i).unwrap_or(f64::NAN)),
                (None, None) => PLAIN,
            }
        };
        let members = self.subject.members.as_ref();
        let mut balls: Vec<Ball> = (0..particles.len())
            .filter(|&i| is_finite(particles, frame, i))
            .map(|i| Ball {
                sphere: Sphere { centre: camera.view(self.subject.place(frame, i)), radius: particles.radius[i] },
                color: light(color(i)),
                faded: members.is_some_and(|members| members.binary_search(&i).is_err()),
            })
            .collect();
        balls.sort_by_key(|ball| ball.faded);
        balls
    }

    fn lines(&self, camera: &Camera) -> Vec<Line> {
        let (color, width) = (light(self.theme.line), (0.07 * f64::from(self.em)).max(1.0));
        let line = |ends: &[Vector3<f64>; 2]| Line { ends: ends.map(|end| camera.view(end)), color, width };
        self.segments.iter().map(line).collect()
    }
}
