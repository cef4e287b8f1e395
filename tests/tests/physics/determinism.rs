//! Same bits for every number of threads, for a run in two halves, and whoever watches.

use agglo_core::checkpoint::Checkpoint;
use agglo_core::observer::ObserverError;
use agglo_core::{Flow, Observer, Outcome, Simulation, StepReport};
use agglo_tests::{Watch, bits, run, scene, shipped, with};
use serde_json::{Value, json};

/// A cloud with every effect at once; the near field reaches everyone or, with lists, only neighbours.
fn cloud(count: u32, side: f64, cutoff: Value) -> Value {
    json!({
        "seed": 3, "duration": 0.05,
        "particles": { "random_cube": {
            "count": count, "side": side, "radius": 0.02, "density": 2000.0, "temperature": 300.0,
            "velocity_mean": [0.5, 0.0, 0.0], "velocity_spread": [1.0, 1.0, 1.0], "charge": [1e-3, -2e-3]
        } },
        "near_field": {
            "attraction": { "strength": 5e2, "exponent": 1.3, "weight": "charge-product" },
            "repulsion": { "strength": 1e-5, "exponent": 2.0 }, "cutoff": cutoff
        },
        "binding": { "strength": 1e-3, "exponent": 1.0, "range": 1.5 },
        "contact": {
            "restitution": { "e0": 0.8, "v_star": 10.0, "theta_star": 3000.0 },
            "friction": { "static": 0.3, "dynamic": 0.2 }, "duration": { "seconds": 1e-5 }
        },
        "thermal": {
            "heat_capacity": 1000.0, "radiation": { "emissivity": 0.5, "surroundings": 250.0 },
            "convection": { "coefficient": 10.0, "ambient": 280.0 },
            "reaction": { "energy_per_area": 1e5, "force_scale": 100.0 }
        },
        "external": { "gravity": [0.0, 0.0, -9.81], "electric_field": [100.0, 0.0, 0.0] },
        "solver": { "step": { "initial": 2e-4, "max": 1e-3 } }
    })
}

/// Everything that is reported, to compare bit for bit (`Debug` of an f64 is exact, and tells NaN from NaN not at all).
fn trace(value: &Value) -> Vec<(Vec<u64>, String)> {
    let mut trace = Vec::new();
    run(&scene(value), |report| {
        trace.push((bits(report.state), format!("{:?}{:?}{:?}", report.diagnostics, report.impacts, report.sample)));
    });
    trace
}

fn threads<T: Send>(number: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(number).build().unwrap().install(work)
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    for (what, value) in [
        // 600 * 599 ordered pairs: beyond the 100 000 from which rows are shared out.
        ("all pairs", with(&cloud(600, 1.0, json!("none")), &[("/duration", json!(0.01))])),
        ("lists", cloud(3000, 2.0, json!(0.18))),
        // Collocation begins anew at every crossing of the cut-off, and here there are very many.
        (
            "gauss-legendre",
            with(
                &cloud(3000, 2.0, json!(0.18)),
                &[("/solver/integrator", json!("gauss-legendre")), ("/duration", json!(1e-4))],
            ),
        ),
        (
            "lists, periodic",
            with(&cloud(3000, 2.0, json!(0.18)), &[("/domain", json!({ "periodic": [2.1, null, 2.1] }))]),
        ),
        ("hard spheres", with(&shipped("free-cooling-gas"), &[("/duration", json!(1.0))])),
    ] {
        let one = threads(1, || trace(&value));
        assert!(one.len() > 10, "{what}: {} steps", one.len());
        assert!(one.iter().any(|(_, text)| text.contains("Impact {")), "{what}: no impact");
        for number in [2, 3, 4] {
            let several = threads(number, || trace(&value));
            assert_eq!(one.len(), several.len(), "{what}: {number} threads");
            let different = one.iter().zip(&several).position(|(a, b)| a != b);
            assert_eq!(different, None, "{what}: first different step with {number} threads");
        }
    }
}

/// A periodic fluid, its cut-off switched, jumping, or of other exponents: laws of their own in lists.
#[test]
fn any_number_of_threads_gives_the_same_fluid() {
    let fluid = |exponents: [f64; 2], switch: Value| {
        let atoms: Vec<Value> = (0..2744_u32)
            .map(|k| {
                let site = [k % 14, k / 14 % 14, k / 196].map(|c| 1.1 * f64::from(c) + 0.3);
                let speed = f64::from(k % 7) - 3.0;
                json!({ "position": site, "velocity": [speed, -speed, 0.5 * speed], "radius": 0.5, "mass": 1.0 })
            })
            .collect();
        let mut near = json!({
            "attraction": { "strength": 24.0, "exponent": exponents[0] },
            "repulsion": { "strength": 48.0, "exponent": exponents[1] }, "weight": "none", "cutoff": 2.5
        });
        if switch.is_number() {
            near["switch_from"] = switch;
        }
        json!({
            "duration": 0.1, "particles": { "list": atoms }, "near_field": near,
            "domain": { "periodic": [15.4, 15.4, 15.4] },
            "solver": { "integrator": "velocity-verlet", "crossings": "ignored", "step": { "fixed": 0.005 } }
        })
    };
    for (exponents, switch) in [([7.0, 13.0], json!(null)), ([7.0, 13.0], json!(2.3)), ([6.3, 12.1], json!(null))] {
        let value = fluid(exponents, switch);
        let one = threads(1, || trace(&value));
        assert_eq!(one.len(), 21, "{exponents:?}");
        for number in [2, 4] {
            assert!(one == threads(number, || trace(&value)), "{exponents:?}: {number} threads");
        }
    }
}

/// The scene with lists really has them, else half of the test above is empty.
#[test]
fn the_scenes_above_take_the_paths_they_are_meant_for() {
    use agglo_core::neighbor::Neighbors;
    for (value, listed) in [(cloud(600, 1.0, json!("none")), false), (cloud(3000, 2.0, json!(0.18)), true)] {
        let scene = scene(&value);
        let (particles, state) = agglo_core::placement::place(&scene).unwrap();
        let model = agglo_core::assembly::Model::new(&scene, &particles, &state.position);
        let field = model.field.unwrap();
        assert_eq!(matches!(field.neighbors, Neighbors::List(_)), listed);
    }
}

/// Keeps the last checkpoint before a time, and all that follows it.
#[derive(Default)]
struct Halves {
    until: f64,
    checkpoint: Option<Checkpoint>,
    after: Vec<(u64, Vec<u64>, String)>,
}

impl Observer for Halves {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        // A resumed run knows of no notices given before.
        let text = format!("{:?}{:?}{:?}", report.diagnostics, report.impacts, report.sample);
        self.after.push((report.step, bits(report.state), text));
        if let Some(checkpoint) = report.checkpoint.filter(|_| report.time <= self.until) {
            self.checkpoint = Some(checkpoint.clone());
            self.after.clear();
        }
        Ok(Flow::Continue)
    }
}

fn halves(value: &Value) -> (Halves, Outcome, f64) {
    let scene = scene(value);
    let mut whole = Halves { until: 0.5 * scene.duration, ..Halves::default() };
    let outcome = agglo_tests::start(&scene).run(&mut whole).unwrap();
    (whole, outcome, scene.duration)
}

#[test]
fn a_run_in_two_halves_is_the_same_run() {
    let every = |value: &Value, steps: u64| with(value, &[("/record/checkpoint_every", json!(steps))]);
    let interval = |value: Value, seconds: f64| {
        let mut value = value;
        value["record"] = json!({ "interval": seconds, "checkpoint_every": 7 });
        value
    };
    for (what, value) in [
        ("paper, binding", every(&shipped("paper-binding-2e6"), 50)),
        ("paper, by interval", interval(with(&shipped("paper-binding-8e6"), &[("/duration", json!(1.0))]), 0.013)),
        ("consistent, all pairs", every(&cloud(150, 0.7, json!("none")), 10)),
        ("consistent, lists", every(&cloud(1500, 1.6, json!(0.18)), 10)),
        ("lists, by interval, periodic", {
            let value = with(&cloud(1500, 1.6, json!(0.18)), &[("/domain", json!({ "periodic": [1.7, 1.7, 1.7] }))]);
            interval(value, 0.0031)
        }),
        (
            "trapezoidal",
            every(&with(&cloud(150, 0.7, json!("none")), &[("/solver/integrator", json!("trapezoidal"))]), 10),
        ),
        (
            "gauss-radau",
            every(&with(&cloud(150, 0.7, json!("none")), &[("/solver/integrator", json!("gauss-radau"))]), 10),
        ),
        // Collocation begins anew at every crossing of the cut-off, and here there are very many.
        ("gauss-legendre, lists", {
            let changes = [("/solver/integrator", json!("gauss-legendre")), ("/duration", json!(5e-4))];
            every(&with(&cloud(1500, 1.6, json!(0.18)), &changes), 10)
        }),
        ("ball", every(&shipped("bouncing-ball"), 100)),
        ("hard spheres", every(&with(&shipped("free-cooling-gas"), &[("/duration", json!(2.0))]), 4)),
    ] {
        let (whole, outcome, duration) = halves(&value);
        let checkpoint = whole.checkpoint.unwrap();
        assert!(
            checkpoint.time > 0.25 * duration && whole.after.len() > 5,
            "{what}: a checkpoint at {} s of {duration} s, {} steps after it",
            checkpoint.time,
            whole.after.len()
        );
        let scene = scene(&value);
        let mut rest = Halves { until: -1.0, ..Halves::default() };
        let resumed = Simulation::resume(&scene, &checkpoint).unwrap().run(&mut rest).unwrap();
        assert_eq!(whole.after.len(), rest.after.len(), "{what}");
        for (a, b) in whole.after.iter().zip(&rest.after) {
            assert!(a == b, "{what}: step {} differs after a checkpoint at step {}", a.0, checkpoint.step);
        }
        assert_eq!(format!("{outcome:?}"), format!("{resumed:?}"), "{what}");
    }
}

#[test]
fn a_longer_run_of_the_same_scene_goes_on_from_a_shorter_ones_end() {
    // The step that the end of the shorter run clipped must not show in the longer one: the checkpoint before it does.
    let short = with(
        &cloud(100, 0.7, json!("none")),
        &[("/duration", json!(0.0207)), ("/record/checkpoint_every", json!(1_000_000))],
    );
    let mut last = Halves { until: f64::MAX, ..Halves::default() };
    agglo_tests::start(&scene(&short)).run(&mut last).unwrap();
    let checkpoint = last.checkpoint.unwrap();
    assert!(checkpoint.step > 10, "the checkpoint before the clipped step: {}", checkpoint.step);
    let long = scene(&with(&short, &[("/duration", json!(0.04))]));
    let mut whole = Vec::new();
    run(&long, |report| whole.push((report.step, bits(report.state))));
    let mut rest = Vec::new();
    let mut watch = Watch(|report: &StepReport<'_>| rest.push((report.step, bits(report.state))));
    Simulation::resume(&long, &checkpoint).unwrap().run(&mut watch).unwrap();
    assert!(!rest.is_empty() && whole.ends_with(&rest), "the longer run differs after step {}", checkpoint.step);
}

/// Watches states and wants nothing else.
struct Quiet(Vec<Vec<u64>>);

impl Observer for Quiet {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        self.0.push(bits(report.state));
        Ok(Flow::Continue)
    }
    fn wants_samples(&self) -> bool {
        false
    }
    fn wants_checkpoints(&self) -> bool {
        false
    }
}

#[test]
fn whoever_watches_changes_nothing() {
    for (what, value) in [
        ("paper", with(&shipped("paper-binding-4e6"), &[("/duration", json!(1.0))])),
        ("lists", cloud(1500, 1.6, json!(0.18))),
        ("all pairs", cloud(150, 0.7, json!("none"))),
    ] {
        let mut quiet = Quiet(Vec::new());
        agglo_tests::start(&scene(&value)).run(&mut quiet).unwrap();
        let watched: Vec<Vec<u64>> = trace(&value).into_iter().map(|(bits, _)| bits).collect();
        assert!(quiet.0 == watched, "{what}");
    }
}
