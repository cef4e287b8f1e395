//! What the books say: the energy and momentum that nothing explains, and sums over the impacts that were seen.

use agglo_core::impact::Partner;
use agglo_core::ledger::Totals;
use agglo_tests::{Random, order, run, scene, shipped_scenes, with};
use rayon::prelude::*;
use serde_json::{Value, json};

/// Twenty-seven charged particles on a loose lattice, with every smooth force there is, and no impacts.
fn smooth() -> Value {
    let mut random = Random(2);
    let list: Vec<Value> = (0..27)
        .map(|k: u32| {
            let site = [k % 3, (k / 3) % 3, k / 9].map(f64::from);
            let jitter = random.vector(-0.05, 0.05);
            let position: Vec<f64> = (0..3).map(|a| 0.4 * site[a] + 0.3 + jitter[a]).collect();
            let charge = if k.is_multiple_of(2) { 0.1 } else { -0.1 };
            json!({ "position": position, "velocity": random.vector(-0.2, 0.2), "radius": 0.02,
                    "mass": random.between(0.5, 1.5), "charge": charge })
        })
        .collect();
    json!({
        "duration": 0.5, "particles": { "list": list },
        "near_field": {
            "attraction": { "strength": 0.05, "exponent": 1.0 }, "repulsion": { "strength": 0.02, "exponent": 2.0 },
            "cutoff": 0.7, "switch_from": 0.35
        },
        "external": { "gravity": [0.0, 0.0, -9.81], "electric_field": [3.0, 0.0, -1.0] },
        "domain": { "periodic": [1.5, null, 1.5] },
        "solver": { "tolerance": { "position": 1e-9 } }
    })
}

#[test]
fn the_residual_vanishes_at_the_integrators_order() {
    for (integrator, expected) in [("backward-euler", 1.0), ("trapezoidal", 2.0), ("velocity-verlet", 2.0)] {
        let residual = |dt: f64| {
            let changes = [("/solver/integrator", json!(integrator)), ("/solver/step/fixed", json!(dt))];
            run(&scene(&with(&smooth(), &changes)), |_| {}).sample.ledger.residual.abs()
        };
        let residuals = [1.0 / 256.0, 1.0 / 512.0, 1.0 / 1024.0].map(residual);
        for pair in residuals.windows(2) {
            let shown = order(pair[0], pair[1], 2.0);
            // The switch is C2, so the next term is there but small at these steps.
            assert!((shown - expected).abs() <= 0.1, "{integrator}: order {shown}, residuals {residuals:?}");
        }
    }
}

/// Free fall through a periodic box: the work of the fields over all laps is what the kinetic energy gained.
#[test]
fn work_along_periodic_directions_is_counted_lap_by_lap() {
    let value = json!({
        "duration": 3.0,
        "particles": { "list": [
            { "position": [0.1, 0.2, 0.3], "velocity": [1.0, -2.0, 0.5], "radius": 0.01, "mass": 2.0, "charge": 0.3 },
            { "position": [0.6, 0.7, 0.8], "velocity": [-3.0, 0.0, 4.0], "radius": 0.01, "mass": 0.5, "charge": -0.4 }
        ] },
        "external": { "gravity": [0.0, -1.0, -9.81], "electric_field": [7.0, 2.0, 0.0] },
        "domain": { "periodic": [1.0, null, 2.0] },
        "solver": { "step": { "fixed": 1e-2 } }
    });
    let outcome = run(&scene(&value), |report| {
        let ledger = &report.sample.unwrap().ledger;
        let scale = ledger.kinetic + ledger.external.abs() + ledger.totals.periodic_work.abs();
        // Velocity Verlet is exact under a constant force; a sum of up to 300 roundings is left.
        assert!(ledger.residual.abs() <= 1e-13 * scale, "{} s: {ledger:?}", report.time);
        assert!((0.0..1.0).contains(&report.state.position.x[0]) && (0.0..2.0).contains(&report.state.position.z[1]));
    });
    // Closed form: the work F.(v t + a t^2/2) of each particle, laps or not.
    let t = 3.0;
    let (mut gained, mut along_open) = (0.0, 0.0);
    for (mass, charge, v) in [(2.0, 0.3, [1.0, -2.0, 0.5]), (0.5, -0.4, [-3.0, 0.0, 4.0])] {
        let force = [charge * 7.0, -mass + charge * 2.0, -9.81 * mass];
        for k in 0..3 {
            let work = force[k] * (v[k] * t + 0.5 * force[k] / mass * t * t);
            gained += work;
            along_open += if k == 1 { work } else { 0.0 };
        }
    }
    let start = 0.5 * 2.0 * 5.25 + 0.5 * 0.5 * 25.0;
    let ledger = outcome.sample.ledger;
    assert!((ledger.kinetic - start - gained).abs() <= 1e-12 * gained.abs(), "{ledger:?} {gained}");
    // What the wrapped positions do not show is the periodic work: the potential fell by the rest.
    assert!(ledger.totals.periodic_work.abs() > 0.5 * (gained - along_open).abs(), "{ledger:?}");
    assert!(outcome.sample.momentum.residual <= 1e-13);
}

/// Sums over the impacts that an observer sees.
fn add_impacts(totals: &mut Totals, report: &agglo_core::StepReport<'_>) {
    for impact in report.impacts {
        let sides = if matches!(impact.partner, Partner::Particle(_)) { 2.0 } else { 1.0 };
        totals.reaction_heat += sides * impact.heat;
        totals.impact_loss += impact.normal_loss();
        totals.friction_loss += impact.friction_loss();
    }
}

/// Every shipped scene: momentum to round-off, and cumulative sums recomputed from `impacts` alone.
#[test]
fn shipped_scenes_keep_momentum_and_their_books() {
    let residuals: Vec<(String, f64)> = shipped_scenes()
        .into_par_iter()
        .map(|(name, value)| {
            let mut sums = Totals::default();
            let mut last_step = 0;
            let mut worst: f64 = 0.0;
            let outcome = run(&scene(&value), |report| {
                assert!(
                    report.step == last_step + u64::from(report.step > 0),
                    "{name}: step {} missing",
                    last_step + 1
                );
                last_step = report.step;
                add_impacts(&mut sums, report);
                if let Some(sample) = report.sample {
                    worst = worst.max(sample.momentum.residual);
                    // Clusters partition the particles.
                    if let Some(clusters) = &sample.clusters {
                        let of = &clusters.of;
                        let number = of.iter().max().unwrap() + 1;
                        assert_eq!(number, clusters.count + clusters.singletons, "{name}");
                        let sum = clusters.mean_size * f64::from(clusters.count) + f64::from(clusters.singletons);
                        assert!((sum - of.len() as f64).abs() < 1e-9, "{name}");
                    }
                }
            });
            let totals = outcome.sample.ledger.totals;
            for (what, ours, theirs) in [
                ("reaction heat", sums.reaction_heat, totals.reaction_heat),
                ("impact loss", sums.impact_loss, totals.impact_loss),
                ("friction loss", sums.friction_loss, totals.friction_loss),
            ] {
                // The same numbers in the same order.
                assert!(
                    (ours - theirs).abs() <= 1e-12 * theirs.abs(),
                    "{name}: {what} {theirs} J, from impacts {ours} J"
                );
            }
            // Where nothing damps, in `consistent`, what is left unexplained is small beside what moves.
            if value["model"] != json!("paper") {
                let ledger = outcome.sample.ledger;
                let size = ledger.kinetic + ledger.thermal + totals.impact_loss + totals.resting_loss;
                assert!(ledger.residual.abs() <= 1e-2 * size, "{name}: {ledger:?}");
            }
            (name, worst)
        })
        .collect();
    // Pairs cancel in forces to a rounding of each sum of 100 to 1000; sums of impulses round once each.
    let worse: Vec<&(String, f64)> = residuals.iter().filter(|(_, worst)| *worst > 1e-13).collect();
    assert!(worse.is_empty(), "largest momentum residual of a run: {worse:?}");
}

/// The residual is a share of the momentum that moved, not of what is left of it: two bodies that meet and stay together
/// have next to none left, and have kept it all.
#[test]
fn momentum_that_is_gone_leaves_no_residual_behind() {
    for mass in [0.3, 0.7, 1.1, 1.7] {
        let value = json!({
            "duration": 0.3,
            "particles": { "list": [
                { "position": [-0.1, 0.013, 0.0], "velocity": [0.9, 0.0, 0.0], "radius": 0.05, "mass": mass },
                { "position": [0.1, 0.0, 0.0], "velocity": [-0.3, 0.0, 0.0], "radius": 0.05, "mass": 3.0 * mass }
            ] },
            "contact": { "restitution": 0.0, "friction": { "static": 10.0, "dynamic": 10.0 } },
            "solver": { "step": { "fixed": 1e-3 } }
        });
        let outcome = run(&scene(&value), |_| {});
        assert_eq!(outcome.counters.impacts, 1);
        assert!(outcome.sample.momentum.residual <= 1e-13, "mass {mass} kg: {:?}", outcome.sample.momentum);
    }
}

/// Impacts among fields: what the ledger cannot explain is the integrator's error, and falls with the step.
#[test]
fn impacts_do_not_spoil_the_balance() {
    let value = with(
        &smooth(),
        &[
            ("/contact", json!({ "restitution": 0.7, "friction": { "static": 0.3, "dynamic": 0.2 } })),
            // Large enough to meet, small enough not to overlap at the start.
            ("/duration", json!(1.0)),
        ],
    );
    let mut value = value;
    for particle in value["particles"]["list"].as_array_mut().unwrap() {
        particle["radius"] = json!(0.14);
        let v: Vec<f64> = particle["velocity"].as_array().unwrap().iter().map(|v| 5.0 * v.as_f64().unwrap()).collect();
        particle["velocity"] = json!(v);
    }
    let residual = |dt: f64| {
        let outcome = run(&scene(&with(&value, &[("/solver/step/fixed", json!(dt))])), |_| {});
        assert!(outcome.counters.impacts > 20, "{:?}", outcome.counters);
        let ledger = outcome.sample.ledger;
        (ledger.residual.abs(), ledger.totals.impact_loss + ledger.totals.friction_loss)
    };
    // Velocities jump at the ends of steps, where positions and potentials are continuous: no impact adds to the
    // residual. 64 times smaller steps then leave much less; orders do not show, since every run has other impacts.
    let (coarse, fine) = (residual(1.0 / 256.0), residual(1.0 / 16384.0));
    assert!(fine.0 <= 1e-2 * coarse.0 && fine.0 <= 1e-5 * fine.1, "{coarse:?} {fine:?}");
}
