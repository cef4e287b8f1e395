//! Solver values to messages and back, exactly.
//!
//! Values are taken apart without `..`, so that a new quantity of the solver cannot go unrecorded: it does not compile.

mod checkpoint;
mod impacts;

pub use checkpoint::{checkpoint, read_checkpoint};
pub use impacts::{impacts, read_impacts};

use agglo_core::diagnostics::{Level, Notice, RejectedAttempt, RejectionCause, StepDiagnostics};
use agglo_core::ledger::{Ledger, Momentum, Totals};
use agglo_core::observer::{Clusters, Sample};
use agglo_core::state::{Particles, State};

use crate::proto::agglo::v1;
use crate::proto::agglo::v1::rejected_attempt::Cause;
use crate::proto::foxglove;

/// A message whose content makes no sense.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Malformed(pub String);

impl std::fmt::Display for Malformed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Malformed {}

/// Log time [ns] as a protobuf time stamp.
#[must_use]
pub fn timestamp(log_time: u64) -> prost_types::Timestamp {
    const NANO: u64 = 1_000_000_000;
    // Both quotients are in range: u64::MAX ns are 1.8e10 s.
    prost_types::Timestamp { seconds: (log_time / NANO) as i64, nanos: (log_time % NANO) as i32 }
}

fn vector([x, y, z]: [f64; 3]) -> Option<v1::Vector3> {
    Some(v1::Vector3 { x, y, z })
}

/// An absent vector is zero: proto3 readers may drop it.
fn components(vector: Option<v1::Vector3>) -> [f64; 3] {
    vector.map_or([0.0; 3], |v1::Vector3 { x, y, z }| [x, y, z])
}

/// Radii, masses, charges.
#[must_use]
pub fn particles(t: f64, step: u64, particles: &Particles) -> v1::ParticleStatic {
    let Particles { radius, mass, charge } = particles;
    v1::ParticleStatic {
        t,
        step,
        id: (0..radius.len() as u32).collect(),
        radius: radius.clone(),
        mass: mass.clone(),
        charge: charge.clone().unwrap_or_default(),
    }
}

/// Radii, masses, charges, read back.
///
/// # Errors
/// Columns of unequal length, ids out of order.
pub fn read_particles(message: v1::ParticleStatic) -> Result<Particles, Malformed> {
    let v1::ParticleStatic { t: _, step: _, id, radius, mass, charge } = message;
    let n = id.len();
    if radius.len() != n || mass.len() != n || !(charge.is_empty() || charge.len() == n) {
        let lengths = [n, radius.len(), mass.len(), charge.len()];
        return Err(Malformed(format!("columns id, radius, mass, charge of the lengths {lengths:?}")));
    }
    if let Some(k) = (0..n).find(|&k| id[k] as usize != k) {
        return Err(Malformed(format!("particle {} stands in row {k}", id[k])));
    }
    Ok(Particles { radius, mass, charge: if charge.is_empty() { None } else { Some(charge) } })
}

/// Iterations and step control.
#[must_use]
pub fn diagnostics(t: f64, step: u64, diagnostics: &StepDiagnostics) -> v1::StepDiagnostics {
    let StepDiagnostics {
        dt,
        position_errors,
        temperature_errors,
        violation,
        scaling,
        contraction,
        local_error,
        rejected,
        contacts,
        resting,
        bonds,
        rounds,
        impact_residual,
        fallbacks,
        crossings,
        pairs_evaluated,
    } = diagnostics;
    v1::StepDiagnostics {
        t,
        step,
        dt: *dt,
        iterations: position_errors.len() as u64,
        position_errors: position_errors.clone(),
        temperature_errors: temperature_errors.clone(),
        violation: *violation,
        scaling: *scaling,
        contraction: (!contraction.is_nan()).then_some(*contraction),
        local_error: *local_error,
        rejected: rejected.iter().map(attempt).collect(),
        contacts: *contacts,
        resting: *resting,
        bonds: *bonds,
        rounds: *rounds,
        impact_residual: *impact_residual,
        fallbacks: *fallbacks,
        crossings: *crossings,
        pairs_evaluated: *pairs_evaluated,
    }
}

fn attempt(attempt: &RejectedAttempt) -> v1::RejectedAttempt {
    let RejectedAttempt { dt, cause, iterations, violation, particle } = attempt;
    let cause = match cause {
        RejectionCause::NotConverged => Cause::NotConverged,
        RejectionCause::NotFinite => Cause::NotFinite,
        RejectionCause::LocalError => Cause::LocalError,
        RejectionCause::Travel => Cause::Travel,
    };
    v1::RejectedAttempt {
        dt: *dt,
        cause: cause.into(),
        iterations: *iterations,
        violation: *violation,
        particle: *particle,
    }
}

/// Iterations and step control, read back.
///
/// # Errors
/// A number of iterations that is not that of its errors, a cause that this version does not know.
pub fn read_diagnostics(message: v1::StepDiagnostics) -> Result<StepDiagnostics, Malformed> {
    let v1::StepDiagnostics {
        t: _,
        step: _,
        dt,
        iterations,
        position_errors,
        temperature_errors,
        violation,
        scaling,
        contraction,
        local_error,
        rejected,
        contacts,
        resting,
        bonds,
        rounds,
        impact_residual,
        fallbacks,
        crossings,
        pairs_evaluated,
    } = message;
    if position_errors.len() as u64 != iterations {
        return Err(Malformed(format!("{iterations} iterations with {} position errors", position_errors.len())));
    }
    Ok(StepDiagnostics {
        dt,
        position_errors,
        temperature_errors,
        violation,
        scaling,
        contraction: contraction.unwrap_or(f64::NAN),
        local_error,
        rejected: rejected.into_iter().map(read_attempt).collect::<Result<_, _>>()?,
        contacts,
        resting,
        bonds,
        rounds,
        impact_residual,
        fallbacks,
        crossings,
        pairs_evaluated,
    })
}

fn read_attempt(message: v1::RejectedAttempt) -> Result<RejectedAttempt, Malformed> {
    let cause = match message.cause() {
        Cause::Unknown => return Err(Malformed(format!("a rejected attempt with the cause {}", message.cause))),
        Cause::NotConverged => RejectionCause::NotConverged,
        Cause::NotFinite => RejectionCause::NotFinite,
        Cause::LocalError => RejectionCause::LocalError,
        Cause::Travel => RejectionCause::Travel,
    };
    let v1::RejectedAttempt { dt, cause: _, iterations, violation, particle } = message;
    Ok(RejectedAttempt { dt, cause, iterations, violation, particle })
}

/// Energies and momentum, with what viewers plot of them and the state. Clusters have a message of their own.
#[must_use]
pub fn energy(t: f64, step: u64, sample: &Sample, particles: &Particles, state: &State) -> v1::EnergyLedger {
    let Sample { ledger, momentum, clusters: _ } = sample;
    let Ledger { kinetic, near_field, binding, external, thermal, totals, residual } = *ledger;
    let Totals {
        reaction_heat,
        convected,
        radiated,
        impact_loss,
        friction_loss,
        resting_loss,
        periodic_work,
        outside_impulse,
    } = totals;
    let Momentum { linear, angular, residual: momentum_residual } = *momentum;
    let temperature = state.temperature.as_deref();
    v1::EnergyLedger {
        t,
        step,
        kinetic,
        near_field,
        binding,
        external,
        thermal,
        reaction_heat,
        convected,
        radiated,
        impact_loss,
        friction_loss,
        resting_loss,
        periodic_work,
        residual,
        momentum: vector(linear),
        angular_momentum: vector(angular),
        outside_impulse: vector(outside_impulse),
        momentum_residual,
        kinetic_per_mass: kinetic / particles.mass.iter().sum::<f64>(),
        mean_temperature: temperature.map(|theta| theta.iter().sum::<f64>() / theta.len() as f64),
        max_temperature: temperature.map(|theta| theta.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
    }
}

/// Energies and momentum, read back; what is there for plots only follows from them and the state.
#[must_use]
pub fn read_energy(message: v1::EnergyLedger) -> (Ledger, Momentum) {
    let v1::EnergyLedger {
        t: _,
        step: _,
        kinetic,
        near_field,
        binding,
        external,
        thermal,
        reaction_heat,
        convected,
        radiated,
        impact_loss,
        friction_loss,
        resting_loss,
        periodic_work,
        residual,
        momentum,
        angular_momentum,
        outside_impulse,
        momentum_residual,
        kinetic_per_mass: _,
        mean_temperature: _,
        max_temperature: _,
    } = message;
    let totals = Totals {
        reaction_heat,
        convected,
        radiated,
        impact_loss,
        friction_loss,
        resting_loss,
        periodic_work,
        outside_impulse: components(outside_impulse),
    };
    let ledger = Ledger { kinetic, near_field, binding, external, thermal, totals, residual };
    let linear = components(momentum);
    (ledger, Momentum { linear, angular: components(angular_momentum), residual: momentum_residual })
}

/// Cluster counts. Which cluster a particle is in stands in its row of the state.
#[must_use]
pub fn clusters(t: f64, step: u64, clusters: &Clusters) -> v1::Clusters {
    let Clusters { of: _, count, largest, singletons, mean_size } = clusters;
    v1::Clusters { t, step, count: *count, largest: *largest, singletons: *singletons, mean_size: *mean_size }
}

/// Cluster counts, read back; `of` is empty.
#[must_use]
pub fn read_clusters(message: v1::Clusters) -> Clusters {
    let v1::Clusters { t: _, step: _, count, largest, singletons, mean_size } = message;
    Clusters { of: Vec::new(), count, largest, singletons, mean_size }
}

/// A message for people.
#[must_use]
pub fn notice(t: f64, step: u64, log_time: u64, notice: &Notice) -> foxglove::Log {
    let Notice { level, message } = notice;
    let level = match level {
        Level::Info => foxglove::log::Level::Info,
        Level::Warning => foxglove::log::Level::Warning,
        Level::Error => foxglove::log::Level::Error,
    };
    foxglove::Log {
        timestamp: Some(timestamp(log_time)),
        level: level.into(),
        message: message.clone(),
        name: "agglo".to_owned(),
        file: String::new(),
        line: 0,
        t,
        step,
    }
}

/// A message for people, read back; levels that agglo does not write count as the next louder one that it does.
#[must_use]
pub fn read_notice(message: foxglove::Log) -> Notice {
    use foxglove::log::Level as Found;
    let level = match message.level() {
        Found::Unknown | Found::Debug | Found::Info => Level::Info,
        Found::Warning => Level::Warning,
        Found::Error | Found::Fatal => Level::Error,
    };
    Notice { level, message: message.message }
}
