//! What one recorded state says, recomputed from it alone.

use agglo_core::assembly::Model;
use agglo_core::force::Field;
use agglo_core::ledger::{Ledger, held_by_particles, momentum};
use agglo_core::math::Sum;
use agglo_core::state::{Columns, Particles, State};
use agglo_record::cloud::Frame;

use super::clusters::{Close, Clusters};
use crate::judge::Shape;

/// Round-off allowed of the sum of the absolute contributions to a quantity [-].
pub const DOUBLE: f64 = 1e-12;
/// The same where states are recorded in single precision [-].
pub const SINGLE: f64 = 1e-6;
/// Particles below which one thread recomputes a state.
const ALONE: usize = 1024;
/// Largest relative error of a number rounded to single precision [-].
const SINGLE_ROUNDING: f64 = 5.960_464_477_539_063e-8;

/// What states are recomputed with.
#[derive(Clone, Debug)]
pub struct Basis {
    /// The terms of the scene.
    pub model: Model,
    /// Radii, masses, charges.
    pub particles: Particles,
    /// What messages of the scene are like.
    pub shape: Shape,
    /// Whether states are recorded in single precision.
    pub single: bool,
}

/// A quantity, and the round-off that it may carry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rounded<T> {
    /// Its value.
    pub value: T,
    /// How far another way to compute it may be off.
    pub tolerance: f64,
}

/// Round-off allowed to the energies that a state holds [J].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tolerances {
    pub kinetic: f64,
    pub near_field: f64,
    pub binding: f64,
    pub external: f64,
    pub thermal: f64,
}

impl Tolerances {
    /// Of their sum [J].
    pub fn sum(&self) -> f64 {
        self.kinetic + self.near_field + self.binding + self.external + self.thermal
    }
}

/// Temperatures of a state [K].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Temperature {
    /// Mean over the particles.
    pub mean: f64,
    /// Coldest.
    pub min: f64,
    /// Hottest.
    pub max: f64,
}

/// What a recorded state says.
#[derive(Clone, Debug, Default)]
pub struct StateValues {
    /// Time [s].
    pub t: f64,
    /// Step number.
    pub step: u64,
    /// Energies that it holds; what accumulates is zero.
    pub held: Ledger,
    /// Round-off allowed to them.
    pub tolerances: Tolerances,
    /// Sum of m v [kg m/s].
    pub linear: Rounded<[f64; 3]>,
    /// Sum of r x m v [kg m^2/s].
    pub angular: Rounded<[f64; 3]>,
    /// Clusters, where the scene counts them.
    pub clusters: Option<Clusters>,
    /// Temperatures in numbers, where there are any.
    pub temperature: Option<Temperature>,
    /// Temperature of every particle, length n [K].
    pub temperatures: Vec<f64>,
}

impl Basis {
    /// Recomputes what a state of the right shape says.
    pub fn state(&self, frame: Frame) -> StateValues {
        let Frame { t, step, position, velocity, temperature, cluster } = frame;
        let n = self.particles.len();
        let state = State { position, velocity, temperature };
        let relative = if self.single { SINGLE } else { DOUBLE };
        let close = Close { particles: &self.particles, model: &self.model, position: &state.position };
        let held = || self.held(&state, relative);
        let clusters = || close.clusters(cluster.as_deref(), self.single.then_some(SINGLE_ROUNDING));
        // Small states come many at a time.
        let ((energies, tolerances), clusters) =
            if n < ALONE { (held(), clusters()) } else { rayon::join(held, clusters) };
        let (linear, angular) = momentum(&self.particles, &state);
        let sizes = self.momentum_sizes(&state);
        let temperatures = state.temperature.unwrap_or_default();
        StateValues {
            t,
            step,
            held: energies,
            tolerances,
            linear: Rounded { value: linear, tolerance: relative * sizes.0 },
            angular: Rounded { value: angular, tolerance: relative * sizes.1 },
            clusters,
            temperature: summary(&temperatures),
            temperatures,
        }
    }

    /// Energies that a state holds, and the round-off allowed to them.
    fn held(&self, state: &State, relative: f64) -> (Ledger, Tolerances) {
        let mut energies = held_by_particles(&self.model, &self.particles, state);
        let mut tolerances = Tolerances {
            kinetic: relative * energies.kinetic,
            external: relative * self.external_size(&state.position),
            thermal: relative * energies.thermal.abs(),
            ..Tolerances::default()
        };
        if let Some(field) = &self.model.field {
            let [near_field, binding, size] = field.energies_afresh(&state.position);
            (energies.near_field, energies.binding) = (near_field, binding);
            let moved = if self.single { moved_by_rounding(field, &state.position) } else { [0.0; 2] };
            tolerances.near_field = relative * size + moved[0];
            tolerances.binding = relative * size + moved[1];
        }
        (energies, tolerances)
    }

    /// Sum of |F_i| |r_i| over particles and directions [J].
    fn external_size(&self, r: &Columns) -> f64 {
        let Some(external) = &self.model.external else { return 0.0 };
        let axis = |axis: usize| -> f64 {
            r.axes()[axis].iter().enumerate().map(|(i, x)| (external.component(i, axis) * x).abs()).sum()
        };
        axis(0) + axis(1) + axis(2)
    }

    /// Sums of m |v| [kg m/s] and m |r| |v| [kg m^2/s].
    fn momentum_sizes(&self, state: &State) -> (f64, f64) {
        let (mut linear, mut angular) = (0.0, 0.0);
        for (i, mass) in self.particles.mass.iter().enumerate() {
            let size = mass * state.velocity.get(i).norm();
            linear += size;
            angular += size * state.position.get(i).norm();
        }
        (linear, angular)
    }
}

/// How much near-field and binding energy can change where every coordinate is rounded to single precision: to first
/// order |F| times the rounding, doubled for what is beyond it [J].
fn moved_by_rounding(field: &Field, r: &Columns) -> [f64; 2] {
    let forces = |field: &Field| {
        let (mut field, mut force) = (field.clone(), Columns::zeros(r.len()));
        field.add_forces(r, &mut force);
        force
    };
    let mut near_field = field.clone();
    near_field.binding = None;
    let (all, near) = (forces(field), forces(&near_field));
    let mut moved = [0.0; 2];
    for ((all, near), r) in all.axes().into_iter().zip(near.axes()).zip(r.axes()) {
        for ((all, near), x) in all.iter().zip(near).zip(r) {
            let by = 2.0 * SINGLE_ROUNDING * x.abs();
            moved[0] += near.abs() * by;
            moved[1] += (all - near).abs() * by;
        }
    }
    moved
}

/// Mean, least and greatest of some temperatures; `None` of none.
fn summary(theta: &[f64]) -> Option<Temperature> {
    if theta.is_empty() {
        return None;
    }
    let mean = theta.iter().copied().collect::<Sum>().value() / theta.len() as f64;
    // A value that is no number must not be hidden by those that are.
    let extreme = |pick: fn(f64, f64) -> f64, from: f64| {
        theta.iter().copied().fold(from, |a, b| if a.is_nan() || b.is_nan() { f64::NAN } else { pick(a, b) })
    };
    Some(Temperature { mean, min: extreme(f64::min, f64::INFINITY), max: extreme(f64::max, f64::NEG_INFINITY) })
}
