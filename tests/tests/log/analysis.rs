//! What is recomputed from a log: equal to what is recorded, to closed forms, to brute force; and what is falsified is
//! found.

use std::collections::BTreeMap;
use std::io::Cursor;

use agglo_core::state::Columns;
use agglo_record::channels::Topic;
use agglo_record::proto::agglo::v1;
use agglo_record::proto::foxglove;
use agglo_replay::analysis::{Analysis, CAUSES, Failed, Label, Options, Sink, StateRow, StepRow, Term, history};
use agglo_replay::{Log, Message, RawMessage};
use agglo_tests::{scene, shipped, shipped_scenes, with};
use serde_json::{Value, json};

use crate::verify::{changed, record, rewrite};

/// Rows of an analysis, kept.
#[derive(Default)]
struct Rows {
    states: Vec<StateRow>,
    steps: Vec<StepRow>,
}

impl Sink for Rows {
    fn step(&mut self, row: &StepRow) -> Result<(), Failed> {
        self.steps.push(*row);
        Ok(())
    }

    fn state(&mut self, row: &StateRow) -> Result<(), Failed> {
        self.states.push(row.clone());
        Ok(())
    }

    fn life(&mut self, _: &history::Life) -> Result<(), Failed> {
        Ok(())
    }
}

fn analyze(bytes: &[u8]) -> (Analysis, Rows) {
    let mut rows = Rows::default();
    let analysis = Log::new(Cursor::new(bytes)).unwrap().analyze(&Options::default(), &mut rows).unwrap();
    (analysis, rows)
}

/// Terms that disagree, with the step of the first difference.
fn disagreeing(analysis: &Analysis) -> Vec<(&'static str, u64)> {
    let first = |(term, comparison): (Term, &agglo_replay::analysis::Comparison)| {
        comparison.first.map(|first| (term.name(), first.step))
    };
    analysis.agreement.terms().filter_map(first).collect()
}

/// The shipped scenes, some tens of steps of each.
fn short_scenes() -> impl Iterator<Item = (String, Value)> {
    shipped_scenes().into_iter().map(|(name, value)| {
        let step = scene(&value).solver.step.limits().0;
        let duration = value["duration"].as_f64().unwrap().min(60.0 * step);
        (name, with(&value, &[("/duration", json!(duration))]))
    })
}

/// The sum of the absolute terms that the round-off of a value is measured by, from the recomputed rows.
fn scale(rows: &Rows, term: Term) -> f64 {
    let largest = |of: &dyn Fn(&StateRow) -> f64| rows.states.iter().map(of).fold(0.0, f64::max);
    match term {
        Term::Kinetic | Term::Thermal => largest(&|row| row.value(term).unwrap_or(0.0).abs()),
        _ => f64::INFINITY,
    }
}

#[test]
fn shipped_scenes_agree_with_themselves() {
    for (name, value) in short_scenes() {
        for (precision, bound) in [("f64", 1e-12), ("f32", 1e-6)] {
            let value = with(&value, &[("/record/precision", json!(precision))]);
            let (analysis, rows) = analyze(&record(&value));
            assert_eq!(disagreeing(&analysis), [], "{name} {precision}");
            assert!(analysis.lost.is_empty(), "{name}: {:?}", analysis.lost);
            assert_eq!(analysis.states, rows.states.len() as u64);
            for term in [Term::Kinetic, Term::Thermal] {
                let largest = analysis.agreement.of(term).largest.unwrap();
                // A single-precision velocity is off by 6e-8 of itself, so its square by 1.2e-7 at most.
                assert!(largest.size() <= bound * scale(&rows, term), "{name} {precision} {term:?}: {largest:?}");
                assert!(largest.tolerance <= bound * scale(&rows, term), "{name} {precision} {term:?}: {largest:?}");
            }
            // Everything the log says is compared, in every state.
            for term in [Term::Kinetic, Term::NearField, Term::ImpactLoss, Term::FrictionLoss, Term::ReactionHeat] {
                assert_eq!(analysis.agreement.of(term).compared, analysis.states, "{name} {term:?}");
            }
            let clusters = scene(&value).clusters.is_some() || value.get("binding").is_some();
            let expected = if clusters { analysis.states } else { 0 };
            for term in [Term::ClusterCount, Term::LargestCluster, Term::Singletons, Term::Cluster] {
                assert_eq!(analysis.agreement.of(term).compared, expected, "{name} {term:?}");
            }
        }
    }
}

#[test]
fn states_that_are_not_all_recorded_agree_too() {
    for record_every in [json!({ "every_steps": 7 }), json!({ "interval": 0.004 })] {
        let value = with(&shipped("clustering"), &[("/duration", json!(0.1)), ("/record", record_every.clone())]);
        let (analysis, rows) = analyze(&record(&value));
        assert_eq!(disagreeing(&analysis), [], "{record_every}");
        // Impacts and iterations are recorded for every step, so what they add up to is known at every state.
        assert_eq!(analysis.agreement.of(Term::ImpactLoss).compared, rows.states.len() as u64);
        assert!(rows.steps.len() >= 100 && rows.states.len() < 30, "{} {}", rows.steps.len(), rows.states.len());
    }
}

#[test]
fn every_nth_state_is_analysed_where_that_is_asked_for() {
    let bytes = record(&with(&shipped("clustering"), &[("/duration", json!(0.05))]));
    let (all, rows) = analyze(&bytes);
    let mut some = Rows::default();
    let analysis = Log::new(Cursor::new(&bytes)).unwrap().analyze(&Options { every: 10 }, &mut some).unwrap();
    assert_eq!(disagreeing(&analysis), []);
    assert_eq!(some.steps.len(), rows.steps.len());
    let steps: Vec<u64> = some.states.iter().map(|row| row.step).collect();
    assert_eq!(steps, [0, 10, 20, 30, 40, 50]);
    for row in &some.states {
        assert_eq!(row, rows.states.iter().find(|other| other.step == row.step).unwrap());
    }
    assert_eq!(analysis.impacts, all.impacts);
}

/// The clustering scene's first steps, in which all effects act.
fn busy() -> Vec<u8> {
    record(&with(&shipped("clustering"), &[("/duration", json!(0.04))]))
}

/// The log with one message's content changed.
fn with_edit<M: prost::Message + Default>(
    bytes: &[u8],
    topic: Topic,
    step: u64,
    mut change: impl FnMut(&mut M),
) -> Vec<u8> {
    let mut found = false;
    let edited = rewrite(bytes, |message: RawMessage| {
        let here = message.channel.topic == Some(topic) && message.key().is_some_and(|(_, of)| of == step);
        found |= here;
        vec![if here { changed(&message, |content: &mut M| change(content)) } else { message }]
    });
    assert!(found, "no message of {topic:?} at step {step}");
    edited
}

#[test]
fn a_falsified_ledger_is_found_term_by_term() {
    type Change = fn(&mut v1::EnergyLedger);
    // A millionth of a part, far above round-off and far below what anyone would see.
    let changes: [(&str, Change); 9] = [
        ("kinetic", |ledger| ledger.kinetic *= 1.0 + 1e-9),
        ("near_field", |ledger| ledger.near_field *= 1.0 + 1e-9),
        ("binding", |ledger| ledger.binding *= 1.0 + 1e-9),
        ("thermal", |ledger| ledger.thermal *= 1.0 + 1e-9),
        ("reaction_heat", |ledger| ledger.reaction_heat *= 1.0 + 1e-9),
        ("impact_loss", |ledger| ledger.impact_loss *= 1.0 + 1e-9),
        ("friction_loss", |ledger| ledger.friction_loss *= 1.0 + 1e-9),
        ("residual", |ledger| ledger.residual += 1.0),
        ("momentum", |ledger| ledger.momentum.as_mut().unwrap().y += 1e-6),
    ];
    let bytes = busy();
    for (name, change) in changes {
        let (analysis, _) = analyze(&with_edit(&bytes, Topic::Energy, 30, change));
        let found = disagreeing(&analysis);
        assert!(found.contains(&(name, 30)), "{name}: {found:?}");
        // Where a term is wrong the recorded residual does not fit either; nothing else is touched.
        assert!(found.iter().all(|(term, _)| *term == name || *term == "residual"), "{name}: {found:?}");
    }
}

#[test]
fn falsified_clusters_and_iterations_are_found() {
    let bytes = busy();
    let (analysis, _) = analyze(&with_edit(&bytes, Topic::Clusters, 11, |clusters: &mut v1::Clusters| {
        clusters.largest += 1;
    }));
    assert_eq!(disagreeing(&analysis), [("largest_cluster", 11)]);
    let (analysis, _) = analyze(&with_edit(&bytes, Topic::Diagnostics, 12, |step: &mut v1::StepDiagnostics| {
        step.bonds = step.bonds.map(|bonds| bonds - 1);
    }));
    assert_eq!(disagreeing(&analysis), [("bonds", 12)]);
    // The last column before the colours is the cluster of the particle.
    let (analysis, _) = analyze(&with_edit(&bytes, Topic::Particles, 13, |cloud: &mut foxglove::PointCloud| {
        let field = cloud.fields.iter().find(|field| field.name == "cluster").unwrap();
        cloud.data[5 * cloud.point_stride as usize + field.offset as usize] ^= 0x7f;
    }));
    assert_eq!(disagreeing(&analysis), [("cluster", 13)]);
}

#[test]
fn a_falsified_state_is_found() {
    // A particle moved by a billionth of its radius changes energies, though no eye would see it.
    let (analysis, _) = analyze(&with_edit(&busy(), Topic::Particles, 20, |cloud: &mut foxglove::PointCloud| {
        let at = 3 * cloud.point_stride as usize + 8;
        let bytes: &mut [u8] = &mut cloud.data[at..at + 8];
        let y = f64::from_le_bytes(bytes.as_ref().try_into().unwrap());
        bytes.copy_from_slice(&(y + 1e-6).to_le_bytes());
    }));
    let found = disagreeing(&analysis);
    assert!(found.contains(&("near_field", 20)) && found.contains(&("angular_momentum", 20)), "{found:?}");
    assert!(found.iter().all(|(_, step)| *step == 20), "{found:?}");
}

#[test]
fn a_falsified_impact_is_found() {
    let bytes = busy();
    let mut log = Log::new(Cursor::new(&bytes)).unwrap();
    let with_impacts = |message: &RawMessage| message.channel.topic == Some(Topic::Impacts);
    let step = log.raw_messages().map(Result::unwrap).find(with_impacts).unwrap().key().unwrap().1;
    let (analysis, _) = analyze(&with_edit(&bytes, Topic::Impacts, step, |impacts: &mut v1::Impacts| {
        impacts.events[0].normal_impulse *= 1.001;
    }));
    let found = disagreeing(&analysis);
    assert!(found.iter().any(|(term, _)| ["impact_loss", "friction_loss"].contains(term)), "{found:?}");
    // One that is left out is missing from every sum.
    let mut left_out = false;
    let fewer = rewrite(&bytes, |message| {
        let drop = !left_out && message.channel.topic == Some(Topic::Impacts);
        left_out |= drop;
        if drop { Vec::new() } else { vec![message] }
    });
    let (analysis, _) = analyze(&fewer);
    assert!(disagreeing(&analysis).iter().any(|(term, at)| *term == "reaction_heat" && *at == step));
}

#[test]
fn two_bodies_by_their_closed_forms() {
    let (attraction, repulsion, mass) = (0.5, 0.25, [2.0, 3.0]);
    let value = json!({
        "duration": 0.4, "solver": { "step": { "fixed": 1e-2 } },
        "particles": { "list": [
            { "position": [0.1, 0.2, 0.3], "velocity": [0, 0.2, 0], "radius": 0.05, "mass": mass[0] },
            { "position": [0.7, 0.1, 0.5], "velocity": [0.1, 0, 0.3], "radius": 0.05, "mass": mass[1] }
        ] },
        "near_field": {
            "attraction": { "strength": attraction, "exponent": 1 },
            "repulsion": { "strength": repulsion, "exponent": 2.5 }
        }
    });
    let bytes = record(&value);
    let (analysis, rows) = analyze(&bytes);
    assert_eq!(disagreeing(&analysis), []);
    let mut frames = BTreeMap::new();
    for entry in Log::new(Cursor::new(&bytes)).unwrap().messages().only(&[Topic::Particles]) {
        if let Message::Particles(frame) = entry.unwrap().message {
            frames.insert(frame.step, frame);
        }
    }
    for row in &rows.states {
        let frame = &frames[&row.step];
        let s = (frame.position.get(1) - frame.position.get(0)).norm();
        // Integrals of (2): alpha_1 ln s, and alpha_2 s^(1 - beta_2) / (beta_2 - 1).
        let near_field = attraction * s.ln() + repulsion * s.powf(-1.5) / 1.5;
        let kinetic: f64 = (0..2).map(|i| 0.5 * mass[i] * frame.velocity.get(i).norm_squared()).sum();
        let momentum = mass[0] * frame.velocity.get(0) + mass[1] * frame.velocity.get(1);
        // Some roundings of numbers of order one.
        assert!((row.ledger.near_field - near_field).abs() < 1e-14, "{} {near_field}", row.ledger.near_field);
        assert!((row.ledger.kinetic - kinetic).abs() < 1e-15, "{} {kinetic}", row.ledger.kinetic);
        for k in 0..3 {
            assert!((row.momentum[k] - momentum[k]).abs() < 1e-15);
        }
    }
}

/// Clusters of two or more by comparing all pairs, with the periodic box of `side`, if any: sizes, largest first.
fn clusters_by_brute_force(r: &Columns, radius: &[f64], range: f64, side: Option<f64>) -> Vec<usize> {
    let n = radius.len();
    let mut of: Vec<usize> = (0..n).collect();
    for i in 0..n {
        for j in 0..i {
            let mut d = r.get(i) - r.get(j);
            if let Some(side) = side {
                d.iter_mut().for_each(|x| *x -= side * (*x / side).round());
            }
            if d.norm() <= range * (radius[i] + radius[j]) && of[i] != of[j] {
                let (from, to) = (of[i], of[j]);
                of.iter_mut().filter(|of| **of == from).for_each(|of| *of = to);
            }
        }
    }
    let mut sizes = vec![0; n];
    of.iter().for_each(|&root| sizes[root] += 1);
    sizes.retain(|&size| size > 1);
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes
}

#[test]
fn clusters_by_cells_are_those_of_all_pairs() {
    let mut numbers = crate::story::Numbers::new(5);
    for (periodic, n, range) in [(false, 300, 1.3), (true, 300, 1.3), (false, 40, 3.0), (true, 600, 1.1)] {
        let radius: Vec<f64> = (0..n).map(|_| 0.02 + 0.015 * numbers.next()).collect();
        // Far enough from each other that none overlap.
        let mut position: Vec<[f64; 3]> = Vec::new();
        while position.len() < n {
            let new = numbers.three().map(|x| 0.5 * x);
            let apart = |(k, old): (usize, &[f64; 3])| {
                let mut d: [f64; 3] = std::array::from_fn(|axis| new[axis] - old[axis]);
                d.iter_mut().for_each(|x| *x -= x.round());
                d.iter().map(|x| x * x).sum::<f64>().sqrt() > radius[k] + radius[position.len()]
            };
            if position.iter().enumerate().all(apart) {
                position.push(new);
            }
        }
        let list: Vec<Value> = position
            .iter()
            .zip(&radius)
            .map(|(position, radius)| json!({ "position": position, "radius": radius, "mass": 1 }))
            .collect();
        let mut value = json!({
            "duration": 1e-3, "solver": { "step": { "fixed": 1e-3 } },
            "particles": { "list": list }, "clusters": { "range": range }
        });
        if periodic {
            value["domain"] = json!({ "periodic": [1, 1, 1] });
        }
        let bytes = record(&value);
        let (analysis, rows) = analyze(&bytes);
        assert_eq!(disagreeing(&analysis), []);
        let mut r = Columns::zeros(0);
        position.iter().for_each(|&row| r.push(row));
        let expected = clusters_by_brute_force(&r, &radius, range, periodic.then_some(1.0));
        assert!(expected.len() > 3, "{expected:?}");
        let found = rows.states[0].clusters.as_ref().unwrap();
        let sizes: Vec<usize> =
            found.sizes.iter().rev().flat_map(|(&size, &count)| vec![size as usize; count as usize]).collect();
        assert_eq!(sizes, expected, "periodic {periodic}, {n}");
        assert_eq!(found.largest as usize, expected[0]);
        assert_eq!(found.singletons as usize, n - expected.iter().sum::<usize>());
    }
}

#[test]
fn radii_of_gyration_of_a_dumbbell_and_of_one_across_the_box() {
    // Two of unlike mass, d apart: sqrt(m1 m2) / (m1 + m2) d.
    let (d, m) = (0.09, [1.0_f64, 3.0]);
    let expected = (m[0] * m[1]).sqrt() / (m[0] + m[1]) * d;
    for x in [0.0, 0.46] {
        let other = if x + d > 0.5 { x + d - 1.0 } else { x + d };
        let value = json!({
            "duration": 1e-3, "solver": { "step": { "fixed": 1e-3 } },
            "particles": { "list": [
                { "position": [x, 0, 0], "radius": 0.04, "mass": m[0] },
                { "position": [other, 0, 0], "radius": 0.04, "mass": m[1] }
            ] },
            "clusters": { "range": 1.2 },
            "domain": { "periodic": [1, 1, 1] }
        });
        let (_, rows) = analyze(&record(&value));
        let found = rows.states[0].clusters.as_ref().unwrap();
        assert_eq!((found.count, found.largest), (1, 2));
        // Wrapped coordinates are rounded at 1/2, 1e-16.
        assert!((found.gyration_of_largest - expected).abs() < 1e-15, "{}", found.gyration_of_largest);
        assert_eq!(found.mean_gyration, found.gyration_of_largest);
    }
}

#[test]
fn heat_from_both_ways_of_giving_it_off_is_a_quadrature_with_an_error() {
    let value = json!({
        "duration": 0.5, "solver": { "step": { "fixed": 1e-2 } },
        "particles": { "list": [{ "position": [0, 0, 0], "radius": 0.1, "density": 10, "temperature": 1000 }] },
        "thermal": {
            "heat_capacity": 100,
            "radiation": { "emissivity": 0.9, "surroundings": 300 },
            "convection": { "coefficient": 20, "ambient": 290 }
        }
    });
    let (analysis, rows) = analyze(&record(&value));
    assert_eq!(disagreeing(&analysis), []);
    for term in [Term::Radiated, Term::Convected] {
        let comparison = analysis.agreement.of(term);
        assert_eq!(comparison.label, Label::Quadrature);
        assert_eq!(comparison.compared, rows.states.len() as u64);
        let last = rows.states.last().unwrap().value(term).unwrap();
        // The bound must say something: far below the value itself.
        assert!(comparison.largest.unwrap().tolerance < 1e-2 * last, "{term:?}: {comparison:?} of {last}");
    }
    // What is lost in total follows from the thermal energy alone.
    let [first, last] = [&rows.states[0].ledger, &rows.states.last().unwrap().ledger];
    let lost = last.totals.radiated + last.totals.convected;
    assert!((first.thermal - last.thermal - lost).abs() < 1e-9 * lost);
}

#[test]
fn iterations_are_those_of_the_run() {
    let value = with(&shipped("clustering"), &[("/duration", json!(0.05))]);
    let (steps, outcome) = agglo_tests::record(&scene(&value));
    let (analysis, rows) = analyze(&record(&value));
    let iterations = &analysis.iterations;
    assert_eq!(iterations.total, outcome.counters.iterations);
    assert_eq!(iterations.histogram.values().sum::<u64>(), outcome.counters.steps);
    let weighted: u64 = iterations.histogram.iter().map(|(&count, &steps)| count * steps).sum();
    assert_eq!(weighted, outcome.counters.iterations);
    assert_eq!(analysis.impacts, outcome.counters.impacts);
    for (row, step) in rows.steps.iter().zip(&steps[1..]) {
        let diagnostics = step.diagnostics.as_ref().unwrap();
        assert_eq!((row.dt, row.iterations), (diagnostics.dt, diagnostics.iterations()));
        assert_eq!(row.impacts as usize, step.impacts.len());
    }
}

#[test]
fn rejected_attempts_are_counted_by_cause() {
    let far = with(
        &shipped("head-on-impact"),
        &[("/solver", json!({ "step": { "initial": 0.2, "max": 0.2 } })), ("/contact/resolution", json!("step"))],
    );
    let coarse = with(
        &shipped("two-body-oscillator"),
        &[(
            "/solver",
            json!({
                "integrator": "velocity-verlet", "step": { "initial": 1.0, "max": 1.0 }, "tolerance": { "position": 1e-5 }
            }),
        )],
    );
    for (value, cause) in [(far, "travel"), (coarse, "local_error")] {
        let (_, outcome) = agglo_tests::record(&scene(&value));
        let (analysis, rows) = analyze(&record(&value));
        let counted = analysis.iterations.rejected_total();
        assert!(counted > 0 && counted == outcome.counters.rejected_steps, "{cause}: {counted}");
        let at = CAUSES.iter().position(|name| *name == cause).unwrap();
        assert!(analysis.iterations.rejected[at] > 0, "{cause}: {:?}", analysis.iterations.rejected);
        assert_eq!(rows.steps.iter().map(|row| row.rejected).sum::<u64>(), counted);
    }
}
