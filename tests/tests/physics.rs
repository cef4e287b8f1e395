//! The physics of the solver: forces, motion, impacts, heat, what is conserved, and that nothing depends on chance.

#![allow(missing_docs, clippy::unwrap_used)]

/// Collocation schemes and Newton's method: orders, symmetry, what a tolerance means, where which converges.
#[path = "physics/collocation.rs"]
mod collocation;
/// Step size: named failures, bounded rejections, the end of a run, (54) recomputed.
#[path = "physics/control.rs"]
mod control;
/// Same bits for every number of threads, for a run in two halves, whoever watches.
#[path = "physics/determinism.rs"]
mod determinism;
/// Force against the slope of the energy, for every law, weight, cut-off and external field.
#[path = "physics/gradient.rs"]
mod gradient;
/// Hard cases: tunnelling, break shot, cradle, collapse, bounces to rest, orbits in contact, crossings.
#[path = "physics/hard.rs"]
mod hard;
/// The table of hard cases, every scheme: right, or refused by name.
#[path = "physics/hard_table.rs"]
mod hard_table;
/// Single impacts against their closed forms, in both models.
#[path = "physics/impacts.rs"]
mod impacts;
/// What the books say: energy and momentum that nothing explains, sums over impacts.
#[path = "physics/ledger.rs"]
mod ledger;
/// Many impacts: the bouncing ball, break shot, cradle, dense gas; what they conserve.
#[path = "physics/many.rs"]
mod many;
/// Orders across located events, heat that no step changes, shifts and boosts.
#[path = "physics/orders.rs"]
mod orders;
/// Sums over pairs: third law, lists, periodic boxes, the ends of blocks.
#[path = "physics/pairs.rs"]
mod pairs;
/// The paper's Tables I and II: steps and iterations of the eight cases for eight seeds.
#[path = "physics/paper.rs"]
mod paper;
/// Scenes at the edge of the format that must run to their end.
#[path = "physics/survive.rs"]
mod survive;
/// Temperatures: cooling, reaction heat, never below zero.
#[path = "physics/thermal.rs"]
mod thermal;
/// The pair law written once more, plainly, to compare with.
#[path = "physics/twin.rs"]
mod twin;
/// Two bodies: turning points, period, order of the integrators, damping.
#[path = "physics/two_body.rs"]
mod two_body;
