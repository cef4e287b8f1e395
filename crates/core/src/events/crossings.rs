//! Crossings of the cut-off and of the activation distance: the force jumps there, the velocity does not.
//!
//! A pair that crosses at tau feels the jump J = -+ f n/m for dt - tau. The integrator gives it weight q_new dt in the
//! velocity and p_new dt^2 in the position instead, since only the acceleration at the step's end has it. So
//! J (dt - tau - q_new dt) and J ((dt - tau)^2/2 - p_new dt^2) are added: what is left is of third order in the step.

use super::paths::{Launch, Paths, Piece, image};
use super::roots::first_closing;
use crate::force::Field;
use crate::integrator::Integrator;
use crate::neighbor::{NeighborList, Neighbors};
use crate::simd::{Task, vectorized};
use crate::state::Columns;
use nalgebra::Vector3;

/// Crossings of one pair in one piece of its path; a distance of fourth degree in time allows no more.
const MOST: usize = 4;
/// Pairs looked at together.
const GROUP: usize = 8;

/// Crossings of one step. Buffers are kept from one step to the next.
#[derive(Clone, Debug, Default)]
pub struct Crossings {
    reach: Vec<f64>,
    pairs: Vec<(u32, u32)>,
    /// Changes of accelerations by the step's crossings, length n [m/s^2]; void where there are none.
    pub jump: Columns,
    /// How many.
    pub count: u64,
}

/// One crossing.
struct Crossing {
    tau: f64,
    /// From i to j [-].
    normal: Vector3<f64>,
    inward: bool,
}

impl Crossings {
    /// Finds all crossings and adds what they do to `shifts`: (particle, metres, m/s).
    pub fn pass(
        &mut self,
        (field, ranks): (&Field, &[u32]),
        integrator: &Integrator,
        launch: &Launch<'_>,
        paths: &Paths,
        shifts: &mut Vec<(usize, Vector3<f64>, Vector3<f64>)>,
    ) {
        if self.count > 0 || self.jump.len() != launch.particles.len() {
            self.jump = Columns::zeros(launch.particles.len());
        }
        self.count = 0;
        self.measure(launch, paths);
        self.pairs.clear();
        vectorized(Scan { field, launch, reach: &self.reach, pairs: &mut self.pairs });
        let ranked = |&(i, j): &(u32, u32)| {
            let (a, b) = (ranks[i as usize], ranks[j as usize]);
            (a.min(b), a.max(b))
        };
        // Sums of several jumps must not depend on numbers.
        self.pairs.sort_unstable_by_key(ranked);
        for k in 0..self.pairs.len() {
            let (i, j) = (self.pairs[k].0 as usize, self.pairs[k].1 as usize);
            if let Some(cutoff) = field.jumping_cutoff() {
                self.pair(launch, paths, (i, j), cutoff, field.near_force(i, j, cutoff), integrator, shifts);
            }
            if let Some(range) = field.activation(i, j) {
                self.pair(launch, paths, (i, j), range, field.binding_force(i, j, range), integrator, shifts);
            }
        }
    }

    /// How far each particle gets from where it starts [m].
    fn measure(&mut self, launch: &Launch<'_>, paths: &Paths) {
        let length = |piece: &Piece, end: f64| {
            let t = end - piece.since;
            (piece.v.norm() + 0.5 * t * piece.a.norm()) * t
        };
        let n = launch.particles.len();
        self.reach.clear();
        self.reach.extend((0..n).map(|i| length(&paths.piece(launch, i), launch.dt)));
        // A piece that has ended reaches at most as far as if it had gone on.
        for piece in &paths.past {
            self.reach[piece.particle as usize] += length(piece, launch.dt);
        }
    }

    /// The crossings of one pair at one distance, where the force f on i along n_ij jumps (inside minus outside).
    #[allow(clippy::too_many_arguments)] // a pair, a shell, and where the result goes
    fn pair(
        &mut self,
        launch: &Launch<'_>,
        paths: &Paths,
        (i, j): (usize, usize),
        shell: f64,
        force: f64,
        integrator: &Integrator,
        shifts: &mut Vec<(usize, Vector3<f64>, Vector3<f64>)>,
    ) {
        let dt = launch.dt;
        let mass = &launch.particles.mass;
        for crossing in crossings(launch, paths, i, j, shell) {
            let left = dt - crossing.tau;
            let push = crossing.normal * if crossing.inward { force } else { -force };
            let (shift, kick) =
                (0.5 * left * left - integrator.position_new * dt * dt, left - integrator.velocity_new * dt);
            for (particle, jump) in [(i, push / mass[i]), (j, -push / mass[j])] {
                self.jump.add(particle, jump);
                shifts.push((particle, jump * shift, jump * kick));
            }
            self.count += 1;
        }
    }
}

/// Where a pair crosses a shell, in the order of time.
fn crossings(launch: &Launch<'_>, paths: &Paths, i: usize, j: usize, shell: f64) -> Vec<Crossing> {
    let mut found = Vec::new();
    let shift = image(launch, i, j);
    let mut inside = None;
    for (a, b, from, to) in intervals(launch, paths, i, j) {
        let d = (b.position(from) - a.position(from)) + shift;
        let w = b.velocity(from) - a.velocity(from);
        let acceleration = b.a - a.a;
        let polynomial = [
            d.norm_squared() - shell * shell,
            2.0 * d.dot(&w),
            w.norm_squared() + d.dot(&acceleration),
            w.dot(&acceleration),
            0.25 * acceleration.norm_squared(),
        ];
        // On which side it starts is what the forces take it for.
        let mut is_inside = *inside.get_or_insert(polynomial[0] <= 0.0);
        let mut tau = 0.0;
        for _ in 0..MOST {
            let moved = translated(&polynomial, tau, is_inside);
            let Some(next) = first_closing(&moved, to - from - tau) else { break };
            tau += next;
            let at = from + tau;
            let d = (b.position(at) - a.position(at)) + shift;
            is_inside = !is_inside;
            found.push(Crossing { tau: at, normal: d.normalize(), inward: is_inside });
        }
        inside = Some(is_inside);
    }
    found
}

/// The polynomial about tau, positive on the side where the pair is; beginning at zero where it has just crossed.
fn translated(c: &[f64; 5], tau: f64, inside: bool) -> [f64; 5] {
    let t = tau;
    let moved = [
        c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * c[4]))),
        c[1] + t * (2.0 * c[2] + t * (3.0 * c[3] + t * 4.0 * c[4])),
        c[2] + t * (3.0 * c[3] + t * 6.0 * c[4]),
        c[3] + t * 4.0 * c[4],
        c[4],
    ];
    let sign = if inside { -1.0 } else { 1.0 };
    let mut signed = moved.map(|x| sign * x);
    signed[0] = signed[0].max(0.0);
    if tau > 0.0 {
        // It crosses with some speed: it does not turn back at once.
        signed[0] = 0.0;
        signed[1] = signed[1].max(0.0);
    }
    signed
}

/// The pieces of two paths, cut where either bends.
fn intervals(launch: &Launch<'_>, paths: &Paths, i: usize, j: usize) -> Vec<(Piece, Piece, f64, f64)> {
    if !paths.is_bent(i) && !paths.is_bent(j) {
        return vec![(paths.piece(launch, i), paths.piece(launch, j), 0.0, launch.dt)];
    }
    let mut result = Vec::new();
    let second = paths.pieces(launch, j);
    for (a, end_a) in paths.pieces(launch, i) {
        for &(b, end_b) in &second {
            let (from, to) = (a.since.max(b.since), end_a.min(end_b));
            if to > from {
                result.push((a, b, from, to));
            }
        }
    }
    result
}

/// Finds pairs that may cross: those whose distance from a shell is within reach.
pub(super) struct Scan<'a> {
    pub(super) field: &'a Field,
    pub(super) launch: &'a Launch<'a>,
    pub(super) reach: &'a [f64],
    pub(super) pairs: &'a mut Vec<(u32, u32)>,
}

impl Task for Scan<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { field, launch, reach, pairs } = self;
        let scan = Shells::new(field, launch, reach);
        match &field.neighbors {
            Neighbors::All => scan.all_pairs(pairs),
            Neighbors::List(list) => scan.listed(list, pairs),
        }
    }
}

struct Shells<'a> {
    launch: &'a Launch<'a>,
    reach: &'a [f64],
    periodic: bool,
    /// Negative: none.
    cutoff: f64,
    /// Activation distance over the sum of the radii; negative: none.
    range: f64,
}

impl<'a> Shells<'a> {
    fn new(field: &Field, launch: &'a Launch<'a>, reach: &'a [f64]) -> Self {
        Self {
            launch,
            reach,
            periodic: launch.domain.periodic.any(),
            cutoff: field.jumping_cutoff().unwrap_or(-1.0),
            range: field.binding.as_ref().map_or(-1.0, |binding| binding.range),
        }
    }

    #[inline(always)]
    fn all_pairs(&self, pairs: &mut Vec<(u32, u32)>) {
        let n = self.reach.len();
        for i in 0..n {
            let mut from = i + 1;
            while from + GROUP <= n {
                let group: [usize; GROUP] = std::array::from_fn(|k| from + k);
                if self.any(i, &group) {
                    pairs.extend(group.iter().filter(|&&j| self.any(i, &[j])).map(|&j| (i as u32, j as u32)));
                }
                from += GROUP;
            }
            pairs.extend((from..n).filter(|&j| self.any(i, &[j])).map(|j| (i as u32, j as u32)));
        }
    }

    /// A list holds both directions of a pair, by places.
    #[inline(always)]
    fn listed(&self, list: &NeighborList, pairs: &mut Vec<(u32, u32)>) {
        for (place, &i) in list.order().iter().enumerate() {
            for &partner in list.row(place) {
                let j = list.order()[partner as usize];
                if i < j && self.any(i as usize, &[j as usize]) {
                    pairs.push((i, j));
                }
            }
        }
    }

    /// Whether any of some partners of i may cross a shell.
    #[inline(always)]
    fn any<const LEN: usize>(&self, i: usize, partners: &[usize; LEN]) -> bool {
        let [x, y, z] = self.launch.position.axes();
        let radius = &self.launch.particles.radius;
        let periodic = &self.launch.domain.periodic;
        let mut any = false;
        for &j in partners {
            let mut d = [x[j] - x[i], y[j] - y[i], z[j] - z[i]];
            if self.periodic {
                for (axis, d) in d.iter_mut().enumerate() {
                    *d = periodic.minimum_image(axis, *d);
                }
            }
            let s = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            let reach = self.reach[i] + self.reach[j];
            let range = self.range * (radius[i] + radius[j]);
            any |= (self.cutoff > 0.0) & ((s - self.cutoff).abs() <= reach);
            any |= (range > 0.0) & ((s - range).abs() <= reach);
        }
        any
    }
}
