//! Temperatures: reaction heat during impacts (stage I) and exchange with the surroundings (stage II).

pub mod exchange;
pub mod reaction;
