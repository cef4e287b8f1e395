//! What can be said about a scene before it is solved: equilibrium distances, natural periods, a step to begin with.
//!
//! Force on i along n_ij: F(s) = alpha1 s^-beta1 - alpha2 s^-beta2 (+ alpha_a s^-beta_a while bonded), equations (2) and
//! (13). Equilibrium d_e, equation (8); inflection d*, equation (12); bonded equilibrium d_a, equation (15), in closed
//! form for beta_a = beta1 and numerically otherwise. The distance of a pair obeys m_eff s'' = -F(s), so an equilibrium
//! is stable where k = dF/ds > 0 and small vibrations about it have the period 2 pi sqrt(m_eff/k).
//!
//! Valid for an isolated pair, outside the switching range of `switch_from`. s in m, F in N, k in N/m.

use crate::scene::{Cutoff, NamedCutoff, Scene, Weight};
use crate::state::Particles;

mod suggest;

pub use suggest::{StepLimit, SuggestedStep, suggest_step};

/// Kinds of particles of which all pairs are examined; above, only the extreme ones are.
const MAX_KINDS: usize = 64;

/// One signed power law, coefficient * s^-exponent; positive attracts.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Power {
    coefficient: f64,
    exponent: f64,
}

impl Power {
    fn at(self, s: f64) -> f64 {
        if self.coefficient == 0.0 { 0.0 } else { self.coefficient * libm::pow(s, -self.exponent) }
    }

    fn slope(self, s: f64) -> f64 {
        if self.coefficient == 0.0 { 0.0 } else { -self.exponent * self.at(s) / s }
    }
}

/// The near field and binding of one pair, weights included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairLaw {
    attraction: Power,
    repulsion: Power,
    binding: Option<Power>,
    /// Sum of the radii b_i + b_j [m].
    pub touching: f64,
    /// Activation distance of binding, delta_a (b_i + b_j) [m].
    pub activation: Option<f64>,
    /// Reduced mass m_eff = m_i m_j/(m_i + m_j) [kg].
    pub reduced_mass: f64,
}

impl PairLaw {
    /// The law of particles i and j. Missing charges count as zero.
    #[must_use]
    pub fn new(scene: &Scene, particles: &Particles, i: usize, j: usize) -> Self {
        let (mi, mj) = (particles.mass[i], particles.mass[j]);
        let charges = particles.charge.as_ref().map_or(0.0, |q| q[i] * q[j]);
        let weigh = |weight: Weight, charged: f64| match weight {
            Weight::None => 1.0,
            Weight::MassProduct => mi * mj,
            Weight::ChargeProduct => charged,
        };
        let none = Power { coefficient: 0.0, exponent: 0.0 };
        let field = scene.near_field.as_ref();
        let common = field.map_or(Weight::None, |field| field.weight);
        let attraction = field.and_then(|field| field.attraction.as_ref()).map_or(none, |term| Power {
            coefficient: term.strength * weigh(term.weight.unwrap_or(common), -charges),
            exponent: term.exponent,
        });
        let repulsion = field.and_then(|field| field.repulsion.as_ref()).map_or(none, |term| Power {
            coefficient: -term.strength * weigh(term.weight.unwrap_or(common), charges.abs()),
            exponent: term.exponent,
        });
        let touching = particles.radius[i] + particles.radius[j];
        let binding = scene.binding.as_ref().map(|term| Power {
            coefficient: term.strength * weigh(term.weight.unwrap_or(common), charges.abs()),
            exponent: term.exponent,
        });
        let activation = scene.binding.as_ref().map(|term| term.range * touching);
        Self { attraction, repulsion, binding, touching, activation, reduced_mass: mi * mj / (mi + mj) }
    }

    fn terms(&self, bonded: bool) -> [Power; 3] {
        let none = Power { coefficient: 0.0, exponent: 0.0 };
        [self.attraction, self.repulsion, if bonded { self.binding.unwrap_or(none) } else { none }]
    }

    /// Force on i along n_ij at distance `s` [N], positive for attraction; with binding if `bonded`. Cut-off and
    /// activation are not applied.
    #[must_use]
    pub fn force(&self, s: f64, bonded: bool) -> f64 {
        self.terms(bonded).iter().map(|term| term.at(s)).sum()
    }

    /// Its derivative dF/ds [N/m].
    #[must_use]
    pub fn stiffness(&self, s: f64, bonded: bool) -> f64 {
        self.terms(bonded).iter().map(|term| term.slope(s)).sum()
    }

    /// Equilibrium: d_e, equation (8), or d_a, equation (15), if `bonded`. `None` where the force has no zero.
    #[must_use]
    pub fn equilibrium(&self, bonded: bool) -> Option<Equilibrium> {
        let [attraction, repulsion, binding] = self.terms(bonded);
        let one_exponent = binding.coefficient == 0.0
            || attraction.coefficient == 0.0
            || binding.exponent.to_bits() == attraction.exponent.to_bits();
        let distance = if one_exponent {
            let exponent = if attraction.coefficient == 0.0 { binding.exponent } else { attraction.exponent };
            let ratio = -repulsion.coefficient / (attraction.coefficient + binding.coefficient);
            root(ratio, repulsion.exponent - exponent)?
        } else {
            self.bonded_root()?
        };
        let stiffness = self.stiffness(distance, bonded);
        let stable = stiffness > 0.0;
        let period = stable.then(|| 2.0 * std::f64::consts::PI * (self.reduced_mass / stiffness).sqrt());
        Some(Equilibrium { distance, stable, stiffness, period })
    }

    /// The outermost distance at which the bonded force turns from repulsion below to attraction above, by bisection.
    fn bonded_root(&self) -> Option<f64> {
        // Twelve decades about contact in steps of a fiftieth of one: two zeros closer than that are of no use to a pair.
        const PER_DECADE: i32 = 50;
        let at = |k: i32| self.touching * libm::pow(10.0, f64::from(k) / f64::from(PER_DECADE));
        let attracts = |s: f64| self.force(s, true) > 0.0;
        let outermost = (-6 * PER_DECADE..6 * PER_DECADE).rev().find(|&k| !attracts(at(k)) && attracts(at(k + 1)))?;
        let (mut low, mut high) = (at(outermost), at(outermost + 1));
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return Some(high);
            }
            if attracts(middle) { high = middle } else { low = middle }
        }
    }

    /// Inflection of the potential d*, equation (12), where the attraction is largest [m]. `None` where there is none.
    #[must_use]
    pub fn inflection(&self) -> Option<f64> {
        let (a, r) = (self.attraction, self.repulsion);
        let ratio = -r.exponent * r.coefficient / (a.exponent * a.coefficient);
        if a.coefficient > 0.0 { root(ratio, r.exponent - a.exponent) } else { None }
    }
}

/// The positive x with x^degree = ratio, where it is a number; equal exponents (degree 0) have none.
fn root(ratio: f64, degree: f64) -> Option<f64> {
    let x = libm::pow(ratio, 1.0 / degree);
    (degree != 0.0 && x > 0.0 && x.is_finite()).then_some(x)
}

/// A distance at which a pair feels no force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equilibrium {
    /// Distance of the centres [m].
    pub distance: f64,
    /// Whether a displaced pair returns to it; for equation (8) iff beta2 > beta1.
    pub stable: bool,
    /// dF/ds there [N/m].
    pub stiffness: f64,
    /// Period of small vibrations [s]; `None` where it is unstable.
    pub period: Option<f64>,
}

/// What a pair does on its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairCharacteristics {
    /// The pair, by its particles.
    pub pair: (usize, usize),
    /// Its law.
    pub law: PairLaw,
    /// d_e, equation (8).
    pub equilibrium: Option<Equilibrium>,
    /// d*, equation (12) [m].
    pub inflection: Option<f64>,
    /// d_a, equation (15); `None` without binding.
    pub bonded: Option<Equilibrium>,
}

/// Every kind of pair in a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Survey {
    /// One pair of every kind; empty where a scene has neither near field nor binding, or a single particle.
    pub pairs: Vec<PairCharacteristics>,
    /// Kinds of particles: distinct radius, mass and charge.
    pub kinds: usize,
    /// Whether `pairs` holds every kind of pair; otherwise those of the extreme particles only.
    pub complete: bool,
}

impl Survey {
    /// Shortest natural period [s] and whether it is a bonded pair's.
    #[must_use]
    pub fn shortest_period(&self) -> Option<(f64, bool)> {
        let free = self.pairs.iter().filter_map(|p| p.equilibrium?.period).map(|t| (t, false));
        let bonded = self.pairs.iter().filter_map(|p| p.bonded?.period).map(|t| (t, true));
        free.chain(bonded).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Sentences on pairs that will not do what their equilibrium promises, each once with an example.
    #[must_use]
    pub fn warnings(&self, scene: &Scene) -> Vec<String> {
        let mut warnings = Vec::new();
        let mut first = |wrong: &dyn Fn(&PairCharacteristics) -> Option<String>| {
            if let Some((pair, text)) = self.pairs.iter().find_map(|p| Some((p.pair, wrong(p)?))) {
                warnings.push(format!("particles {} and {}: {text}", pair.0, pair.1));
            }
        };
        let field = scene.near_field.as_ref();
        first(&|p| {
            let d = p.equilibrium.filter(|e| !e.stable)?.distance;
            Some(format!("the equilibrium d_e = {d} m is unstable, because beta2 <= beta1; choose beta2 > beta1"))
        });
        first(&|p| {
            let (d, touching) = (p.equilibrium?.distance, p.law.touching);
            (d < touching)
                .then(|| format!("d_e = {d} m is less than b_i + b_j = {touching} m, so the pair rests in contact"))
        });
        first(&|p| {
            let (d, touching) = (p.bonded?.distance, p.law.touching);
            (d < touching).then(|| {
                format!(
                    "d_a = {d} m is less than b_i + b_j = {touching} m, so a bonded pair rests in contact; weaken the \
                     binding or strengthen the repulsion for bonds that vibrate freely"
                )
            })
        });
        first(&|p| {
            let (d, activation) = (p.bonded?.distance, p.law.activation?);
            (d > activation).then(|| {
                format!(
                    "d_a = {d} m lies beyond the activation distance {activation} m, so the repulsion pushes bonded \
                     pairs apart; strengthen the binding"
                )
            })
        });
        first(&|p| {
            let (d, cutoff) = (p.equilibrium?.distance, cutoff_of(scene, &p.law)?);
            (d > cutoff).then(|| format!("d_e = {d} m lies beyond the cut-off {cutoff} m, so it is never reached"))
        });
        first(&|p| {
            let (d, from) = (p.equilibrium?.distance, field?.switch_from?);
            let cutoff = cutoff_of(scene, &p.law)?;
            (d > from && d <= cutoff)
                .then(|| format!("d_e = {d} m lies where the potential is switched off (from {from} m) and will move"))
        });
        warnings
    }
}

/// Cut-off of a pair [m]; `None` where there is none.
#[must_use]
pub fn cutoff_of(scene: &Scene, law: &PairLaw) -> Option<f64> {
    match scene.near_field.as_ref()?.cutoff {
        Cutoff::Named(NamedCutoff::None) => None,
        Cutoff::Named(NamedCutoff::Inflection) => law.inflection(),
        Cutoff::Distance(distance) => Some(distance),
    }
}

/// Looks at one pair of every kind.
#[must_use]
pub fn survey(scene: &Scene, particles: &Particles) -> Survey {
    let kinds = kinds(particles);
    let complete = kinds.len() <= MAX_KINDS;
    let count = kinds.len();
    if particles.len() < 2 || (scene.near_field.is_none() && scene.binding.is_none()) {
        return Survey { pairs: Vec::new(), kinds: count, complete: true };
    }
    let chosen = if complete { kinds } else { extremes(particles, kinds) };
    let mut pairs = Vec::new();
    for (k, first) in chosen.iter().enumerate() {
        let partners = chosen[k + 1..].iter().map(|other| (first.0, other.0));
        for (i, j) in first.1.map(|twin| (first.0, twin)).into_iter().chain(partners) {
            let law = PairLaw::new(scene, particles, i, j);
            pairs.push(PairCharacteristics {
                pair: (i, j),
                law,
                equilibrium: law.equilibrium(false),
                inflection: law.inflection(),
                bonded: law.binding.and_then(|_| law.equilibrium(true)),
            });
        }
    }
    Survey { pairs, kinds: count, complete }
}

/// First and, if there is one, second particle of every kind, in the order of the first ones.
fn kinds(particles: &Particles) -> Vec<(usize, Option<usize>)> {
    let key = |i: usize| {
        let charge = particles.charge.as_ref().map_or(0.0, |q| q[i]);
        [particles.radius[i], particles.mass[i], charge].map(f64::to_bits)
    };
    let mut seen = std::collections::BTreeMap::<[u64; 3], (usize, Option<usize>)>::new();
    for i in 0..particles.len() {
        seen.entry(key(i)).and_modify(|kind| _ = kind.1.get_or_insert(i)).or_insert((i, None));
    }
    let mut kinds: Vec<_> = seen.into_values().collect();
    kinds.sort_unstable();
    kinds
}

/// Those kinds with the least and the most of radius, mass and charge.
fn extremes(particles: &Particles, kinds: Vec<(usize, Option<usize>)>) -> Vec<(usize, Option<usize>)> {
    let columns = [Some(&particles.radius), Some(&particles.mass), particles.charge.as_ref()];
    let mut chosen = std::collections::BTreeSet::new();
    for column in columns.into_iter().flatten() {
        let by_value = |a: &&(usize, Option<usize>), b: &&(usize, Option<usize>)| column[a.0].total_cmp(&column[b.0]);
        chosen.extend(kinds.iter().min_by(by_value));
        chosen.extend(kinds.iter().max_by(by_value));
    }
    chosen.into_iter().collect()
}

#[cfg(test)]
mod tests;
