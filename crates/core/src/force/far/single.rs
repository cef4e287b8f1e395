//! Pairs of neighbouring leaves in 32 bits: root and division are then three times as fast, and what an expansion leaves
//! out is larger than what they round.
//!
//! Numbers of 32 bits end at 1e38, so lengths, weights and pulls have units in which all of them are near 1.

use super::super::composition::Composition;
use super::super::near_field::{Field, Group};

/// Least error for which 32 bits are precise enough [-]; they are off by some 1e-7.
const LEAST_ERROR: f64 = 1e-6;
/// Largest exponent whose powers stay within 32 bits.
const STEEPEST: f64 = 6.0;
/// Least weight over the largest.
const LIGHTEST: f64 = 1e-4;

/// A near field in units of its own.
#[derive(Clone, Debug)]
pub(super) struct Single {
    /// In units of lengths, weights and pulls; its binding is in those of the scene.
    pub(super) field: Field,
    /// Unit of lengths [m].
    pub(super) length: f64,
    /// Unit of pulls [N/m].
    pub(super) pull: f64,
    /// Whether 32 bits serve.
    pub(super) serves: bool,
}

impl Single {
    /// With a unit of lengths [m], for an error that is allowed.
    pub(super) fn new(field: &Field, length: f64, accuracy: f64) -> Self {
        let scaled = |group: &Group| {
            let sizes = || group.weight.iter().flatten().map(|weight| weight.abs());
            let largest = sizes().fold(0.0, f64::max);
            let unit = if largest > 0.0 { largest } else { 1.0 };
            let even = sizes().all(|size| size == 0.0 || size >= LIGHTEST * largest);
            let weight = group.weight.as_ref().map(|column| column.iter().map(|weight| weight / unit).collect());
            let unit = if group.weight.is_some() { unit * unit } else { 1.0 };
            let mut terms = group.terms.clone();
            for term in &mut terms {
                term.strength *= unit * term.power.at(length) / length;
            }
            (Group { weight, kind: group.kind, terms }, even)
        };
        let (mut groups, even): (Vec<Group>, Vec<bool>) = field.groups.iter().map(scaled).unzip();
        let terms = || groups.iter().flat_map(|group| &group.terms);
        let largest = terms().map(|term| term.strength.abs()).fold(0.0, f64::max);
        let fits = accuracy >= LEAST_ERROR
            && even.into_iter().all(|even| even)
            && terms().all(|term| term.power.exponent <= STEEPEST)
            && largest.is_normal()
            && (length * length).is_normal();
        if !fits {
            let field = field.in_units(field.groups.clone(), field.composition);
            return Self { field, length: 1.0, pull: 1.0, serves: false };
        }
        groups.iter_mut().flat_map(|group| &mut group.terms).for_each(|term| term.strength /= largest);
        let composition = Composition::of(&groups, None);
        Self { field: field.in_units(groups, composition), length, pull: largest, serves: true }
    }
}
