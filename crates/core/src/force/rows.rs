//! The pair loop for forces: blocks of up to 32 pairs of one particle, sums in eight lanes.

use super::near_field::Field;
use super::power::{BLOCK, LANES, Lane};
use crate::simd::{Task, vectorized};
use crate::state::Columns;
use rayon::prelude::*;

/// Rows per task: depends on nothing but this constant, never on the number of threads.
pub(super) const ROWS: usize = 32;
/// Ordered pairs from which tasks are worth their overhead.
pub(super) const PARALLEL_FROM: u64 = 100_000;

/// Adds the forces of all rows to `force`.
pub(super) fn forces(field: &Field, r: &Columns, force: &mut Columns) {
    let add = |task: usize, x: &mut [f64], y: &mut [f64], z: &mut [f64]| {
        vectorized(ForceRows { field, r, first: task * ROWS, force: [x, y, z] });
    };
    if 2 * field.neighbors.pairs(r.len()) < PARALLEL_FROM {
        add(0, &mut force.x, &mut force.y, &mut force.z);
    } else {
        (force.x.par_chunks_mut(ROWS), force.y.par_chunks_mut(ROWS), force.z.par_chunks_mut(ROWS))
            .into_par_iter()
            .enumerate()
            .for_each(|(task, (x, y, z))| add(task, x, y, z));
    }
}

/// Forces of consecutive rows.
struct ForceRows<'a> {
    field: &'a Field,
    r: &'a Columns,
    first: usize,
    force: [&'a mut [f64]; 3],
}

impl Task for ForceRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let [x, y, z] = self.force;
        let mut block = Block::default();
        for k in 0..x.len().min(y.len()).min(z.len()) {
            let i = self.first + k;
            let lanes = block.row(self.field, self.r, i);
            x[k] += sum(&lanes[0]);
            y[k] += sum(&lanes[1]);
            z[k] += sum(&lanes[2]);
        }
    }
}

/// Lanes to one number, always in this order.
#[inline(always)]
pub(super) fn sum(lane: &[f64; LANES]) -> f64 {
    ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]))
}

/// A block of pairs of particle i, and what is known about them.
struct Block {
    d: [Lane; 3],
    square: Lane,
    inverse: Lane,
    /// Sum over terms of the force along n_ij [N].
    force: Lane,
    near_field: Lane,
    power: Lane,
    sum: Lane,
    potential: Lane,
    energy: Lane,
}

/// Which partners a block holds.
#[derive(Clone, Copy)]
enum Partners<'a> {
    From(usize),
    Listed(&'a [u32]),
}

impl Partners<'_> {
    /// out = f(value of each partner in a column), for `count` partners, at most `LEN`.
    #[inline(always)]
    fn map<const LEN: usize>(self, column: &[f64], count: usize, out: &mut Lane, f: impl Fn(f64) -> f64) {
        match self {
            Self::From(first) => match column[first..].first_chunk::<LEN>() {
                // Numbers beyond `count` do no harm: those lanes are infinitely far away.
                Some(values) => {
                    for k in 0..LEN {
                        out[k] = f(values[k]);
                    }
                }
                None => {
                    let (whole, rest) = column[first..first + count].as_chunks::<LANES>();
                    let (lanes, _) = out.as_chunks_mut::<LANES>();
                    for (out, values) in lanes.iter_mut().zip(whole) {
                        for l in 0..LANES {
                            out[l] = f(values[l]);
                        }
                    }
                    for (out, &value) in out[count - rest.len()..].iter_mut().zip(rest) {
                        *out = f(value);
                    }
                }
            },
            Self::Listed(list) => {
                for (out, &j) in out.iter_mut().zip(&list[..count]) {
                    *out = f(column[j as usize]);
                }
            }
        }
    }
}

impl Default for Block {
    fn default() -> Self {
        const ZERO: Lane = [0.0; BLOCK];
        Self {
            d: [ZERO; 3],
            square: ZERO,
            inverse: ZERO,
            force: ZERO,
            near_field: ZERO,
            power: ZERO,
            sum: ZERO,
            potential: ZERO,
            energy: ZERO,
        }
    }
}

impl Block {
    /// Sums of the force components over all partners of particle i.
    #[inline(always)]
    fn row(&mut self, field: &Field, r: &Columns, i: usize) -> [[f64; LANES]; 3] {
        let mut lanes = [[0.0; LANES]; 3];
        let listed = field.neighbors.row(i);
        let total = listed.map_or(r.len(), <[u32]>::len);
        let mut first = 0;
        while first < total {
            let count = BLOCK.min(total - first);
            let partners = listed.map_or(Partners::From(first), |list| Partners::Listed(&list[first..first + count]));
            let own = if listed.is_none() { i.wrapping_sub(first) } else { usize::MAX };
            // Loops of constant length leave no scalar remainder, and long ones hide the time of single operations.
            if count > LANES {
                self.pairs::<BLOCK>(field, r, i, partners, (count, own), &mut lanes);
            } else {
                self.pairs::<LANES>(field, r, i, partners, (count, own), &mut lanes);
            }
            first += count;
        }
        lanes
    }

    /// Adds the pairs of particle i with `count` partners, at most `LEN`, to the row's lanes; lane `own` is i itself.
    #[inline(always)]
    fn pairs<const LEN: usize>(
        &mut self,
        field: &Field,
        r: &Columns,
        i: usize,
        partners: Partners<'_>,
        (count, own): (usize, usize),
        lanes: &mut [[f64; LANES]; 3],
    ) {
        if field.periodic.any() {
            self.distances::<true, LEN>(field, r, i, partners, count);
        } else {
            self.distances::<false, LEN>(field, r, i, partners, count);
        }
        if let Some(itself) = self.square[..count].get_mut(own) {
            *itself = f64::INFINITY;
        }
        self.invert::<LEN>();
        self.near_field::<LEN>(field, i, partners, count);
        self.bind::<LEN>(field, i, partners, count);
        self.add_forces::<LEN>(lanes);
    }

    /// d = r_j - r_i, square = d.d; surplus lanes are infinitely far.
    #[inline(always)]
    fn distances<const PERIODIC: bool, const LEN: usize>(
        &mut self,
        field: &Field,
        r: &Columns,
        i: usize,
        partners: Partners<'_>,
        count: usize,
    ) {
        for axis in 0..3 {
            let column = r.axes()[axis];
            let own = column[i];
            partners.map::<LEN>(column, count, &mut self.d[axis], |other| {
                if PERIODIC { field.periodic.minimum_image(axis, other - own) } else { other - own }
            });
        }
        for k in 0..LEN {
            let [x, y, z] = [self.d[0][k], self.d[1][k], self.d[2][k]];
            self.square[k] = x * x + y * y + z * z;
        }
        self.square[count.min(LEN)..LEN].fill(f64::INFINITY);
    }

    #[inline(always)]
    fn invert<const LEN: usize>(&mut self) {
        for k in 0..LEN {
            self.inverse[k] = 1.0 / self.square[k].sqrt();
        }
    }

    /// Sets `force` to the near field (2) with its cut-off and switch.
    #[inline(always)]
    fn near_field<const LEN: usize>(&mut self, field: &Field, i: usize, partners: Partners<'_>, count: usize) {
        // A switch turns potentials into forces.
        let potentials = field.switch.is_some();
        self.force[..LEN].fill(0.0);
        if potentials {
            self.near_field[..LEN].fill(0.0);
        }
        if field.groups.is_empty() {
            return;
        }
        for group in &field.groups {
            self.sum[..LEN].fill(0.0);
            if potentials {
                self.energy[..LEN].fill(0.0);
            }
            for term in &group.terms {
                term.power.block::<LEN, BLOCK>(&self.square, &self.inverse, &mut self.power);
                for k in 0..LEN {
                    self.sum[k] += term.strength * self.power[k];
                }
                if potentials {
                    term.power.potential_block::<LEN, BLOCK>(
                        &self.square,
                        &self.inverse,
                        &self.power,
                        &mut self.potential,
                    );
                    for k in 0..LEN {
                        self.energy[k] += term.strength * (self.potential[k] - term.shift);
                    }
                }
            }
            if let Some(weight) = &group.weight {
                // The product first: it is the same for (i, j) and (j, i).
                let own = weight[i];
                partners.map::<LEN>(weight, count, &mut self.potential, |other| other * own);
                for k in 0..LEN {
                    self.sum[k] *= self.potential[k];
                }
                if potentials {
                    for k in 0..LEN {
                        self.energy[k] *= self.potential[k];
                    }
                }
            }
            for k in 0..LEN {
                self.force[k] += self.sum[k];
            }
            if potentials {
                for k in 0..LEN {
                    self.near_field[k] += self.energy[k];
                }
            }
        }
        if let Some(switch) = field.switch {
            for k in 0..LEN {
                let (value, slope) = switch.at(self.square[k] * self.inverse[k]);
                self.force[k] = self.force[k] * value + self.near_field[k] * slope;
                self.near_field[k] *= value;
            }
        }
        let reach = square_of(field.cutoff);
        for k in 0..LEN {
            let inside = self.square[k] <= reach;
            self.force[k] = if inside { self.force[k] } else { 0.0 };
        }
    }

    /// Adds binding (13) to `force`.
    #[inline(always)]
    fn bind<const LEN: usize>(&mut self, field: &Field, i: usize, partners: Partners<'_>, count: usize) {
        let Some(binding) = &field.binding else { return };
        let own = binding.radius[i];
        partners.map::<LEN>(&binding.radius, count, &mut self.sum, |other| binding.range * (other + own));
        let mut any = false;
        for k in 0..LEN {
            any |= self.square[k] <= self.sum[k] * self.sum[k];
        }
        if !any {
            return;
        }
        binding.power.block::<LEN, BLOCK>(&self.square, &self.inverse, &mut self.power);
        for k in 0..LEN {
            self.power[k] *= binding.strength;
        }
        if let Some(weight) = &binding.weight {
            let own = weight[i];
            partners.map::<LEN>(weight, count, &mut self.potential, |other| other * own);
            for k in 0..LEN {
                self.power[k] *= self.potential[k];
            }
        }
        for k in 0..LEN {
            let active = self.square[k] <= self.sum[k] * self.sum[k];
            self.force[k] += if active { self.power[k] } else { 0.0 };
        }
    }

    /// Adds the block's forces to lanes of x, y and z.
    #[inline(always)]
    fn add_forces<const LEN: usize>(&mut self, lanes: &mut [[f64; LANES]; 3]) {
        for k in 0..LEN {
            self.force[k] *= self.inverse[k];
        }
        for (lane, d) in lanes.iter_mut().zip(&self.d) {
            for k in 0..LEN {
                lane[k % LANES] += self.force[k] * d[k];
            }
        }
    }
}

/// The square, without overflow to infinity: an infinitely distant surplus lane must stay outside.
#[inline(always)]
pub(super) fn square_of(distance: f64) -> f64 {
    let square = distance * distance;
    if square < f64::MAX { square } else { f64::MAX }
}

#[cfg(test)]
mod tests {
    use super::ForceRows;
    use crate::domain::Domain;
    use crate::force::Field;
    use crate::force::energies::EnergyRows;
    use crate::placement::place;
    use crate::scene::Scene;
    use crate::simd::{Task, vectorized};
    use crate::state::Columns;

    /// Plain code against the machine's widest vectors: exponents with and without their own multiplication chain, a
    /// switch, binding, open and periodic, block remainders of every length.
    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        for domain in ["", r#", "domain": { "periodic": [2.5, null, 2.5] }"#] {
            for count in [7, 33, 71, 100] {
                let text = format!(
                    r#"{{ "duration": 1, "particles": {{ "random_cube": {{
                        "count": {count}, "side": 2, "radius": 0.05, "density": 2000 }} }},
                        "near_field": {{ "attraction": {{ "strength": 0.5, "exponent": 1 }},
                            "repulsion": {{ "strength": 0.25, "exponent": 2.3 }},
                            "weight": "mass-product", "cutoff": 1.2, "switch_from": 0.9 }},
                        "binding": {{ "strength": 1.75, "exponent": 1, "range": 3 }}{domain} }}"#
                );
                let scene = Scene::parse(&text, &[]).expect("a valid scene");
                let (particles, state) = place(&scene).expect("particles without overlap");
                let (r, n) = (&state.position, particles.len());
                let periodic = Domain::new(scene.domain.as_ref()).periodic;
                let field = Field::new(&scene, &particles, r, &periodic).expect("a near field");
                let forces = |wide: bool| {
                    let mut force = Columns::zeros(n);
                    let [x, y, z] = force.axes_mut();
                    let task = ForceRows { field: &field, r, first: 0, force: [x, y, z] };
                    if wide {
                        vectorized(task)
                    } else {
                        task.run()
                    }
                    force.axes().concat().iter().map(|f| f.to_bits()).collect::<Vec<_>>()
                };
                assert_eq!(forces(true), forces(false), "{count}{domain}");
                let energies = |wide: bool| {
                    let mut energy = vec![[0.0; 3]; n];
                    let task = EnergyRows { field: &field, r, first: 0, energy: &mut energy };
                    if wide {
                        vectorized(task)
                    } else {
                        task.run()
                    }
                    energy.concat().iter().map(|e: &f64| e.to_bits()).collect::<Vec<_>>()
                };
                assert_eq!(energies(true), energies(false), "{count}{domain}");
            }
        }
    }
}
