//! Checkpoints to messages and back, to the bit.

use agglo_core::checkpoint::{Checkpoint, Counters};
use agglo_core::collocation::Carried;
use agglo_core::ledger::{Momentum, Totals};
use agglo_core::state::{Columns, State};

use super::Malformed;
use crate::proto::agglo::v1;

fn columns(columns: &Columns) -> Option<v1::Columns> {
    let Columns { x, y, z } = columns;
    Some(v1::Columns { x: x.clone(), y: y.clone(), z: z.clone() })
}

/// All that is needed to go on.
#[must_use]
pub fn checkpoint(checkpoint: &Checkpoint) -> v1::Checkpoint {
    let Checkpoint {
        time,
        time_rest,
        step,
        next_dt,
        state: State { position, velocity, temperature },
        acceleration,
        list_positions,
        totals,
        initial_energy,
        initial_momentum,
        counters,
        notices_given,
        collocation,
        origin,
    } = checkpoint;
    let Totals {
        reaction_heat,
        convected,
        radiated,
        impact_loss,
        friction_loss,
        resting_loss,
        periodic_work,
        outside_impulse,
    } = *totals;
    let Momentum { linear, angular, residual } = *initial_momentum;
    let Counters {
        steps,
        iterations,
        rejected_steps,
        impacts,
        pair_evaluations,
        intervals,
        max_overlap,
        largest_momentum,
    } = *counters;
    v1::Checkpoint {
        t: *time,
        time_rest: Some(*time_rest),
        step: *step,
        next_dt: *next_dt,
        position: columns(position),
        velocity: columns(velocity),
        temperature: temperature.as_ref().map(|values| v1::Column { values: values.clone() }),
        acceleration: columns(acceleration),
        list_positions: columns(list_positions),
        totals: Some(v1::CheckpointTotals {
            reaction_heat: Some(reaction_heat),
            convected: Some(convected),
            radiated: Some(radiated),
            impact_loss: Some(impact_loss),
            friction_loss: Some(friction_loss),
            resting_loss: Some(resting_loss),
            periodic_work: Some(periodic_work),
            outside_impulse: outside_impulse.to_vec(),
        }),
        initial_energy: Some(*initial_energy),
        initial_momentum: Some(v1::CheckpointMomentum {
            linear: linear.to_vec(),
            angular: angular.to_vec(),
            residual: Some(residual),
        }),
        counters: Some(v1::Counters {
            steps,
            iterations,
            rejected_steps,
            impacts,
            pair_evaluations,
            intervals,
            max_overlap: Some(max_overlap),
            largest_momentum: Some(largest_momentum),
        }),
        notices_given: *notices_given,
        carried: collocation.as_ref().map(carried),
        origin: if *origin == [0.0; 3] { Vec::new() } else { origin.to_vec() },
    }
}

fn carried(carried: &Carried) -> v1::Carried {
    let Carried { dt, accelerations, position_rest, velocity_rest } = carried;
    v1::Carried {
        dt: Some(*dt),
        accelerations: accelerations.iter().filter_map(columns).collect(),
        position_rest: columns(position_rest),
        velocity_rest: columns(velocity_rest),
    }
}

fn read_carried(message: v1::Carried) -> Result<Carried, Malformed> {
    let v1::Carried { dt, accelerations, position_rest, velocity_rest } = message;
    Ok(Carried {
        dt: dt.ok_or_else(|| Malformed("a checkpoint without its last step's length".to_owned()))?,
        accelerations: (accelerations.into_iter())
            .map(|columns| read_columns(Some(columns), "accelerations at collocation points"))
            .collect::<Result<_, _>>()?,
        position_rest: read_columns(position_rest, "rests of positions")?,
        velocity_rest: read_columns(velocity_rest, "rests of velocities")?,
    })
}

fn read_columns(message: Option<v1::Columns>, what: &str) -> Result<Columns, Malformed> {
    let v1::Columns { x, y, z } = message.unwrap_or_default();
    if x.len() != y.len() || x.len() != z.len() {
        let lengths = [x.len(), y.len(), z.len()];
        return Err(Malformed(format!("a checkpoint whose {what} have columns of the lengths {lengths:?}")));
    }
    Ok(Columns { x, y, z })
}

fn three(values: &[f64], what: &str) -> Result<[f64; 3], Malformed> {
    values.try_into().map_err(|_| Malformed(format!("a checkpoint whose {what} has {} components", values.len())))
}

/// All that is needed to go on, read back to the bit.
///
/// # Errors
/// Columns of unequal length, parts that are missing.
pub fn read_checkpoint(message: v1::Checkpoint) -> Result<Checkpoint, Malformed> {
    let v1::Checkpoint {
        t,
        time_rest,
        step,
        next_dt,
        position,
        velocity,
        temperature,
        acceleration,
        list_positions,
        totals,
        initial_energy,
        initial_momentum,
        counters,
        notices_given,
        carried,
        origin,
    } = message;
    let missing = |what: &str| Malformed(format!("a checkpoint without its {what}"));
    let position = read_columns(position, "positions")?;
    let velocity = read_columns(velocity, "velocities")?;
    let acceleration = read_columns(acceleration, "accelerations")?;
    let list_positions = read_columns(list_positions, "list positions")?;
    let temperature = temperature.map(|v1::Column { values }| values);
    let n = position.len();
    let optional = [acceleration.len(), list_positions.len()];
    if velocity.len() != n
        || temperature.as_ref().is_some_and(|values| values.len() != n)
        || optional.iter().any(|&length| length != 0 && length != n)
    {
        return Err(Malformed(format!("a checkpoint whose columns do not all hold its {n} particles")));
    }
    let v1::CheckpointTotals {
        reaction_heat,
        convected,
        radiated,
        impact_loss,
        friction_loss,
        resting_loss,
        periodic_work,
        outside_impulse,
    } = totals.ok_or_else(|| missing("totals"))?;
    let v1::CheckpointMomentum { linear, angular, residual } =
        initial_momentum.ok_or_else(|| missing("initial momentum"))?;
    let v1::Counters {
        steps,
        iterations,
        rejected_steps,
        impacts,
        pair_evaluations,
        intervals,
        max_overlap,
        largest_momentum,
    } = counters.ok_or_else(|| missing("counters"))?;
    Ok(Checkpoint {
        time: t,
        time_rest: time_rest.ok_or_else(|| missing("rest of the time"))?,
        step,
        next_dt,
        state: State { position, velocity, temperature },
        acceleration,
        list_positions,
        totals: Totals {
            reaction_heat: reaction_heat.ok_or_else(|| missing("reaction heat"))?,
            convected: convected.ok_or_else(|| missing("convected heat"))?,
            radiated: radiated.ok_or_else(|| missing("radiated heat"))?,
            impact_loss: impact_loss.ok_or_else(|| missing("impact loss"))?,
            friction_loss: friction_loss.ok_or_else(|| missing("friction loss"))?,
            resting_loss: resting_loss.ok_or_else(|| missing("resting loss"))?,
            periodic_work: periodic_work.ok_or_else(|| missing("periodic work"))?,
            outside_impulse: three(&outside_impulse, "outside impulse")?,
        },
        initial_energy: initial_energy.ok_or_else(|| missing("initial energy"))?,
        initial_momentum: Momentum {
            linear: three(&linear, "initial momentum")?,
            angular: three(&angular, "initial angular momentum")?,
            residual: residual.ok_or_else(|| missing("initial momentum residual"))?,
        },
        counters: Counters {
            steps,
            iterations,
            rejected_steps,
            impacts,
            pair_evaluations,
            intervals,
            max_overlap: max_overlap.ok_or_else(|| missing("deepest overlap"))?,
            largest_momentum: largest_momentum.ok_or_else(|| missing("largest momentum"))?,
        },
        notices_given,
        origin: if origin.is_empty() { [0.0; 3] } else { three(&origin, "origin")? },
        collocation: carried.map(read_carried).transpose()?,
    })
}
