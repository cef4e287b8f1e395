//! Potentials of near field and binding, composed at compile time as forces are in `composition`.
//!
//! With equal weights a sum of logarithms is the logarithm of a product, so the paper's exponents 1 and 2 need one
//! logarithm for all pairs of a particle. Everything else is looked up once per eight pairs.

use super::composition::{Composition, square_of};
use super::near_field::{BindingTerm, Field, Group, Switch};
use super::power::Power;
use crate::lanes::{LogarithmSum, ln};
use crate::simd::{Bits, Lanes, Simd};

/// Up to eight partners.
pub(super) trait Partners<S: Simd> {
    /// How many.
    fn count(&self) -> usize;
    /// Their values in a column; anything beyond their number.
    fn of(&self, simd: S, column: &[f64]) -> S::F;
    /// The same, from a column with seven numbers behind its end.
    #[inline(always)]
    fn of_padded(&self, simd: S, column: &[f64]) -> S::F {
        self.of(simd, column)
    }
}

/// One particle and its partners; surplus ones are infinitely far.
pub(super) struct Pairs<'a, S: Simd, P> {
    pub(super) simd: S,
    /// The particle.
    pub(super) own: usize,
    pub(super) partners: &'a P,
    /// s^2 [m^2].
    pub(super) square: S::F,
    /// 1/s [1/m].
    pub(super) inverse: S::F,
}

impl<S: Simd, P: Partners<S>> Pairs<'_, S, P> {
    /// Products of a column's values.
    #[inline(always)]
    fn product(&self, column: &[f64]) -> S::F {
        self.partners.of(self.simd, column) * self.simd.splat(column[self.own])
    }
}

/// Energy of the pairs of one particle.
#[derive(Clone, Copy)]
pub(super) struct Energy {
    /// Their sum [J].
    pub(super) energy: f64,
    /// The sum of their absolute values, or less: pairs that share a lane may have been added before [J].
    pub(super) size: f64,
}

/// A potential whose sums are kept lane by lane.
pub(super) trait Potential: Copy + Sync {
    /// What is summed.
    type Sums<S: Simd>: Copy;
    /// Of no pairs.
    fn none<S: Simd>(self, simd: S) -> Self::Sums<S>;
    /// Whether it adds anything of these eight pairs.
    fn concerns<S: Simd, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> bool;
    /// Adds eight pairs.
    fn add<S: Simd, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>, sums: &mut Self::Sums<S>);
    /// What the sums amount to.
    fn energy<S: Simd>(self, simd: S, sums: Self::Sums<S>) -> Energy;
}

/// No potential.
#[derive(Clone, Copy)]
struct Nothing;

impl Potential for Nothing {
    type Sums<S: Simd> = ();

    #[inline(always)]
    fn none<S: Simd>(self, _: S) {}

    #[inline(always)]
    fn concerns<S: Simd, P: Partners<S>>(self, _: &Pairs<'_, S, P>) -> bool {
        false
    }

    #[inline(always)]
    fn add<S: Simd, P: Partners<S>>(self, _: &Pairs<'_, S, P>, (): &mut ()) {}

    #[inline(always)]
    fn energy<S: Simd>(self, _: S, (): ()) -> Energy {
        Energy { energy: 0.0, size: 0.0 }
    }
}

/// c_1 ln s - c_2/s - shift inside the cut-off, the same for all pairs.
#[derive(Clone, Copy)]
struct OneTwo {
    strengths: [f64; 2],
    shift: f64,
    /// Square of the cut-off [m^2].
    reach: f64,
}

/// Of the pairs inside the cut-off: logarithms of s^2, 1/s, their number.
#[derive(Clone, Copy)]
struct OneTwoSums<F> {
    logarithm: LogarithmSum<F>,
    inverse: F,
    count: F,
}

impl Potential for OneTwo {
    type Sums<S: Simd> = OneTwoSums<S::F>;

    #[inline(always)]
    fn none<S: Simd>(self, simd: S) -> OneTwoSums<S::F> {
        OneTwoSums { logarithm: LogarithmSum::new(simd), inverse: simd.splat(0.0), count: simd.splat(0.0) }
    }

    #[inline(always)]
    fn concerns<S: Simd, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> bool {
        S::F::any(pairs.square.le(pairs.simd.splat(self.reach)))
    }

    #[inline(always)]
    fn add<S: Simd, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>, sums: &mut OneTwoSums<S::F>) {
        let (simd, one) = (pairs.simd, pairs.simd.splat(1.0));
        let inside = pairs.square.le(simd.splat(self.reach));
        sums.logarithm.add(simd, pairs.square.select(inside, one));
        sums.inverse = sums.inverse + pairs.inverse.keep(inside);
        sums.count = sums.count + one.keep(inside);
    }

    #[inline(always)]
    fn energy<S: Simd>(self, simd: S, sums: OneTwoSums<S::F>) -> Energy {
        let [one, two] = self.strengths;
        let logarithm = simd.splat(0.5 * one) * sums.logarithm.value(simd);
        lanes_energy(simd, logarithm - simd.splat(two) * sums.inverse - simd.splat(self.shift) * sums.count)
    }
}

/// Any terms, with any weights and a switch.
#[derive(Clone, Copy)]
struct General<'a> {
    groups: &'a [Group],
    switch: Option<Switch>,
    /// Square of the cut-off [m^2].
    reach: f64,
}

impl General<'_> {
    /// Potentials of terms that share a weight [J].
    #[inline(always)]
    fn group<S: Simd, P: Partners<S>>(group: &Group, pairs: &Pairs<'_, S, P>) -> S::F {
        let simd = pairs.simd;
        let mut energy = simd.splat(0.0);
        for term in &group.terms {
            let potential = potential(simd, &term.power, pairs.square, pairs.inverse);
            energy = energy + simd.splat(term.strength) * (potential - simd.splat(term.shift));
        }
        match &group.weight {
            Some(weight) => energy * pairs.product(weight),
            None => energy,
        }
    }
}

/// Energies and their absolute values [J].
#[derive(Clone, Copy)]
struct Plain<F> {
    energy: F,
    size: F,
}

impl<F: Lanes> Plain<F> {
    #[inline(always)]
    fn none<S: Simd<F = F>>(simd: S) -> Self {
        Self { energy: simd.splat(0.0), size: simd.splat(0.0) }
    }

    #[inline(always)]
    fn add<S: Simd<F = F>>(&mut self, simd: S, energy: F) {
        *self = Self { energy: self.energy + energy, size: self.size + magnitude(simd, energy) };
    }

    #[inline(always)]
    fn energy(self) -> Energy {
        Energy { energy: self.energy.sum(), size: self.size.sum() }
    }
}

impl Potential for General<'_> {
    type Sums<S: Simd> = Plain<S::F>;

    #[inline(always)]
    fn none<S: Simd>(self, simd: S) -> Plain<S::F> {
        Plain::none(simd)
    }

    #[inline(always)]
    fn concerns<S: Simd, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> bool {
        S::F::any(pairs.square.le(pairs.simd.splat(self.reach)))
    }

    #[inline(always)]
    fn add<S: Simd, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>, sums: &mut Plain<S::F>) {
        let simd = pairs.simd;
        let mut energy = simd.splat(0.0);
        for group in self.groups {
            energy = energy + Self::group(group, pairs);
        }
        if let Some(switch) = self.switch {
            energy = energy * switch.lanes(simd, pairs.square * pairs.inverse).0;
        }
        sums.add(simd, energy.keep(pairs.square.le(simd.splat(self.reach))));
    }

    #[inline(always)]
    fn energy<S: Simd>(self, _: S, sums: Plain<S::F>) -> Energy {
        sums.energy()
    }
}

/// Binding (13) with exponent 1 of equal particles: c (ln s - ln reach) of bonded pairs.
#[derive(Clone, Copy)]
struct LogarithmBond {
    strength: f64,
    /// Square of the activation distance [m^2].
    reach: f64,
    /// ln reach.
    shift: f64,
}

impl Potential for LogarithmBond {
    type Sums<S: Simd> = (LogarithmSum<S::F>, S::F);

    #[inline(always)]
    fn none<S: Simd>(self, simd: S) -> Self::Sums<S> {
        (LogarithmSum::new(simd), simd.splat(0.0))
    }

    #[inline(always)]
    fn concerns<S: Simd, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> bool {
        S::F::any(pairs.square.le(pairs.simd.splat(self.reach)))
    }

    #[inline(always)]
    fn add<S: Simd, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>, (logarithm, count): &mut Self::Sums<S>) {
        let (simd, one) = (pairs.simd, pairs.simd.splat(1.0));
        let bonded = pairs.square.le(simd.splat(self.reach));
        if S::F::any(bonded) {
            logarithm.add(simd, pairs.square.select(bonded, one));
            *count = *count + one.keep(bonded);
        }
    }

    #[inline(always)]
    fn energy<S: Simd>(self, simd: S, (logarithm, count): Self::Sums<S>) -> Energy {
        let half = simd.splat(0.5) * logarithm.value(simd);
        lanes_energy(simd, simd.splat(self.strength) * (half - simd.splat(self.shift) * count))
    }
}

/// Any binding (13).
#[derive(Clone, Copy)]
struct AnyBond<'a>(&'a BindingTerm);

impl AnyBond<'_> {
    /// Squares of the activation distances [m^2].
    #[inline(always)]
    fn reach<S: Simd, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> S::F {
        let (Self(term), simd) = (self, pairs.simd);
        let sum = match &term.radius {
            Some(radius) => pairs.partners.of(simd, radius) + simd.splat(radius[pairs.own]),
            None => simd.splat(term.largest + term.largest),
        };
        let reach = simd.splat(term.range) * sum;
        reach * reach
    }
}

impl Potential for AnyBond<'_> {
    type Sums<S: Simd> = Plain<S::F>;

    #[inline(always)]
    fn none<S: Simd>(self, simd: S) -> Plain<S::F> {
        Plain::none(simd)
    }

    #[inline(always)]
    fn concerns<S: Simd, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>) -> bool {
        S::F::any(pairs.square.le(self.reach(pairs)))
    }

    #[inline(always)]
    fn add<S: Simd, P: Partners<S>>(self, pairs: &Pairs<'_, S, P>, sums: &mut Plain<S::F>) {
        let (Self(term), simd) = (self, pairs.simd);
        let reach_square = self.reach(pairs);
        let bonded = pairs.square.le(reach_square);
        if !S::F::any(bonded) {
            return;
        }
        // The same potential at the activation distance, which may differ from pair to pair.
        let shift = potential(simd, &term.power, reach_square, simd.splat(1.0) / reach_square.sqrt());
        let own = potential(simd, &term.power, pairs.square, pairs.inverse);
        let mut energy = simd.splat(term.strength) * (own - shift);
        if let Some(weight) = &term.weight {
            energy = energy * pairs.product(weight);
        }
        sums.add(simd, energy.keep(bonded));
    }

    #[inline(always)]
    fn energy<S: Simd>(self, _: S, sums: Plain<S::F>) -> Energy {
        sums.energy()
    }
}

/// Something to be done with potentials that are known when it is compiled.
pub(super) trait PotentialJob {
    /// What it gives.
    type Output;
    /// Does it.
    fn run<P: Potential, B: Potential>(self, near: P, bond: B) -> Self::Output;
}

/// Does a job with the potentials of a field, the only place that looks at what they are.
pub(super) fn compose<J: PotentialJob>(field: &Field, job: J) -> J::Output {
    let reach = square_of(field.cutoff);
    match (field.composition, field.groups.as_slice()) {
        (_, []) => bind(field, Nothing, job),
        (Composition::OneTwo(strengths), [Group { weight: None, terms, .. }]) if field.switch.is_none() => {
            let shift = terms.iter().map(|term| term.strength * term.shift).sum();
            bind(field, OneTwo { strengths, shift, reach }, job)
        }
        (_, groups) => bind(field, General { groups, switch: field.switch, reach }, job),
    }
}

fn bind<J: PotentialJob>(field: &Field, near: impl Potential, job: J) -> J::Output {
    match &field.binding {
        None => job.run(near, Nothing),
        Some(BindingTerm { power, strength, weight: None, radius: None, .. }) if power.exponent == 1.0 => {
            let reach = field.binding.as_ref().map_or(0.0, BindingTerm::largest_reach);
            let bond = LogarithmBond { strength: *strength, reach: reach * reach, shift: power.potential_at(reach) };
            job.run(near, bond)
        }
        Some(term) => job.run(near, AnyBond(term)),
    }
}

/// The energy in eight lanes.
#[inline(always)]
fn lanes_energy<S: Simd>(simd: S, energy: S::F) -> Energy {
    Energy { energy: energy.sum(), size: magnitude(simd, energy).sum() }
}

/// Without the sign.
#[inline(always)]
fn magnitude<S: Simd>(simd: S, x: S::F) -> S::F {
    x.and_bits(simd.bits(!(1 << 63)))
}

/// P(beta) from s^2 and 1/s.
#[inline(always)]
fn potential<S: Simd>(simd: S, power: &Power, square: S::F, inverse: S::F) -> S::F {
    let logarithm = if power.potential_needs_logarithm() { ln(simd, square) } else { inverse };
    // A logarithm does not need the power.
    let of_power = if power.exponent == 1.0 { inverse } else { power.lanes(simd, logarithm, inverse) };
    power.potential_lanes(simd, square, logarithm, inverse, of_power)
}
