//! Particles: what never changes ([`Particles`]) and what a step changes ([`State`]), as structures of arrays.

use crate::simd::{Task, vectorized};

/// One vector per particle, as three columns of equal length n.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// First components.
    pub x: Vec<f64>,
    /// Second components.
    pub y: Vec<f64>,
    /// Third components.
    pub z: Vec<f64>,
}

impl Columns {
    /// n zero vectors.
    #[must_use]
    pub fn zeros(n: usize) -> Self {
        Self { x: vec![0.0; n], y: vec![0.0; n], z: vec![0.0; n] }
    }

    /// Number of vectors.
    #[must_use]
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Vector i.
    #[must_use]
    pub fn get(&self, i: usize) -> nalgebra::Vector3<f64> {
        nalgebra::Vector3::new(self.x[i], self.y[i], self.z[i])
    }

    /// Sets vector i.
    pub fn set(&mut self, i: usize, v: nalgebra::Vector3<f64>) {
        self.x[i] = v.x;
        self.y[i] = v.y;
        self.z[i] = v.z;
    }

    /// Adds to vector i.
    pub fn add(&mut self, i: usize, v: nalgebra::Vector3<f64>) {
        self.x[i] += v.x;
        self.y[i] += v.y;
        self.z[i] += v.z;
    }

    /// Moves all vectors.
    pub fn shift(&mut self, by: nalgebra::Vector3<f64>) {
        for (column, by) in self.axes_mut().into_iter().zip(by.iter()) {
            if *by != 0.0 {
                column.iter_mut().for_each(|x| *x += by);
            }
        }
    }

    /// Appends a vector.
    pub fn push(&mut self, v: [f64; 3]) {
        self.x.push(v[0]);
        self.y.push(v[1]);
        self.z.push(v[2]);
    }

    /// Copies all vectors from `other`, which has the same length.
    pub fn copy_from(&mut self, other: &Self) {
        self.x.copy_from_slice(&other.x);
        self.y.copy_from_slice(&other.y);
        self.z.copy_from_slice(&other.z);
    }

    /// Whether all numbers are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.axes().into_iter().all(|column| vectorized(Finite(column)))
    }

    /// The three columns.
    #[must_use]
    pub fn axes(&self) -> [&[f64]; 3] {
        [&self.x, &self.y, &self.z]
    }

    /// The three columns, to write to.
    pub fn axes_mut(&mut self) -> [&mut [f64]; 3] {
        [&mut self.x, &mut self.y, &mut self.z]
    }
}

/// Whether all numbers of a column are finite.
struct Finite<'a>(&'a [f64]);

impl Task for Finite<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let mut finite = true;
        for x in self.0 {
            finite &= x.is_finite();
        }
        finite
    }
}

/// What never changes about the particles; row k belongs to particle k everywhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Particles {
    /// Radius b, length n [m].
    pub radius: Vec<f64>,
    /// Mass m, length n [kg].
    pub mass: Vec<f64>,
    /// Charge q, length n [C]; `None` where the scene names no charge.
    pub charge: Option<Vec<f64>>,
}

impl Particles {
    /// Number of particles n.
    #[must_use]
    pub fn len(&self) -> usize {
        self.radius.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.radius.is_empty()
    }

    /// Mean diameter [m].
    #[must_use]
    pub fn mean_diameter(&self) -> f64 {
        2.0 * self.radius.iter().sum::<f64>() / self.len() as f64
    }
}

/// What a step changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Positions r of the centres, wrapped into the box along periodic directions [m].
    pub position: Columns,
    /// Velocities v [m/s].
    pub velocity: Columns,
    /// Temperatures theta, length n [K]; `None` without `thermal`.
    pub temperature: Option<Vec<f64>>,
}
