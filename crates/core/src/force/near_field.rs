//! Near field (2) and binding (13) as terms of the pair loop, with cut-off, switch and shifted potentials.
//!
//! Force on i along n_ij: sum over terms of c w_ij s^-beta, c > 0 attracting; s distance [m], w_ij = w_i w_j the pair
//! weight (m_i m_j, charges, or 1). Valid for s > 0. Potentials are shifted to zero at the cut-off and at activation,
//! so that energy is continuous there. Reference: Zohdi 2004, section 2.

use super::all_pairs::AllPairs;
use super::composition::{Composition, Ordered};
use super::far::Far;
use super::listed::Listed;
use super::power::Power;
use crate::domain::Periodic;
use crate::frame;
use crate::neighbor::Neighbors;
use crate::scene::{self, ModelKind, Scene, Weight};
use crate::simd::{Arithmetic, Lanes};
use crate::state::{Columns, Particles};

/// One power-law term of the near field.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// The power law.
    pub power: Power,
    /// Signed strength c: positive attracts [N m^beta per unit of weight].
    pub strength: f64,
    /// Potential at the cut-off per unit of strength, P(beta); 0 without a cut-off.
    pub shift: f64,
}

/// Terms that share a pair weight.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Group {
    /// Weight w_i of every particle, length n; `None`: the same for all, which is in the strengths.
    pub(crate) weight: Option<Vec<f64>>,
    pub(crate) kind: Weighting,
    pub(crate) terms: Vec<Term>,
}

/// What a group's column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Weighting {
    One,
    Mass,
    Charge,
    ChargeSize,
}

impl Weighting {
    fn column(self, particles: &Particles) -> Option<Vec<f64>> {
        let charges = || particles.charge.clone().unwrap_or_else(|| vec![0.0; particles.len()]);
        match self {
            Self::One => None,
            Self::Mass => Some(particles.mass.clone()),
            Self::Charge => Some(charges()),
            Self::ChargeSize => Some(charges().into_iter().map(f64::abs).collect()),
        }
    }
}

/// The binding term (13): attracts while s <= range (b_i + b_j).
#[derive(Clone, Debug, PartialEq)]
pub struct BindingTerm {
    /// The power law.
    pub power: Power,
    /// Strength alpha_a [N m^beta per unit of weight].
    pub strength: f64,
    /// Activation distance over the sum of the radii, delta_a [-].
    pub range: f64,
    /// Weight w_i of every particle, length n; `None`: the same for all, which is in the strength.
    pub(crate) weight: Option<Vec<f64>>,
    /// Radii, length n [m]; `None`: all the same.
    pub(crate) radius: Option<Vec<f64>>,
    /// The largest radius [m].
    pub(crate) largest: f64,
}

impl BindingTerm {
    /// The largest activation distance [m].
    #[must_use]
    pub fn largest_reach(&self) -> f64 {
        self.range * (self.largest + self.largest)
    }
}

/// The C2 quintic that takes a potential to zero between two distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switch {
    /// Where it starts to fall from 1 [m].
    pub from: f64,
    /// Where it reaches 0 [m].
    pub to: f64,
}

impl Switch {
    /// Value and slope at a distance [-, 1/m].
    #[inline(always)]
    #[must_use]
    pub fn at(&self, s: f64) -> (f64, f64) {
        let width = self.to - self.from;
        let x = (s - self.from) / width;
        let x = if x > 0.0 { x } else { 0.0 };
        let x = if x < 1.0 { x } else { 1.0 };
        let rest = 1.0 - x;
        (1.0 - x * x * x * (10.0 + x * (6.0 * x - 15.0)), -30.0 * x * x * rest * rest / width)
    }

    /// The same for eight distances.
    #[inline(always)]
    pub(crate) fn lanes<S: Arithmetic>(&self, simd: S, s: S::F) -> (S::F, S::F) {
        let splat = |x: f64| simd.splat(x);
        let width = splat(self.to - self.from);
        let x = ((s - splat(self.from)) / width).max(splat(0.0)).min(splat(1.0));
        let (cube, rest) = (x * x * x, splat(1.0) - x);
        let value = splat(1.0) - cube * (splat(10.0) + x * (splat(6.0) * x - splat(15.0)));
        (value, splat(-30.0) * x * x * rest * rest / width)
    }
}

/// All pair forces of a scene.
#[derive(Clone, Debug)]
pub struct Field {
    pub(crate) groups: Vec<Group>,
    /// Distance beyond which the near field is zero [m]; `f64::MAX` without a cut-off.
    pub cutoff: f64,
    /// Smooth end of the near field.
    pub switch: Option<Switch>,
    /// Binding.
    pub binding: Option<BindingTerm>,
    pub(crate) periodic: Periodic,
    /// Candidate pairs.
    pub neighbors: Neighbors,
    /// Whether crossings of jumps are events.
    pub located: bool,
    pub(crate) composition: Composition,
    work: Work,
}

/// Space of the pair loops, whichever is used.
#[derive(Clone, Debug)]
enum Work {
    AllPairs(AllPairs),
    Listed(Listed),
    Far(Box<Far>),
}

/// A column, or the number that all its values are.
fn uniform(column: Option<Vec<f64>>) -> (Option<Vec<f64>>, f64) {
    match column {
        Some(column) if column.iter().all(|x| *x == column[0]) => (None, column.first().copied().unwrap_or(1.0)),
        Some(column) => (Some(column), 1.0),
        None => (None, 1.0),
    }
}

impl Field {
    /// The pair forces that a scene names; `None` where it names none.
    #[must_use]
    pub fn new(scene: &Scene, particles: &Particles, start: &Columns, periodic: &Periodic) -> Option<Self> {
        if scene.near_field.is_none() && scene.binding.is_none() {
            return None;
        }
        let cutoff = scene.near_field.as_ref().and_then(scene::NearField::cutoff_distance).unwrap_or(f64::MAX);
        let mut groups: Vec<Group> = Vec::new();
        if let Some(near) = &scene.near_field {
            let sign_and_terms = [(1.0, near.attraction.as_ref()), (-1.0, near.repulsion.as_ref())];
            for (sign, term) in sign_and_terms.into_iter().filter_map(|(sign, term)| Some((sign, term?))) {
                let weight = term.weight.unwrap_or(near.weight);
                let (kind, sign) = match weight {
                    Weight::None => (Weighting::One, sign),
                    Weight::MassProduct => (Weighting::Mass, sign),
                    // Attraction carries -q_i q_j, repulsion |q_i q_j|.
                    Weight::ChargeProduct if sign > 0.0 => (Weighting::Charge, -1.0),
                    Weight::ChargeProduct => (Weighting::ChargeSize, sign),
                };
                let power = Power::new(term.exponent);
                let shift = if cutoff < f64::MAX { power.potential_at(cutoff) } else { 0.0 };
                let term = Term { power, strength: sign * term.strength, shift };
                match groups.iter_mut().find(|group| group.kind == kind) {
                    Some(group) => group.terms.push(term),
                    None => groups.push(Group { weight: kind.column(particles), kind, terms: vec![term] }),
                }
            }
        }
        for group in &mut groups {
            let (weight, all) = uniform(group.weight.take());
            group.weight = weight;
            group.terms.iter_mut().for_each(|term| term.strength *= all * all);
        }
        let switch =
            scene.near_field.as_ref().and_then(|near| near.switch_from).map(|from| Switch { from, to: cutoff });
        let binding = scene.binding.as_ref().map(|binding| {
            let default = scene.near_field.as_ref().map_or(Weight::None, |near| near.weight);
            let weighting = match binding.weight.unwrap_or(default) {
                Weight::None => Weighting::One,
                Weight::MassProduct => Weighting::Mass,
                Weight::ChargeProduct => Weighting::ChargeSize,
            };
            let (weight, all) = uniform(weighting.column(particles));
            BindingTerm {
                power: Power::new(binding.exponent),
                strength: binding.strength * (all * all),
                range: binding.range,
                weight,
                radius: uniform(Some(particles.radius.clone())).0,
                largest: particles.radius.iter().copied().fold(0.0, f64::max),
            }
        });
        let located = scene.model == ModelKind::Consistent && scene.solver.crossings != Some(scene::Crossings::Ignored);
        let composition = Composition::of(&groups, switch);
        let (neighbors, work) = (Neighbors::All, Work::Listed(Listed::default()));
        let mut field =
            Self { groups, cutoff, switch, binding, periodic: *periodic, neighbors, located, composition, work };
        let accuracy = scene.near_field.as_ref().and_then(|near| near.accuracy).filter(|_| field.cutoff == f64::MAX);
        if let Some(far) = accuracy.and_then(|accuracy| Far::new(&field, start, accuracy)) {
            // Lists are for bonds that form and break; forces have the tree.
            let reach = field.binding.as_ref().map(BindingTerm::largest_reach);
            field.neighbors = reach.map_or(Neighbors::All, |reach| Neighbors::choose(reach, start, periodic));
            field.work = Work::Far(Box::new(far));
            return Some(field);
        }
        field.neighbors = Neighbors::choose(field.reach(), start, periodic);
        if let Neighbors::All = field.neighbors {
            let (groups, binding) = (&field.groups, field.binding.as_ref());
            // The paper's scheme depends on numbers and places anyway; its tables stay as they are.
            let order = match scene.model {
                ModelKind::Paper => (0..particles.len() as u32).collect(),
                ModelKind::Consistent => frame::order(particles, start),
            };
            let sorted = |column: &[f64]| order.iter().map(|&i| column[i as usize]).collect();
            let ordered = Ordered::new(groups, binding, sorted);
            field.work = Work::AllPairs(AllPairs::new(order, ordered));
        }
        Some(field)
    }

    /// Distance beyond which no two particles interact [m]; infinite without a cut-off.
    #[must_use]
    pub fn reach(&self) -> f64 {
        let binding_reach = self.binding.as_ref().map_or(0.0, BindingTerm::largest_reach);
        let near_reach = match (self.groups.is_empty(), self.cutoff < f64::MAX) {
            (true, _) => 0.0,
            (false, true) => self.cutoff,
            (false, false) => f64::INFINITY,
        };
        near_reach.max(binding_reach)
    }

    /// Whether any force jumps at a distance.
    #[must_use]
    pub fn jumps(&self) -> bool {
        self.located && (self.jumping_cutoff().is_some() || self.binding.is_some())
    }

    /// The cut-off, where the near field jumps there [m].
    #[must_use]
    pub fn jumping_cutoff(&self) -> Option<f64> {
        (!self.groups.is_empty() && self.cutoff < f64::MAX && self.switch.is_none()).then_some(self.cutoff)
    }

    /// Near-field force of a pair at distance s, without cut-off and switch [N]; positive attracts.
    #[must_use]
    pub fn near_force(&self, i: usize, j: usize, s: f64) -> f64 {
        let group = |group: &Group| {
            let weight = group.weight.as_ref().map_or(1.0, |weight| weight[i] * weight[j]);
            weight * group.terms.iter().map(|term| term.strength * term.power.at(s)).sum::<f64>()
        };
        self.groups.iter().map(group).sum()
    }

    /// Activation distance of a pair [m]; `None` without binding.
    #[must_use]
    pub fn activation(&self, i: usize, j: usize) -> Option<f64> {
        let binding = self.binding.as_ref()?;
        let radius = |k: usize| binding.radius.as_ref().map_or(binding.largest, |radius| radius[k]);
        Some(binding.range * (radius(i) + radius(j)))
    }

    /// Binding force of a bonded pair at distance s [N].
    #[must_use]
    pub fn binding_force(&self, i: usize, j: usize, s: f64) -> f64 {
        self.binding.as_ref().map_or(0.0, |binding| {
            let weight = binding.weight.as_ref().map_or(1.0, |weight| weight[i] * weight[j]);
            weight * binding.strength * binding.power.at(s)
        })
    }

    /// The field of the same particles in another order, without lists.
    pub(crate) fn sorted(&self, sorted: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        let column = |column: &Option<Vec<f64>>| column.as_deref().map(&sorted);
        let group =
            |group: &Group| Group { weight: column(&group.weight), kind: group.kind, terms: group.terms.clone() };
        let binding = self.binding.as_ref().map(|binding| BindingTerm {
            weight: column(&binding.weight),
            radius: column(&binding.radius),
            ..binding.clone()
        });
        Self {
            groups: self.groups.iter().map(group).collect(),
            binding,
            neighbors: Neighbors::All,
            work: Work::Listed(Listed::default()),
            ..*self
        }
    }

    /// A near field of other numbers with the same binding, without lists.
    pub(crate) fn in_units(&self, groups: Vec<Group>, composition: Composition) -> Self {
        Self {
            groups,
            composition,
            binding: self.binding.clone(),
            neighbors: Neighbors::All,
            work: Work::Listed(Listed::default()),
            ..*self
        }
    }

    /// Adds the pair forces at positions r, length n [m], to `force` [N]. Returns the number of unordered pairs looked
    /// at.
    pub fn add_forces(&mut self, r: &Columns, force: &mut Columns) -> u64 {
        self.neighbors.update(r, &self.periodic);
        // Taken out, so that the loop may look at the field while it writes to its space.
        let mut work = std::mem::replace(&mut self.work, Work::Listed(Listed::default()));
        let mut met = None;
        match (&mut work, &self.neighbors) {
            (Work::Far(work), _) => met = Some(work.forces(self, r, force)),
            (Work::AllPairs(work), _) => work.forces(self, r, force),
            (Work::Listed(work), Neighbors::List(list)) => work.forces(self, list, r, force),
            // Only a field that `sorted` made; it serves energies.
            (Work::Listed(_), Neighbors::All) => {}
        }
        self.work = work;
        met.unwrap_or_else(|| self.neighbors.pairs(r.len()))
    }

    /// Near-field and binding potential energy at positions r, length n [m], in joules.
    ///
    /// Leaves the lists alone: taking a sample must not change the run.
    #[must_use]
    pub fn energies(&self, r: &Columns) -> (f64, f64) {
        let [near_field, binding, _] = if let Work::Far(far) = &self.work {
            far.energies(self, r)
        } else if self.neighbors.valid(r, &self.periodic) {
            super::energies::energies(self, &self.neighbors, r)
        } else {
            let mut neighbors = self.neighbors.clone();
            neighbors.update(r, &self.periodic);
            super::energies::energies(self, &neighbors, r)
        };
        (near_field, binding)
    }

    /// As [`Field::energies`], from the positions alone: whatever states came before, the same to the last bit. Also the
    /// sum of the absolute energies of all pairs or less, against which round-off is to be judged [J].
    #[must_use]
    pub fn energies_afresh(&self, r: &Columns) -> [f64; 3] {
        match &self.work {
            Work::Far(far) => far.energies(self, r),
            _ => super::energies::energies_by_cells(self, r),
        }
    }

    /// Order of the expansions by which distant particles meet; `None` where all meet as pairs.
    #[must_use]
    pub fn far_order(&self) -> Option<usize> {
        match &self.work {
            Work::Far(far) => Some(far.order()),
            _ => None,
        }
    }

    /// Builds the lists as they were at these positions (of a checkpoint) [m].
    pub fn rebuild_lists(&mut self, at: &Columns) {
        if let Neighbors::List(list) = &mut self.neighbors {
            list.build(at, &self.periodic);
        }
    }
}
