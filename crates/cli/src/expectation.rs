//! How long a run and its log will be, judged before it starts.

use agglo_core::Scene;
use agglo_core::state::Particles;
use agglo_record::SizeEstimate;

/// How many steps a run takes, and how large its log becomes.
#[derive(Clone, Copy, Debug)]
pub struct Expectation {
    /// Steps at the first step size; an adaptive run may take fewer or more.
    pub steps: u64,
    /// Steps at the largest step size; no run takes fewer.
    pub fewest_steps: u64,
    /// Size at `steps`.
    pub expected: SizeEstimate,
    /// Size at `fewest_steps`.
    pub fewest: SizeEstimate,
    /// A log of `fewest_steps` takes no less [bytes].
    pub least_log: u64,
}

/// Judges a scene.
#[must_use]
pub fn expect(scene: &Scene, particles: &Particles) -> Expectation {
    let (initial, max, _) = agglo_core::assembly::step_limits(scene);
    // A step that is a hair short of the end is not taken.
    let steps = |dt: f64| (scene.duration / dt - 1e-6).ceil().max(1.0) as u64;
    let size = |steps: u64| agglo_record::estimate(scene, particles.len(), steps);
    Expectation {
        steps: steps(initial),
        fewest_steps: steps(max),
        expected: size(steps(initial)),
        fewest: size(steps(max)),
        least_log: agglo_record::least(scene, particles.len(), steps(max)),
    }
}
