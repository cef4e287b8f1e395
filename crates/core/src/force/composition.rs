//! Pair laws composed at compile time: terms, weight, cut-off and binding of a scene as one function of eight distances.
//!
//! A law gives the pull F/s [N/m], so that pull times r_j - r_i is the force on i. It is symmetric in i and j to the last
//! bit. The exponents of the paper (1, 2) and of Lennard-Jones (7, 13) have a law of their own, with or without a switch, and
//! so have whole ones up to 4 and one or two real ones; all others are looked up once per eight pairs.

use super::near_field::{BindingTerm, Field, Group, Switch};
use super::power::Power;
use crate::domain::Periodic;
use crate::simd::{Arithmetic, Lanes, Simd};

/// The eight partners of a block.
pub(super) trait Partners<S: Arithmetic> {
    /// Their values in a column that is in the order of the kernel.
    fn of(&self, simd: S, column: &[f64]) -> S::F;
    /// Their weights in the first group.
    fn weight(&self, simd: S) -> S::F;
}

/// One particle and its eight partners.
#[derive(Clone, Copy)]
pub(super) struct Pairs<'a, S: Arithmetic, P> {
    pub(super) simd: S,
    /// The particle, in the order of the kernel.
    pub(super) own: usize,
    /// Its weight in the first group.
    pub(super) own_weight: S::F,
    pub(super) partners: &'a P,
    /// s^2 [m^2].
    pub(super) square: S::F,
}

impl<S: Arithmetic, P: Partners<S>> Pairs<'_, S, P> {
    /// Products of a column's values; the same for (i, j) and (j, i).
    #[inline(always)]
    fn product(&self, column: &[f64]) -> S::F {
        self.partners.of(self.simd, column) * self.simd.splat(column[self.own])
    }
}

/// The near field inside its cut-off.
pub(super) trait Law: Copy + Sync {
    /// F/s of eight pairs [N/m].
    fn pull<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> S::F;
}

/// c_1/s + c_2/s^2.
#[derive(Clone, Copy)]
pub(super) struct OneTwo(pub(super) [f64; 2]);

impl Law for OneTwo {
    #[inline(always)]
    fn pull<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> S::F {
        let simd = pairs.simd;
        let inverse = simd.splat(1.0) / pairs.square.sqrt();
        (simd.splat(self.0[0]) + simd.splat(self.0[1]) * inverse) * (inverse * inverse)
    }
}

/// Whole exponents from 1 to 4, in G groups of terms with a weight each.
#[derive(Clone, Copy)]
pub(super) struct Whole<'a, const G: usize> {
    /// Of c_1/s + c_2/s^2 + c_3/s^3 + c_4/s^4.
    strengths: [[f64; 4]; G],
    /// Weights of the groups behind the first, in the order of the kernel; `None`: 1.
    weights: [Option<&'a [f64]>; G],
}

impl<const G: usize> Law for Whole<'_, G> {
    #[inline(always)]
    fn pull<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> S::F {
        let simd = pairs.simd;
        let inverse = simd.splat(1.0) / pairs.square.sqrt();
        let mut sum = simd.splat(0.0);
        for g in 0..G {
            let [one, two, three, four] = self.strengths[g];
            let steep = simd.splat(three) + simd.splat(four) * inverse;
            let mut of_group = simd.splat(one) + (simd.splat(two) + steep * inverse) * inverse;
            if g == 0 {
                of_group = of_group * (pairs.partners.weight(simd) * pairs.own_weight);
            } else if let Some(weight) = self.weights[g] {
                of_group = of_group * pairs.product(weight);
            }
            sum = sum + of_group;
        }
        sum * (inverse * inverse)
    }
}

/// c_7/s^7 + c_13/s^13: no root.
#[derive(Clone, Copy)]
pub(super) struct SevenThirteen(pub(super) [f64; 2]);

impl Law for SevenThirteen {
    #[inline(always)]
    fn pull<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> S::F {
        let simd = pairs.simd;
        let inverse = simd.splat(1.0) / pairs.square;
        let sixth = inverse * inverse * inverse;
        (simd.splat(self.0[0]) + simd.splat(self.0[1]) * sixth) * (sixth * inverse)
    }
}

/// The sum of c s^-beta over N real exponents, all from one logarithm.
#[derive(Clone, Copy)]
pub(super) struct Real<const N: usize> {
    strengths: [f64; N],
    /// -(beta + 1)/2: what ln s^2 is multiplied by.
    factors: [f64; N],
}

impl<const N: usize> Law for Real<N> {
    #[inline(always)]
    fn pull<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> S::F {
        let simd = pairs.simd;
        let logarithm = simd.ln(pairs.square);
        let mut sum = simd.splat(0.0);
        for k in 0..N {
            sum = sum + simd.splat(self.strengths[k]) * simd.exp(simd.splat(self.factors[k]) * logarithm);
        }
        sum
    }
}

/// A law whose potential a switch can take to zero.
pub(super) trait Switchable: Law {
    /// Potential of eight pairs from 1/s, without its shift [J].
    fn potential<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>, inverse: S::F) -> S::F;
}

impl Switchable for OneTwo {
    #[inline(always)]
    fn potential<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>, inverse: S::F) -> S::F {
        let simd = pairs.simd;
        simd.splat(0.5 * self.0[0]) * simd.ln(pairs.square) - simd.splat(self.0[1]) * inverse
    }
}

impl Switchable for SevenThirteen {
    #[inline(always)]
    fn potential<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>, inverse: S::F) -> S::F {
        let simd = pairs.simd;
        let square = inverse * inverse;
        let sixth = square * square * square;
        (simd.splat(self.0[0] / -6.0) + simd.splat(self.0[1] / -12.0) * sixth) * sixth
    }
}

/// A law whose potential ends smoothly.
#[derive(Clone, Copy)]
pub(super) struct Switched<L> {
    law: L,
    switch: Switch,
    /// Potential at the cut-off, which is taken off [J].
    shift: f64,
}

impl<L> Switched<L> {
    /// A law with the switch of a field, if it has one.
    fn of(field: &Field, law: L) -> Option<Self> {
        let terms = field.groups.iter().flat_map(|group| &group.terms);
        field.switch.map(|switch| Self { law, switch, shift: terms.map(|term| term.strength * term.shift).sum() })
    }
}

impl<L: Switchable> Law for Switched<L> {
    #[inline(always)]
    fn pull<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> S::F {
        let Self { law, switch, shift } = self;
        let (simd, pull) = (pairs.simd, law.pull(pairs));
        // Below it the switch is 1 and its slope 0, exactly.
        if !S::F::any(simd.splat(switch.from * switch.from).le(pairs.square)) {
            return pull;
        }
        let inverse = simd.splat(1.0) / pairs.square.sqrt();
        let (value, slope) = switch.lanes(simd, pairs.square * inverse);
        pull * value + (law.potential(pairs, inverse) - simd.splat(shift)) * (slope * inverse)
    }
}

/// Another law times the weights of the first group, which are 1 where it has none: every law that is compiled both with
/// and without costs compile time, so only the paper's is.
#[derive(Clone, Copy)]
pub(super) struct Weighted<L>(pub(super) L);

impl<L: Law> Law for Weighted<L> {
    #[inline(always)]
    fn pull<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> S::F {
        self.0.pull(pairs) * (pairs.partners.weight(pairs.simd) * pairs.own_weight)
    }
}

/// Any terms, with any weights and a switch.
#[derive(Clone, Copy)]
pub(super) struct General<'a> {
    pub(super) groups: &'a [Group],
    /// Weights of the groups in the order of the kernel.
    pub(super) weights: &'a [Option<Vec<f64>>],
    pub(super) switch: Option<Switch>,
    /// Whether any term needs ln s^2.
    pub(super) logarithm: bool,
}

impl Law for General<'_> {
    #[inline(always)]
    fn pull<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> S::F {
        let simd = pairs.simd;
        let zero = simd.splat(0.0);
        let inverse = simd.splat(1.0) / pairs.square.sqrt();
        let logarithm = if self.logarithm { simd.ln(pairs.square) } else { zero };
        let (mut force, mut potential) = (zero, zero);
        for g in 0..self.groups.len().min(self.weights.len()) {
            let (group, weights) = (&self.groups[g], &self.weights[g]);
            let (mut sum, mut energy) = (zero, zero);
            for term in &group.terms {
                let (strength, power) = (simd.splat(term.strength), term.power.lanes(simd, logarithm, inverse));
                sum = sum + strength * power;
                // A switch turns potentials into forces.
                if self.switch.is_some() {
                    let of_term = term.power.potential_lanes(simd, pairs.square, logarithm, inverse, power);
                    energy = energy + strength * (of_term - simd.splat(term.shift));
                }
            }
            if let Some(weights) = weights {
                let product = pairs.product(weights);
                (sum, energy) = (sum * product, energy * product);
            }
            (force, potential) = (force + sum, potential + energy);
        }
        if let Some(switch) = self.switch {
            let (value, slope) = switch.lanes(simd, pairs.square * inverse);
            force = force * value + potential * slope;
        }
        force * inverse
    }
}

/// Binding, or none.
pub(super) trait Bond: Copy + Sync {
    /// Whether there is any.
    const BINDS: bool;
    /// Adds F/s of bonded pairs to a pull [N/m].
    fn add<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>, pull: S::F) -> S::F;
}

/// No binding.
#[derive(Clone, Copy)]
pub(super) struct Free;

impl Bond for Free {
    const BINDS: bool = false;

    #[inline(always)]
    fn add<S: Arithmetic, P: Partners<S>>(self, _: &Pairs<'_, S, P>, pull: S::F) -> S::F {
        pull
    }
}

/// Binding (13): attracts while s <= range (b_i + b_j).
#[derive(Clone, Copy)]
pub(super) struct Bound<'a> {
    pub(super) power: Power,
    pub(super) strength: f64,
    pub(super) range: f64,
    /// Square of the largest activation distance [m^2].
    pub(super) largest: f64,
    /// Radii in the order of the kernel; `None`: all the same.
    pub(super) radius: Option<&'a [f64]>,
    /// Weights in the order of the kernel; `None`: 1.
    pub(super) weight: Option<&'a [f64]>,
}

impl Bond for Bound<'_> {
    const BINDS: bool = true;

    #[inline(always)]
    fn add<S: Arithmetic, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>, pull: S::F) -> S::F {
        let simd = pairs.simd;
        let near = pairs.square.le(simd.splat(self.largest));
        if !S::F::any(near) {
            return pull;
        }
        let bonded = match self.radius {
            None => near,
            Some(radius) => {
                let sum = pairs.partners.of(simd, radius) + simd.splat(radius[pairs.own]);
                let reach = simd.splat(self.range) * sum;
                pairs.square.le(reach * reach)
            }
        };
        let inverse = simd.splat(1.0) / pairs.square.sqrt();
        let logarithm = if self.power.needs_logarithm() { simd.ln(pairs.square) } else { inverse };
        let mut force = simd.splat(self.strength) * self.power.lanes(simd, logarithm, inverse);
        if let Some(weight) = self.weight {
            force = force * pairs.product(weight);
        }
        pull + (force * inverse).keep(bonded)
    }
}

/// Something to be done with a law and a binding that are known when it is compiled.
pub(super) trait Job {
    /// Does it.
    fn run<L: Law, B: Bond>(self, law: L, bond: B);
}

/// What the columns of a kernel hold, in its own order of particles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ordered {
    /// Weights of every group.
    pub(super) weights: Vec<Option<Vec<f64>>>,
    pub(super) bond_weight: Option<Vec<f64>>,
    pub(super) radius: Option<Vec<f64>>,
}

impl Ordered {
    /// Columns of a field, put into another order by `sorted`.
    pub(super) fn new(groups: &[Group], binding: Option<&BindingTerm>, sorted: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        let column = |column: &Option<Vec<f64>>| column.as_deref().map(&sorted);
        Self {
            weights: groups.iter().map(|group| column(&group.weight)).collect(),
            bond_weight: binding.and_then(|binding| column(&binding.weight)),
            radius: binding.and_then(|binding| column(&binding.radius)),
        }
    }

    /// The first group's weights.
    pub(super) fn first(&self) -> Option<&[f64]> {
        self.weights.first()?.as_deref()
    }
}

/// The near field's terms in the form that is fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Composition {
    OneTwo([f64; 2]),
    SevenThirteen([f64; 2]),
    /// Strengths of the exponents 1 to 4 of one or two groups.
    Whole([[f64; 4]; 2]),
    /// Strengths and exponents of one or two terms.
    Real([f64; 2], [f64; 2]),
    General,
}

impl Composition {
    pub(super) fn of(groups: &[Group], switch: Option<Switch>) -> Self {
        let whole = [1.0, 2.0, 3.0, 4.0];
        let group = match groups {
            [group] => group,
            [one, two] if switch.is_none() => {
                let strengths = strengths(one, whole).zip(strengths(two, whole));
                return strengths.map_or(Self::General, |(one, two)| Self::Whole([one, two]));
            }
            _ => return Self::General,
        };
        match (strengths(group, [1.0, 2.0]), strengths(group, [7.0, 13.0]), group.terms.as_slice()) {
            (Some(strengths), ..) => Self::OneTwo(strengths),
            (_, Some(strengths), _) if group.weight.is_none() => Self::SevenThirteen(strengths),
            _ if switch.is_none() && strengths(group, whole).is_some() => {
                Self::Whole([strengths(group, whole).unwrap_or_default(), [0.0; 4]])
            }
            (_, _, [one, rest @ ..]) if switch.is_none() && rest.len() < 2 && one.power.needs_logarithm() => {
                let two = rest.first().map_or((0.0, 0.0), |two| (two.strength, two.power.exponent));
                Self::Real([one.strength, two.0], [one.power.exponent, two.1])
            }
            _ => Self::General,
        }
    }
}

/// Strengths of some exponents; `None` where a group has others too.
fn strengths<const N: usize>(group: &Group, exponents: [f64; N]) -> Option<[f64; N]> {
    let known = group.terms.iter().all(|term| exponents.contains(&term.power.exponent));
    let strength = |exponent: f64| {
        let terms = group.terms.iter().filter(|term| term.power.exponent == exponent);
        terms.map(|term| term.strength).sum::<f64>()
    };
    known.then(|| exponents.map(strength))
}

/// Does a job with the law of a field, the only place that looks at what the law is.
pub(super) fn compose(field: &Field, ordered: &Ordered, job: impl Job) {
    match field.composition {
        Composition::OneTwo(strengths) => match (Switched::of(field, OneTwo(strengths)), ordered.first()) {
            (None, None) => bind(field, ordered, OneTwo(strengths), job),
            (None, Some(_)) => bind(field, ordered, Weighted(OneTwo(strengths)), job),
            (Some(law), _) => bind(field, ordered, Weighted(law), job),
        },
        // These have no weights.
        Composition::SevenThirteen(strengths) => match Switched::of(field, SevenThirteen(strengths)) {
            None => bind(field, ordered, SevenThirteen(strengths), job),
            Some(law) => bind(field, ordered, law, job),
        },
        Composition::Whole(strengths) => whole(field, ordered, strengths, job),
        Composition::Real([strength, _], [exponent, _]) if field.groups[0].terms.len() == 1 => {
            let law = Real { strengths: [strength], factors: [-0.5 * (exponent + 1.0)] };
            bind(field, ordered, Weighted(law), job)
        }
        Composition::Real(strengths, exponents) => {
            let law = Real { strengths, factors: exponents.map(|beta| -0.5 * (beta + 1.0)) };
            bind(field, ordered, Weighted(law), job)
        }
        Composition::General => general(field, ordered, job),
    }
}

/// The same where distances have no end: fewer laws, each for any precision.
pub(super) fn compose_unbounded(field: &Field, ordered: &Ordered, job: impl Job) {
    match field.composition {
        Composition::OneTwo(strengths) => bind(field, ordered, Weighted(OneTwo(strengths)), job),
        Composition::Whole(strengths) => whole(field, ordered, strengths, job),
        _ => general(field, ordered, job),
    }
}

fn whole(field: &Field, ordered: &Ordered, strengths: [[f64; 4]; 2], job: impl Job) {
    match ordered.weights.as_slice() {
        [_, second] => bind(field, ordered, Whole { strengths, weights: [None, second.as_deref()] }, job),
        _ => bind(field, ordered, Whole { strengths: [strengths[0]], weights: [None] }, job),
    }
}

fn general(field: &Field, ordered: &Ordered, job: impl Job) {
    let (groups, switch) = (&field.groups, field.switch);
    let needs = |power: &Power| match switch {
        Some(_) => power.potential_needs_logarithm(),
        None => power.needs_logarithm(),
    };
    let logarithm = groups.iter().flat_map(|group| &group.terms).any(|term| needs(&term.power));
    bind(field, ordered, General { groups, weights: &ordered.weights, switch, logarithm }, job);
}

fn bind(field: &Field, ordered: &Ordered, law: impl Law, job: impl Job) {
    match &field.binding {
        None => job.run(law, Free),
        Some(term) => {
            let reach = term.largest_reach();
            let bond = Bound {
                power: term.power,
                strength: term.strength,
                range: term.range,
                largest: reach * reach,
                radius: ordered.radius.as_deref(),
                weight: ordered.bond_weight.as_deref(),
            };
            job.run(law, bond);
        }
    }
}

/// r_j - r_i, minimum image.
#[inline(always)]
pub(super) fn separation<S: Simd>(simd: S, periodic: &Periodic, any: bool, d: [S::F; 3]) -> [S::F; 3] {
    if !any {
        return d;
    }
    let mut nearest = d;
    for axis in 0..3 {
        nearest[axis] = periodic.minimum_images(simd, axis, d[axis]);
    }
    nearest
}

/// The pull of eight pairs, near field inside its cut-off and binding.
#[inline(always)]
pub(super) fn pull<S: Arithmetic, P: Partners<S>>(
    law: impl Law,
    bond: impl Bond,
    reach: S::F,
    pairs: &Pairs<'_, S, P>,
) -> S::F {
    bond.add(pairs, law.pull(pairs).keep(pairs.square.le(reach)))
}

/// The square, without overflow to infinity: an infinitely distant surplus lane must stay outside.
#[inline(always)]
pub(super) fn square_of(distance: f64) -> f64 {
    let square = distance * distance;
    if square < f64::MAX { square } else { f64::MAX }
}
