//! An analysis as one JSON object. Its long arrays wait in temporary files until what stands before them is known.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Seek, Write};

use agglo_replay::analysis::history::{End, Life};
use agglo_replay::analysis::{Analysis, CAUSES, Comparison, Difference, Spread, StateRow, StepRow, Term};
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

use crate::args::AnalyzeArgs;
use crate::numbers::exact;

/// A number that reads back to the same one; JSON has none for those that are not finite, which are strings.
#[derive(Clone, Copy)]
struct Number(f64);

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0.is_finite() { serializer.serialize_f64(self.0) } else { exact(self.0).serialize(serializer) }
    }
}

#[derive(Serialize)]
struct EnergyRow {
    t: Number,
    step: u64,
    kinetic: Number,
    near_field: Number,
    binding: Number,
    external: Number,
    thermal: Number,
    reaction_heat: Number,
    radiated: Number,
    convected: Number,
    impact_loss: Number,
    friction_loss: Number,
    resting_loss: Number,
    periodic_work: Number,
    residual: Number,
    momentum: [Number; 3],
    angular_momentum: [Number; 3],
}

#[derive(Serialize)]
struct ClusterRow<'a> {
    t: Number,
    step: u64,
    count: u32,
    largest: u32,
    singletons: u32,
    mean_size: Number,
    sizes: &'a BTreeMap<u32, u32>,
    bonds: u64,
    radius_of_gyration: Radii,
}

#[derive(Serialize)]
struct Radii {
    mean: Number,
    largest: Number,
}

#[derive(Serialize)]
struct TemperatureRow {
    t: Number,
    step: u64,
    mean: Number,
    min: Number,
    max: Number,
}

#[derive(Serialize)]
struct HistoryRow {
    t: Number,
    step: u64,
    dt: Number,
    iterations: u64,
    rejected: u64,
    contraction: Option<Number>,
    impacts: u64,
}

#[derive(Serialize)]
struct LifeRow {
    id: u64,
    from: Number,
    to: Number,
    end: &'static str,
    from_start: bool,
    largest: u32,
}

/// How a cluster ended, in a word.
pub fn ending(end: End) -> &'static str {
    match end {
        End::Merged => "merged",
        End::Dispersed => "dispersed",
        End::Lasts => "lasts",
    }
}

/// An array that waits in a temporary file.
struct Spool {
    file: BufWriter<File>,
    rows: u64,
}

impl Spool {
    fn new() -> io::Result<Self> {
        Ok(Self { file: BufWriter::with_capacity(1 << 16, tempfile::tempfile()?), rows: 0 })
    }

    fn push(&mut self, row: &impl Serialize) -> io::Result<()> {
        self.file.write_all(if self.rows == 0 { b"\n    " } else { b",\n    " })?;
        self.rows += 1;
        Ok(serde_json::to_writer(&mut self.file, row)?)
    }

    fn pour(self, name: &str, last: bool, to: &mut dyn Write) -> io::Result<()> {
        write!(to, "  \"{name}\": [")?;
        let empty = self.rows == 0;
        let mut file = self.file.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.rewind()?;
        io::copy(&mut BufReader::with_capacity(1 << 16, file), to)?;
        writeln!(to, "{}]{}", if empty { "" } else { "\n  " }, if last { "" } else { "," })
    }
}

/// The rows of an analysis.
pub struct Json {
    energy: Spool,
    clusters: Spool,
    temperature: Spool,
    steps: Spool,
    lives: Spool,
}

impl Json {
    /// Without rows yet.
    ///
    /// # Errors
    /// No temporary files can be made.
    pub fn new() -> io::Result<Self> {
        let [energy, clusters, temperature, steps, lives] =
            [Spool::new()?, Spool::new()?, Spool::new()?, Spool::new()?, Spool::new()?];
        Ok(Self { energy, clusters, temperature, steps, lives })
    }

    /// Takes a step.
    ///
    /// # Errors
    /// A temporary file that cannot be written.
    pub fn step(&mut self, row: &StepRow) -> io::Result<()> {
        let StepRow { t, step, dt, iterations, rejected, contraction, impacts } = *row;
        let contraction = (!contraction.is_nan()).then_some(Number(contraction));
        self.steps.push(&HistoryRow { t: Number(t), step, dt: Number(dt), iterations, rejected, contraction, impacts })
    }

    /// Takes a state.
    ///
    /// # Errors
    /// A temporary file that cannot be written.
    pub fn state(&mut self, row: &StateRow) -> io::Result<()> {
        let StateRow { t, step, ledger, momentum, angular_momentum, temperature, clusters } = row;
        let (t, step, totals) = (Number(*t), *step, &ledger.totals);
        self.energy.push(&EnergyRow {
            t,
            step,
            kinetic: Number(ledger.kinetic),
            near_field: Number(ledger.near_field),
            binding: Number(ledger.binding),
            external: Number(ledger.external),
            thermal: Number(ledger.thermal),
            reaction_heat: Number(totals.reaction_heat),
            radiated: Number(totals.radiated),
            convected: Number(totals.convected),
            impact_loss: Number(totals.impact_loss),
            friction_loss: Number(totals.friction_loss),
            resting_loss: Number(totals.resting_loss),
            periodic_work: Number(totals.periodic_work),
            residual: Number(ledger.residual),
            momentum: momentum.map(Number),
            angular_momentum: angular_momentum.map(Number),
        })?;
        if let Some(found) = clusters {
            self.clusters.push(&ClusterRow {
                t,
                step,
                count: found.count,
                largest: found.largest,
                singletons: found.singletons,
                mean_size: Number(found.mean_size),
                sizes: &found.sizes,
                bonds: found.bonds,
                radius_of_gyration: Radii {
                    mean: Number(found.mean_gyration),
                    largest: Number(found.gyration_of_largest),
                },
            })?;
        }
        if let Some(found) = temperature {
            let (mean, min, max) = (Number(found.mean), Number(found.min), Number(found.max));
            self.temperature.push(&TemperatureRow { t, step, mean, min, max })?;
        }
        Ok(())
    }

    /// Takes a cluster that ended.
    ///
    /// # Errors
    /// A temporary file that cannot be written.
    pub fn life(&mut self, life: &Life) -> io::Result<()> {
        let Life { id, born, from_start, ended, end, largest } = *life;
        let (from, to) = (Number(born), Number(ended));
        self.lives.push(&LifeRow { id, from, to, end: ending(end), from_start, largest })
    }

    /// Writes the whole object.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn finish(self, args: &AnalyzeArgs, analysis: &Analysis, to: &mut dyn Write) -> io::Result<()> {
        writeln!(to, "{{")?;
        for (key, value) in &head(args, analysis) {
            writeln!(to, "  {}: {value},", Value::from(key.as_str()))?;
        }
        self.energy.pour("energy", false, to)?;
        self.clusters.pour("clusters", false, to)?;
        self.temperature.pour("temperature", false, to)?;
        self.steps.pour("step_history", false, to)?;
        self.lives.pour("cluster_lives", true, to)?;
        writeln!(to, "}}")
    }
}

/// Everything but the long arrays.
fn head(args: &AnalyzeArgs, analysis: &Analysis) -> Map<String, Value> {
    let run = &analysis.run;
    let found = &analysis.iterations;
    let lost = &analysis.lost;
    let mean = |mean: f64| if found.steps == 0 { Value::Null } else { exact(mean) };
    let histogram: Map<String, Value> =
        found.histogram.iter().map(|(k, steps)| (k.to_string(), json!(steps))).collect();
    let by_cause: Map<String, Value> =
        CAUSES.iter().zip(found.rejected).map(|(cause, count)| ((*cause).to_owned(), json!(count))).collect();
    let damage: Vec<Value> =
        lost.damage.iter().map(|damage| json!({ "offset": damage.offset, "what": damage.what })).collect();
    let agreement: Map<String, Value> =
        analysis.agreement.terms().map(|(term, found)| (term.name().to_owned(), comparison(term, found))).collect();
    let history = analysis.clusters.as_ref().map(|counts| {
        json!({
            "mergers": counts.mergers, "break_ups": counts.break_ups, "formed": counts.formed,
            "lifetimes": {
                "ended": counts.merged + counts.dispersed, "merged": counts.merged, "dispersed": counts.dispersed,
                "lasting": counts.lasting, "mean": counts.mean_lifetime().map(exact), "longest": exact(counts.longest),
            },
        })
    });
    let object = json!({
        "format": 1, "file": args.log.display().to_string(),
        "scene": { "name": run.scene_name, "hash": run.scene_hash },
        "model": run.model, "seed": run.seed, "particles": run.particles,
        "damaged": !lost.is_empty(), "damage": damage, "missing": lost.gaps,
        "more_damage": lost.more + lost.more_gaps,
        "agrees": analysis.agreement.agrees(), "agreement": agreement,
        "end": { "t": exact(analysis.end.1), "step": analysis.end.0 }, "duration": exact(analysis.duration),
        "steps": found.steps,
        "states": { "recorded": analysis.recorded_states, "analysed": analysis.states, "every": args.every },
        "iterations": { "total": found.total, "mean": mean(found.mean()), "max": found.max, "histogram": histogram },
        "rejected_steps": {
            "total": found.rejected_total(), "by_cause": by_cause, "iterations": found.wasted,
        },
        "step_size": spread(&found.step_size), "contraction": spread(&found.contraction),
        "pairs_evaluated": found.pairs_evaluated,
        "impacts": analysis.impacts, "warnings": analysis.warnings, "cluster_history": history,
    });
    match object {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

fn spread(spread: &Spread) -> Value {
    let value = |value: f64| if spread.count == 0 { Value::Null } else { exact(value) };
    json!({
        "count": spread.count, "min": value(spread.min), "mean": value(spread.mean()), "max": value(spread.max),
    })
}

fn comparison(term: Term, found: &Comparison) -> Value {
    let place = |difference: &Difference| {
        let mut object = json!({
            "t": exact(difference.t), "step": difference.step, "recorded": exact(difference.recorded),
            "recomputed": exact(difference.recomputed), "difference": exact(difference.size()),
            "tolerance": exact(difference.tolerance),
        });
        if let Some(index) = difference.index {
            object["index"] = json!(index);
        }
        object
    };
    let largest = found.largest.as_ref();
    json!({
        "label": found.label.text(), "unit": term.unit(), "channel": term.channel(), "compared": found.compared,
        "agrees": found.agrees(),
        "largest_difference": largest.map(|difference| exact(difference.size())),
        "tolerance": largest.map(|difference| exact(difference.tolerance)),
        "at": largest.map(place), "first": found.first.as_ref().map(place),
    })
}
