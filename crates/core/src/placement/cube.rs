//! Equal spheres at random in a cube: one after the other, each where it is free of those before it.

use nalgebra::Vector3;

use super::random::Stream;
use crate::domain::Domain;
use crate::error::SetupError;
use crate::scene::{ChargeDeal, Problem, RandomCube, short, sphere_mass};
use crate::state::{Columns, Particles, State};

/// Draws for one sphere before the cube counts as full. Near the densest random placement, 38 % of the volume, a sphere
/// needs thousands; beyond it none is found however long one tries.
const ATTEMPTS: u64 = 20_000;

/// Draws per sphere, on average, before the cube counts as full: bounds the time at about a third of the volume, where the
/// remaining spheres would take most of it.
const MEAN_ATTEMPTS: u64 = 300;

/// Share of space that equal spheres fill at their densest, pi/sqrt(18) [-].
const DENSEST: f64 = 0.740_480_489_693_061;

/// Fills the cube. Particle i draws from its own stream: three velocity components, then positions until one is free.
pub(super) fn fill(cube: &RandomCube, seed: u64, domain: &Domain) -> Result<(Particles, State), SetupError> {
    let n = cube.count as usize;
    // Validation has made sure of a radius.
    let radius = cube.radius_of_each().unwrap_or(0.0);
    let extent: [f64; 3] = std::array::from_fn(|axis| match domain.periodic.length[axis] {
        length if length > 0.0 => cube.side.min(length),
        _ => cube.side,
    });
    let share = filled_share(n, radius, &extent, domain);
    if share > DENSEST {
        return Err(cannot_fill(cube, radius, share, "more than equal spheres can at their densest, 74 %"));
    }
    let mut position = Columns::zeros(n);
    let mut velocity = Columns::zeros(n);
    let mut grid = Grid::new(n, radius, extent, domain);
    let mut draws_left = ATTEMPTS + MEAN_ATTEMPTS * u64::from(cube.count);
    for i in 0..n {
        let mut stream = Stream::new(seed, i as u64);
        let draw = |stream: &mut Stream| std::array::from_fn::<f64, 3, _>(|_| stream.uniform());
        let u = draw(&mut stream);
        let v =
            std::array::from_fn::<f64, 3, _>(|k| cube.velocity_mean[k] + cube.velocity_spread[k] * (2.0 * u[k] - 1.0));
        velocity.set(i, v.into());
        let attempts = ATTEMPTS.min(draws_left);
        let free = (0..attempts).find_map(|_| {
            draws_left -= 1;
            let r = domain_position(draw(&mut stream).map(|u| u * cube.side), domain);
            let inside = domain.walls.iter().all(|wall| wall.distance(&r) >= radius);
            (inside && grid.is_free(&r, &position)).then_some(r)
        });
        let Some(r) = free else {
            let why = format!("no free place was found for particle {i} of {n} in {attempts} draws");
            return Err(cannot_fill(cube, radius, share, &why));
        };
        position.set(i, r);
        grid.insert(i, &r);
    }
    let charge = cube.charge.as_ref().map(|deal| match deal {
        ChargeDeal::Same(charge) => vec![*charge; n],
        ChargeDeal::InTurn(charges) => charges.iter().copied().cycle().take(n).collect(),
    });
    let particles = Particles { radius: vec![radius; n], mass: vec![sphere_mass(cube.density, radius); n], charge };
    let temperature = cube.temperature.map(|temperature| vec![temperature; n]);
    Ok((particles, State { position, velocity, temperature }))
}

/// The volume of the spheres over the volume that they may take up: centres lie in the cube, so that along open
/// directions the spheres may stick out by a radius.
fn filled_share(n: usize, radius: f64, extent: &[f64; 3], domain: &Domain) -> f64 {
    let sphere = sphere_mass(1.0, radius);
    let available: f64 = (0..3)
        .map(|axis| {
            let periodic = domain.periodic.length[axis] > 0.0 && extent[axis] >= domain.periodic.length[axis];
            if periodic { extent[axis] } else { extent[axis] + 2.0 * radius }
        })
        .product();
    n as f64 * sphere / available
}

fn cannot_fill(cube: &RandomCube, radius: f64, share: f64, why: &str) -> SetupError {
    let message = format!(
        "{} spheres of radius {} m do not fit a cube of {} m: they would fill {:.1} % of it; {why}",
        cube.count,
        short(radius),
        short(cube.side),
        100.0 * share
    );
    Problem::new("/particles/random_cube", message)
        .hint("random placement reaches about a third; take fewer or smaller spheres, or a larger side, and mind the walls")
        .into()
}

/// A drawn position, wrapped into the periodic box.
fn domain_position(mut r: [f64; 3], domain: &Domain) -> Vector3<f64> {
    for (axis, x) in r.iter_mut().enumerate() {
        let length = domain.periodic.length[axis];
        if length > 0.0 && *x >= length {
            *x -= length * (*x / length).floor();
            if *x >= length {
                *x = 0.0;
            }
        }
    }
    Vector3::from(r)
}

/// Spheres placed so far, in cells no smaller than a diameter: whoever overlaps a place is in one of 27 cells around it.
struct Grid<'a> {
    domain: &'a Domain,
    /// Squared distance that keeps two spheres apart [m^2].
    apart: f64,
    /// Edges of what the cells cover [m].
    extent: [f64; 3],
    /// Number of cells along each axis.
    cells: [usize; 3],
    /// Sphere that was put last into each cell; `NONE`: empty.
    head: Vec<u32>,
    /// Sphere that was put into the same cell before; `NONE`: none.
    next: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl<'a> Grid<'a> {
    fn new(n: usize, radius: f64, extent: [f64; 3], domain: &'a Domain) -> Self {
        // More cells than spheres would only cost memory.
        let most = libm::cbrt(n as f64).ceil().max(1.0);
        // A hair wider than a diameter, so that rounding a cell's number never skips a neighbour.
        let cells = extent.map(|edge| (edge / (2.0 * radius * (1.0 + 1e-9))).floor().clamp(1.0, most) as usize);
        let diameter = 2.0 * radius;
        Self {
            domain,
            apart: diameter * diameter,
            extent,
            cells,
            head: vec![NONE; cells.iter().product()],
            next: vec![NONE; n],
        }
    }

    fn cell(&self, axis: usize, x: f64) -> usize {
        let cells = self.cells[axis];
        ((x / self.extent[axis] * cells as f64) as usize).min(cells - 1)
    }

    /// Numbers of the cells next to the one of x along an axis, itself included, each once.
    fn around(&self, axis: usize, x: f64) -> impl Iterator<Item = usize> + use<> {
        let (cells, at) = (self.cells[axis], self.cell(axis, x));
        let length = self.domain.periodic.length[axis];
        let around = if length == 0.0 {
            [at.checked_sub(1), Some(at), Some(at + 1).filter(|&c| c < cells)]
        } else {
            match cells {
                1 => [Some(0), None, None],
                2 => [Some(0), Some(1), None],
                _ => [Some((at + cells - 1) % cells), Some(at), Some((at + 1) % cells)],
            }
        };
        around.into_iter().flatten()
    }

    fn index(&self, cell: [usize; 3]) -> usize {
        (cell[2] * self.cells[1] + cell[1]) * self.cells[0] + cell[0]
    }

    fn is_free(&self, r: &Vector3<f64>, position: &Columns) -> bool {
        for z in self.around(2, r.z) {
            for y in self.around(1, r.y) {
                for x in self.around(0, r.x) {
                    let mut other = self.head[self.index([x, y, z])];
                    while other != NONE {
                        let d = position.get(other as usize) - r;
                        let square: f64 =
                            (0..3).map(|k| self.domain.periodic.minimum_image(k, d[k])).map(|c| c * c).sum();
                        if square < self.apart {
                            return false;
                        }
                        other = self.next[other as usize];
                    }
                }
            }
        }
        true
    }

    fn insert(&mut self, i: usize, r: &Vector3<f64>) {
        let cell = self.index([self.cell(0, r.x), self.cell(1, r.y), self.cell(2, r.z)]);
        self.next[i] = self.head[cell];
        self.head[cell] = i as u32;
    }
}
