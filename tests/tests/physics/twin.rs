//! The pair law of a scene, written once more with `powf`, branches and a double loop.

use agglo_core::scene::{Cutoff, NamedCutoff, PowerTerm, Scene, Weight};
use agglo_core::state::{Columns, Particles};
use nalgebra::Vector3;

/// Force and energies of one pair, and the sum of the sizes of all terms, against which round-off is measured.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pair {
    /// Force on i along n_ij: positive attracts [N].
    pub force: f64,
    /// Near-field energy [J].
    pub near_field: f64,
    /// Binding energy [J].
    pub binding: f64,
    /// Sum of |force| of all terms [N].
    pub force_size: f64,
    /// Sum of |energy| of all terms and their shifts [J].
    pub energy_size: f64,
}

fn potential(beta: f64, s: f64) -> f64 {
    if beta == 1.0 { s.ln() } else { s.powf(1.0 - beta) / (1.0 - beta) }
}

/// The distance beyond which there is no near field [m].
pub fn cutoff(scene: &Scene) -> Option<f64> {
    let near = scene.near_field.as_ref()?;
    match near.cutoff {
        Cutoff::Distance(distance) => Some(distance),
        Cutoff::Named(NamedCutoff::None) => None,
        Cutoff::Named(NamedCutoff::Inflection) => {
            let (a, r) = (near.attraction.as_ref()?, near.repulsion.as_ref()?);
            Some((r.exponent * r.strength / (a.exponent * a.strength)).powf(1.0 / (r.exponent - a.exponent)))
        }
    }
}

/// The pair (i, j) at distance s [m].
pub fn pair(scene: &Scene, particles: &Particles, i: usize, j: usize, s: f64) -> Pair {
    let charge = |k: usize| particles.charge.as_ref().map_or(0.0, |charge| charge[k]);
    let weight = |weight: Weight, attraction: bool| match weight {
        Weight::None => 1.0,
        Weight::MassProduct => particles.mass[i] * particles.mass[j],
        Weight::ChargeProduct if attraction => -charge(i) * charge(j),
        Weight::ChargeProduct => (charge(i) * charge(j)).abs(),
    };
    let mut pair = Pair::default();
    let cutoff = cutoff(scene);
    if let Some(near) = scene.near_field.as_ref().filter(|_| cutoff.is_none_or(|cutoff| s <= cutoff)) {
        let mut add = |term: &PowerTerm, sign: f64| {
            let strength = sign * term.strength * weight(term.weight.unwrap_or(near.weight), sign > 0.0);
            let shift = cutoff.map_or(0.0, |cutoff| strength * potential(term.exponent, cutoff));
            let (force, energy) = (strength * s.powf(-term.exponent), strength * potential(term.exponent, s));
            pair.force += force;
            pair.near_field += energy - shift;
            pair.force_size += force.abs();
            pair.energy_size += energy.abs() + shift.abs();
        };
        near.attraction.iter().for_each(|term| add(term, 1.0));
        near.repulsion.iter().for_each(|term| add(term, -1.0));
        if let (Some(from), Some(to)) = (near.switch_from, cutoff)
            && s > from
        {
            let x = (s - from) / (to - from);
            let value = 1.0 - 10.0 * x.powi(3) + 15.0 * x.powi(4) - 6.0 * x.powi(5);
            let slope = (-30.0 * x.powi(2) + 60.0 * x.powi(3) - 30.0 * x.powi(4)) / (to - from);
            pair.force = pair.force * value + pair.near_field * slope;
            pair.near_field *= value;
            pair.force_size += pair.energy_size * 2.0 / (to - from);
        }
    }
    if let Some(binding) = &scene.binding {
        let range = binding.range * (particles.radius[i] + particles.radius[j]);
        if s <= range {
            let default = scene.near_field.as_ref().map_or(Weight::None, |near| near.weight);
            let strength = binding.strength * weight(binding.weight.unwrap_or(default), false);
            let force = strength * s.powf(-binding.exponent);
            let (energy, shift) = (potential(binding.exponent, s), potential(binding.exponent, range));
            pair.force += force;
            pair.binding = strength * (energy - shift);
            pair.force_size += force.abs();
            pair.energy_size += strength.abs() * (energy.abs() + shift.abs());
        }
    }
    pair
}

/// Sums over all pairs at positions r.
pub struct Cloud {
    /// Force on every particle [N].
    pub force: Vec<Vector3<f64>>,
    /// Sum of the sizes of all terms of it, against which round-off is measured [N].
    pub force_size: Vec<f64>,
    /// Near-field energy [J].
    pub near_field: f64,
    /// Binding energy [J].
    pub binding: f64,
    /// Sum of the sizes of all terms of both [J].
    pub energy_size: f64,
}

/// All pairs of a cloud, with the nearest image along periodic directions.
pub fn cloud(scene: &Scene, particles: &Particles, r: &Columns) -> Cloud {
    let n = particles.len();
    let periodic = scene.domain.as_ref().and_then(|domain| domain.periodic).unwrap_or_default();
    let mut sum = Cloud {
        force: vec![Vector3::zeros(); n],
        force_size: vec![0.0; n],
        near_field: 0.0,
        binding: 0.0,
        energy_size: 0.0,
    };
    for i in 0..n {
        for j in i + 1..n {
            let mut d = r.get(j) - r.get(i);
            for axis in 0..3 {
                if let Some(length) = periodic[axis] {
                    d[axis] -= length * (d[axis] / length).round();
                }
            }
            let s = d.norm();
            let pair = pair(scene, particles, i, j, s);
            sum.force[i] += d * (pair.force / s);
            sum.force[j] -= d * (pair.force / s);
            sum.force_size[i] += pair.force_size;
            sum.force_size[j] += pair.force_size;
            sum.near_field += pair.near_field;
            sum.binding += pair.binding;
            sum.energy_size += pair.energy_size;
        }
    }
    sum
}
