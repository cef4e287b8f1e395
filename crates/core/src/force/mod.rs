//! Forces: the only loop over pairs, and the terms that a scene puts into it.
//!
//! A field is a list of terms, assembled once from the scene. Every particle sums over its own row of partners, in
//! blocks of pairs: distances first, then term after term over the whole block, then the sum. So the choice of terms is
//! made once per block, and the arithmetic per pair has no branches. Each ordered pair is evaluated on its own: sums
//! need no exchange between rows, the result is the same for every number of threads, and since every operation is
//! symmetric in i and j, Newton's third law holds to the last bit of each pair.

mod energies;
mod external;
mod near_field;
mod power;
mod rows;

pub use external::ExternalField;
pub use near_field::{BindingTerm, Field, Switch, Term};
pub use power::Power;
