//! What all moments of a picture have in common: how far they reach, their values, their times. A picture's camera and
//! colours stay the same from moment to moment.

use agglo_core::scene::Scene;
use agglo_core::state::{Particles, State};
use agglo_record::palette;
use agglo_replay::Frame;
use nalgebra::Vector3;

use crate::camera::{Axes, Camera, Extent, centre_of_mass};
use crate::colors::Scale;
use crate::error::RenderError;
use crate::options::{Options, Quantity, View};
use crate::quantity::round_up;

/// Part of the particles that the colours of a bar tell apart at any moment; a few hot or fast ones would leave all
/// others one colour [-].
const MOST: f64 = 0.95;

/// Which particles are looked at, and what is drawn of them.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Numbers of the particles that the camera is fitted to, rising; `None`: all.
    pub members: Option<Vec<usize>>,
    /// Whether the camera goes along with their centre of mass.
    pub follows: bool,
    /// Lengths of a periodic box in which they are drawn as one piece [m].
    pub periodic: Option<[Option<f64>; 3]>,
}

impl Subject {
    fn each<'a>(&'a self, particles: &Particles) -> Box<dyn Iterator<Item = usize> + 'a> {
        match &self.members {
            Some(members) => Box::new(members.iter().copied()),
            None => Box::new(0..particles.len()),
        }
    }

    /// Where a particle is drawn [m]: in a periodic box its image that is nearest to the first one looked at.
    pub fn place(&self, frame: &Frame, i: usize) -> Vector3<f64> {
        let place = frame.position.get(i);
        let first = self.members.as_ref().and_then(|members| members.first());
        let (Some(lengths), Some(&first)) = (self.periodic, first) else { return place };
        let reference = frame.position.get(first);
        Vector3::from_fn(|k, _| {
            let boxes = lengths[k].map_or(0.0, |length| libm::round((place[k] - reference[k]) / length));
            if boxes.is_finite() { place[k] - lengths[k].unwrap_or(0.0) * boxes } else { place[k] }
        })
    }

    /// What the camera's place is relative to [m].
    pub fn anchor(&self, particles: &Particles, frame: &Frame) -> Vector3<f64> {
        let whole = |&i: &usize| is_finite(particles, frame, i);
        if self.follows {
            let places = self.each(particles).filter(whole).map(|i| (particles.mass[i], self.place(frame, i)));
            centre_of_mass(places)
        } else {
            Vector3::zeros()
        }
    }
}

/// Whether a particle can be drawn.
pub fn is_finite(particles: &Particles, frame: &Frame, i: usize) -> bool {
    let place = frame.position.get(i);
    // Squares of what is larger do not fit into a number.
    place.iter().all(|x| x.abs() < 1e150) && particles.radius[i].is_finite() && particles.mass[i].is_finite()
}

/// Gathers what moments have in common.
#[derive(Debug)]
pub struct Survey<'a> {
    particles: &'a Particles,
    subject: &'a Subject,
    quantity: Quantity,
    extent: Extent,
    corners: [Vector3<f64>; 2],
    values: [f64; 2],
    /// The value that most particles stay below, at the moment when it is highest.
    common: f64,
    /// Most particles of a moment that cannot be drawn.
    pub lost: usize,
    /// Most particles of a moment whose value is no number.
    pub valueless: usize,
    /// Time of every moment [s].
    pub times: Vec<f64>,
}

impl<'a> Survey<'a> {
    /// Of nothing yet.
    pub fn new(
        particles: &'a Particles,
        subject: &'a Subject,
        quantity: Quantity,
        (axes, size): (Axes, [usize; 2]),
    ) -> Self {
        Self {
            particles,
            subject,
            quantity,
            extent: Extent::new(axes, size),
            corners: [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)],
            values: [f64::INFINITY, f64::NEG_INFINITY],
            common: 0.0,
            lost: 0,
            valueless: 0,
            times: Vec::new(),
        }
    }

    /// Takes in a moment.
    pub fn add(&mut self, frame: &Frame) {
        self.times.push(frame.t);
        let anchor = self.subject.anchor(self.particles, frame);
        for i in self.subject.each(self.particles) {
            if is_finite(self.particles, frame, i) {
                let (place, radius) = (self.subject.place(frame, i), self.particles.radius[i]);
                self.extent.add(place - anchor, radius);
                self.corners[0] = self.corners[0].inf(&place.add_scalar(-radius));
                self.corners[1] = self.corners[1].sup(&place.add_scalar(radius));
            }
        }
        let particles = self.particles;
        self.lost = self.lost.max((0..particles.len()).filter(|&i| !is_finite(particles, frame, i)).count());
        let mut values: Vec<f64> =
            (0..particles.len()).filter_map(|i| value(self.quantity, particles, frame, i)).collect();
        let all = values.len();
        values.retain(|value| value.is_finite());
        self.valueless = self.valueless.max(all - values.len());
        for &value in &values {
            self.values = [self.values[0].min(value), self.values[1].max(value)];
        }
        let rank = (MOST * values.len() as f64) as usize;
        if rank < values.len() {
            let (_, value, _) = values.select_nth_unstable_by(rank, f64::total_cmp);
            self.common = self.common.max(*value);
        }
    }

    /// Takes in a point of the domain.
    pub fn add_point(&mut self, point: Vector3<f64>) {
        self.extent.add(point, 0.0);
    }

    /// The corners of the box around all that is looked at [m].
    pub fn corners(&self) -> [Vector3<f64>; 2] {
        self.corners
    }

    /// The camera for a picture of this size, and between which distances from it all lies.
    ///
    /// # Errors
    /// Nothing to see, or a camera that sees nothing.
    pub fn camera(&self, options: &Options, size: [usize; 2]) -> Result<(Camera, [f64; 2]), RenderError> {
        let camera = match options.view {
            View::Placed { eye, target } => Camera::placed(eye, target, options.zoom, !options.orthographic, size)?,
            View::From { .. } if self.extent.is_empty() => {
                let text = "no particle has a position and a radius that can be drawn";
                return Err(RenderError::asked(text, "`agglo analyze` says more about such a log"));
            }
            View::From { .. } => self.extent.camera(!options.orthographic, options.zoom),
        };
        let depths = self.extent.depths(&camera);
        let sound = camera.scale > 0.0 && camera.scale.is_finite() && camera.eye.iter().all(|x| x.is_finite());
        if !sound {
            let text = format!("a camera at {:?} m cannot be computed with", camera.eye.as_slice());
            return Err(RenderError::asked(text, "give --camera, --target and --zoom of the cloud's own size"));
        }
        Ok((camera, depths))
    }

    /// The scale of the colours, and whether values go beyond its lower and upper end.
    pub fn scale(&self, options: &Options, suggested: Option<(f64, f64)>) -> (Option<Scale>, [bool; 2]) {
        let [least, most] = if self.values[0] <= self.values[1] { self.values } else { [0.0, 0.0] };
        let usual = match self.quantity {
            Quantity::Temperature => match suggested {
                Some((low, high)) if self.common > high => [low, round_up(self.common)],
                Some((low, high)) => [low, high],
                None => [least, most],
            },
            Quantity::Speed => [0.0, round_up(self.common).min(most)],
            Quantity::Charge => {
                let largest = most.abs().max(least.abs());
                [-largest, largest]
            }
            Quantity::Cluster | Quantity::None => return (None, [false; 2]),
        };
        let [low, high] = options.range.unwrap_or(usual);
        // One value only, or none.
        let high = if high > low { high } else { low + low.abs().max(1.0) };
        let scale = Scale { quantity: self.quantity, low, high };
        // What rounds to an end is not beyond it.
        let slack = 1e-9 * (high - low);
        (Some(scale), [least < low - slack, most > high + slack])
    }
}

/// What colours stand for, of particle `i`.
pub fn value(quantity: Quantity, particles: &Particles, frame: &Frame, i: usize) -> Option<f64> {
    match quantity {
        Quantity::Temperature => frame.temperature.as_ref()?.get(i).copied(),
        Quantity::Speed => Some(frame.velocity.get(i).norm()),
        Quantity::Charge => particles.charge.as_ref()?.get(i).copied(),
        Quantity::Cluster | Quantity::None => None,
    }
}

/// The range of temperatures that viewers show for a scene [K], from its first state.
pub fn suggested(scene: &Scene, particles: &Particles, first: &Frame) -> Option<(f64, f64)> {
    let start = State { temperature: first.temperature.clone(), ..State::default() };
    palette::temperatures(scene, particles, &start).filter(|(low, high)| low.is_finite() && high.is_finite())
}
