//! Forces: the only loop over pairs, and the terms that a scene puts into it.
//!
//! A field is a list of terms, assembled once from the scene. Its law (terms, weight, cut-off, switch, binding) becomes one
//! function of eight distances when it is compiled (`composition`); two loops run it: over all pairs of a small cloud, each
//! once (`all_pairs`), and over lists, each pair from both sides (`listed`). Both give the same result for every number of
//! threads and every instruction set, and Newton's third law holds to the last bit of each pair.

mod all_pairs;
mod composition;
mod energies;
mod external;
mod far;
mod listed;
mod near_field;
mod potential;
mod power;
#[cfg(test)]
mod tests;

pub use external::ExternalField;
pub use near_field::{BindingTerm, Field, Switch, Term};
pub use power::Power;
