//! From a scene to the terms it names; the only place that looks at which sections are there.
//!
//! What a scene does not name is `None` here and costs nothing: no column, no pass over the particles.

use crate::contact::ContactLaw;
use crate::contact::search::{Search, TOUCHING};
use crate::convergence::Convergence;
use crate::domain::Domain;
use crate::force::{ExternalField, Field};
use crate::integrator::Integrator;
use crate::scene::{Cutoff, IntegratorKind, ModelKind, Scene, SolutionMethod, Weight};
use crate::state::{Columns, Particles};
use crate::step_control::iteration_tolerance;
use crate::thermal::exchange::Exchange;

/// The terms of a scene.
#[derive(Clone, Debug)]
pub struct Model {
    /// Which of the two named models.
    pub kind: ModelKind,
    /// Time integrator.
    pub integrator: Integrator,
    /// How the equations of a step are solved.
    pub method: SolutionMethod,
    /// Pair forces.
    pub field: Option<Field>,
    /// Gravity and electric field.
    pub external: Option<ExternalField>,
    /// Impacts.
    pub contact: Option<ContactLaw>,
    /// Convection and radiation.
    pub exchange: Option<Exchange>,
    /// Heat capacity [J/(kg K)], where there are temperatures.
    pub heat_capacity: Option<f64>,
    /// Periodic directions and walls.
    pub domain: Domain,
    /// Finds close pairs, where something asks for them.
    pub search: Option<Search>,
    /// Pairs within this many sums of radii are bonded [-]; `None` without binding.
    pub bond_range: Option<f64>,
    /// Pairs within this many sums of radii belong to one cluster [-].
    pub cluster_range: Option<f64>,
    /// How far located impacts are looked ahead in one step [m]; `None` where there are none.
    pub flight: Option<f64>,
    uses_charges: bool,
    /// Mean diameter [m].
    pub mean_diameter: f64,
    /// Smallest diameter [m].
    pub smallest_diameter: f64,
}

impl Model {
    /// Assembles the terms of a scene for particles that start at `start`.
    #[must_use]
    pub fn new(scene: &Scene, particles: &Particles, start: &Columns) -> Self {
        let domain = Domain::new(scene.domain.as_ref());
        let contact = ContactLaw::new(scene);
        let located = contact.as_ref().is_some_and(|law| law.located);
        let bond_range = scene.binding.as_ref().map(|binding| binding.range);
        let cluster_range = bond_range.or(scene.clusters.map(|clusters| clusters.range));
        let touching = (contact.is_some() && !located).then_some(1.0 + TOUCHING);
        let factor = touching.into_iter().chain(cluster_range).reduce(f64::max);
        Self {
            kind: scene.model,
            integrator: Integrator::of(integrator(scene)),
            method: scene.solver.method,
            field: Field::new(scene, particles, start, &domain.periodic),
            external: ExternalField::new(scene.external.as_ref(), particles),
            contact,
            exchange: Exchange::new(scene, particles),
            heat_capacity: scene.thermal.as_ref().map(|thermal| thermal.heat_capacity),
            search: factor.map(|factor| Search::new(factor, particles, start, &domain)),
            flight: located.then(|| flight(particles, start, &domain)),
            domain,
            bond_range,
            cluster_range,
            uses_charges: uses_charges(scene),
            mean_diameter: particles.mean_diameter(),
            smallest_diameter: particles.radius.iter().fold(f64::INFINITY, |least, b| least.min(2.0 * b)),
        }
    }

    /// Whether anything accelerates particles between impacts.
    #[must_use]
    pub fn has_forces(&self) -> bool {
        self.field.is_some() || self.external.is_some()
    }

    /// Forces of the field and from outside at positions r [N]; returns the unordered pairs looked at.
    pub fn forces(&mut self, r: &Columns, force: &mut Columns) -> u64 {
        for axis in force.axes_mut() {
            axis.fill(0.0);
        }
        let pairs = self.field.as_mut().map_or(0, |field| field.add_forces(r, force));
        if let Some(external) = &self.external {
            external.add_forces(force);
        }
        pairs
    }

    /// Whether any force depends on charges.
    #[must_use]
    pub fn uses_charges(&self) -> bool {
        self.uses_charges
    }

    /// The error measure of the model: (52) in `paper`, largest move over the mean diameter in `consistent`.
    #[must_use]
    pub fn convergence(&self, scene: &Scene) -> Convergence {
        let tolerance = iteration_tolerance(scene, self.integrator.order);
        Convergence::new(self.kind, tolerance, scene.solver.max_iterations, self.mean_diameter)
    }
}

/// Half the spacing of the particles at the start, or a mean diameter where that is more [m]: farther flights meet more
/// candidates, shorter ones look for them more often. In a periodic box no pair may meet across both ends of it.
fn flight(particles: &Particles, start: &Columns, domain: &Domain) -> f64 {
    let largest = 2.0 * particles.radius.iter().copied().fold(0.0, f64::max);
    let extent = |axis: usize| {
        let column = start.axes()[axis];
        let (low, high) = column.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
        let length = domain.periodic.length[axis];
        if length > 0.0 { length } else { (high - low).max(largest) }
    };
    let volume: f64 = (0..3).map(extent).product();
    let spacing = libm::cbrt(volume / particles.len() as f64);
    let free = particles.mean_diameter().max(0.5 * spacing);
    let boxes = domain.periodic.length.iter().filter(|&&length| length > 0.0);
    boxes.fold(free, |free, length| free.min((0.25 * length - 0.5 * largest).max(0.05 * largest)))
}

/// Largest step of schemes of high order where the scene gives none [s]: they could take longer ones, but somebody will want
/// to look at the motion.
const HIGH_ORDER_MAX: f64 = 5e-2;

/// The scene's integrator. Where it names none: the paper's own in `paper`; Gauss-Legendre collocation where forces are
/// smooth, because it is the cheapest there at any error below a thousandth of a diameter (`docs/accuracy.md`); else velocity
/// Verlet, because high order is lost at impacts and jumps of a force, and nothing is cheaper where there is no force.
#[must_use]
pub fn integrator(scene: &Scene) -> IntegratorKind {
    scene.solver.integrator.unwrap_or(match scene.model {
        ModelKind::Paper => IntegratorKind::BackwardEuler,
        ModelKind::Consistent if is_smooth(scene) => IntegratorKind::GaussLegendre,
        ModelKind::Consistent => IntegratorKind::VelocityVerlet,
    })
}

/// Whether impacts and jumps of forces are located within steps where the scene does not say: in `consistent`, by the schemes
/// of first and second order. Steps of collocation schemes end at them.
#[must_use]
pub fn locates(scene: &Scene) -> bool {
    scene.model == ModelKind::Consistent && Integrator::of(integrator(scene)).collocation.is_none()
}

/// Whether there is a near field that keeps particles apart, and nothing in the scene ever jumps: no impact, no cut-off, no
/// bond, no box to wrap into.
fn is_smooth(scene: &Scene) -> bool {
    let apart = scene.near_field.as_ref().is_some_and(|near| {
        let repelled = near.repulsion.as_ref().map_or(-1.0, |term| term.exponent);
        let attracted = near.attraction.as_ref().map_or(-1.0, |term| term.exponent);
        near.cutoff == Cutoff::default() && repelled > attracted && near.weight != Weight::ChargeProduct
    });
    apart && scene.contact.is_none() && scene.binding.is_none() && scene.domain.is_none()
}

/// The first, the largest and the smallest step of a scene [s], defaults filled in.
#[must_use]
pub fn step_limits(scene: &Scene) -> (f64, f64, f64) {
    let step = &scene.solver.step;
    let (initial, max, min) = step.limits();
    let high = Integrator::of(integrator(scene)).collocation.is_some();
    let free = step.fixed.is_none() && step.max.is_none();
    (initial, if high && free { max.max(HIGH_ORDER_MAX) } else { max }, min)
}

/// Whether the scene names a force that depends on charges.
fn uses_charges(scene: &Scene) -> bool {
    let near = scene.near_field.as_ref();
    let terms = near.into_iter().flat_map(|near| [&near.attraction, &near.repulsion]).flatten();
    let weights = terms
        .filter_map(|term| term.weight)
        .chain(near.map(|near| near.weight))
        .chain(scene.binding.as_ref().and_then(|binding| binding.weight));
    let field = scene.external.as_ref().and_then(|external| external.electric_field);
    field.is_some() || weights.into_iter().any(|weight| weight == Weight::ChargeProduct)
}
