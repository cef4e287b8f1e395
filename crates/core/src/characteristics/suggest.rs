//! A step to begin with, judged from the initial state and the natural periods of pairs.

use nalgebra::Vector3;

use super::Survey;
use crate::scene::{Scene, Wall};
use crate::state::{Particles, State};

/// Steps per shortest natural period that [`suggest_step`] asks for. Velocity Verlet is stable above pi; 50 keeps its
/// phase error near 0.07 % of a period and leaves room for several neighbours stiffening the same particle.
const STEPS_PER_PERIOD: f64 = 50.0;

/// Share of the smallest radius that a particle may travel in a suggested step; a larger one deepens overlaps before an
/// impact at a step's end is seen.
const TRAVEL: f64 = 0.1;

/// Fewest steps of a suggested step in the duration, where nothing else limits it.
const FEWEST_STEPS: f64 = 100.0;

/// A step to begin with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuggestedStep {
    /// The step [s].
    pub seconds: f64,
    /// What limits it.
    pub limit: StepLimit,
}

/// What limits a suggested step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepLimit {
    /// A fiftieth of the shortest natural period of a pair.
    Period,
    /// The fastest approach covers a tenth of the smallest radius.
    Travel,
    /// External forces move a particle by a tenth of the smallest radius from rest.
    Fall,
    /// Nothing but the duration, of which it is a hundredth.
    Duration,
}

impl std::fmt::Display for StepLimit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Period => "1/50 of the shortest natural period",
            Self::Travel => "the fastest approach covers 1/10 of the smallest radius",
            Self::Fall => "external forces move a particle by 1/10 of the smallest radius",
            Self::Duration => "1/100 of the duration; nothing else limits it",
        })
    }
}

/// A step small enough for every pair's vibration and, with contact, for impacts to be seen in time, judged from the
/// initial state. A cloud that collapses or heats up may need a smaller one.
#[must_use]
pub fn suggest_step(scene: &Scene, particles: &Particles, state: &State, survey: &Survey) -> SuggestedStep {
    let mut step = SuggestedStep { seconds: scene.duration / FEWEST_STEPS, limit: StepLimit::Duration };
    let mut limit = |seconds: f64, limit: StepLimit| {
        if seconds > 0.0 && seconds < step.seconds {
            step = SuggestedStep { seconds, limit };
        }
    };
    if let Some((period, _)) = survey.shortest_period() {
        limit(period / STEPS_PER_PERIOD, StepLimit::Period);
    }
    if scene.contact.is_some() && !particles.is_empty() {
        let reach = TRAVEL * particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
        limit(reach / largest_approach(scene, particles, state), StepLimit::Travel);
        let fall = (0..particles.len()).map(|i| external(scene, particles, i).norm()).fold(0.0, f64::max);
        limit((2.0 * reach / fall).sqrt(), StepLimit::Fall);
    }
    step
}

/// Speed at which the fastest approach ends [m/s]: of two particles at most twice their largest speed relative to the
/// mean, of a particle falling onto a wall what gravity and field add on the way.
fn largest_approach(scene: &Scene, particles: &Particles, state: &State) -> f64 {
    let n = particles.len();
    let mean = (0..n).map(|i| state.velocity.get(i)).sum::<Vector3<f64>>() / n as f64;
    let pair = 2.0 * (0..n).map(|i| (state.velocity.get(i) - mean).norm()).fold(0.0, f64::max);
    let walls = scene.domain.as_ref().map_or(&[][..], |domain| &domain.walls[..]);
    let onto_wall = |wall: &Wall| {
        let inward = Vector3::from(wall.normal).normalize();
        let speed = |i: usize| {
            let towards = state.velocity.get(i).dot(&inward);
            let height = (state.position.get(i) - Vector3::from(wall.point)).dot(&inward) - particles.radius[i];
            let pull = -external(scene, particles, i).dot(&inward);
            (towards * towards + 2.0 * pull.max(0.0) * height.max(0.0)).sqrt()
        };
        (0..n).map(speed).fold(0.0, f64::max)
    };
    walls.iter().map(onto_wall).fold(if n > 1 { pair } else { 0.0 }, f64::max)
}

/// Acceleration of particle i by external forces [m/s^2].
fn external(scene: &Scene, particles: &Particles, i: usize) -> Vector3<f64> {
    let Some(external) = &scene.external else { return Vector3::zeros() };
    let per_mass = particles.charge.as_ref().map_or(0.0, |q| q[i] / particles.mass[i]);
    let field = Vector3::from(external.electric_field.unwrap_or_default());
    Vector3::from(external.gravity.unwrap_or_default()) + per_mass * field
}
