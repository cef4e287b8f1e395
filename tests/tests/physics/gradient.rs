//! The force on every particle is minus the slope of the energy, and both end where they should.

use crate::twin;
use agglo_core::assembly::Model;
use agglo_core::placement::place;
use agglo_core::scene::Scene;
use agglo_core::state::{Columns, Particles};
use agglo_tests::{Random, scene, with};
use nalgebra::Vector3;
use serde_json::{Value, json};

/// Exponents with a multiplication chain of their own, and some that have none.
const EXPONENTS: [f64; 16] = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0, 7.0, 12.0, 13.0, 0.3, 1.7, 5.25, 11.9];

/// Two particles of unequal radii, masses and charges, a distance s apart in a skew direction.
fn pair_of(changes: &[(&str, Value)], s: f64) -> Value {
    let n = Vector3::new(0.48, -0.6, 0.64);
    let at = [0.1, 0.2, -0.3];
    let other: Vec<f64> = (0..3).map(|k| at[k] + s * n[k]).collect();
    let value = json!({ "duration": 1.0, "particles": { "list": [
        { "position": at, "radius": 0.1, "mass": 1.5, "charge": 0.7 },
        { "position": other, "radius": 0.03, "mass": 0.4, "charge": -1.3 }
    ] } });
    with(&value, changes)
}

/// Laws with a name: changes to a scene.
fn laws() -> Vec<(String, Vec<(&'static str, Value)>)> {
    let mut laws = Vec::new();
    let mut add = |name: &str, changes: Vec<(&'static str, Value)>| laws.push((name.to_owned(), changes));
    let term = |exponent: f64| json!({ "strength": 0.8, "exponent": exponent });
    for beta in EXPONENTS {
        for weight in ["none", "mass-product", "charge-product"] {
            for (kind, pointer) in [("attraction", "/near_field/attraction"), ("repulsion", "/near_field/repulsion")] {
                add(
                    &format!("{kind} {beta} {weight}"),
                    vec![(pointer, term(beta)), ("/near_field/weight", json!(weight))],
                );
            }
        }
        add(&format!("binding {beta}"), vec![("/binding", json!({ "strength": 0.8, "exponent": beta, "range": 5.0 }))]);
        add(
            &format!("cut off {beta}"),
            vec![("/near_field/attraction", term(beta)), ("/near_field/cutoff", json!(0.9))],
        );
        add(
            &format!("switched {beta}"),
            vec![
                ("/near_field/repulsion", term(beta)),
                ("/near_field/cutoff", json!(1.1)),
                ("/near_field/switch_from", json!(0.2)),
            ],
        );
    }
    let two = json!({
        "attraction": { "strength": 0.5, "exponent": 1.0 }, "repulsion": { "strength": 0.25, "exponent": 2.0 },
        "weight": "mass-product", "cutoff": "inflection"
    });
    add("inflection", vec![("/near_field", two.clone())]);
    add("inflection, switched", vec![("/near_field", two.clone()), ("/near_field/switch_from", json!(0.3))]);
    add(
        "inflection and binding",
        vec![("/near_field", two.clone()), ("/binding", json!({ "strength": 1.75, "exponent": 1.0, "range": 3.3 }))],
    );
    add(
        "binding by charges",
        vec![("/binding", json!({ "strength": 2.0, "exponent": 2.5, "range": 4.0, "weight": "charge-product" }))],
    );
    add(
        "each term its own weight",
        vec![(
            "/near_field",
            json!({
                "attraction": { "strength": 3.0, "exponent": 2.0, "weight": "charge-product" },
                "repulsion": { "strength": 0.2, "exponent": 3.7, "weight": "mass-product" }, "weight": "none", "cutoff": 1.3
            }),
        )],
    );
    let charged = json!({
        "attraction": { "strength": 3.0, "exponent": 2.0 }, "repulsion": { "strength": 0.2, "exponent": 4.0 },
        "weight": "charge-product", "cutoff": "none"
    });
    add("unlike charges", vec![("/near_field", charged.clone())]);
    add("like charges", vec![("/near_field", charged), ("/particles/list/1/charge", json!(1.3))]);
    let external = json!({ "gravity": [0.3, -0.2, -9.81], "electric_field": [5.0, -2.0, 0.5] });
    add("gravity and electric field", vec![("/external", external.clone())]);
    add(
        "everything",
        vec![
            ("/near_field", two),
            ("/binding", json!({ "strength": 1.75, "exponent": 0.6, "range": 2.5 })),
            ("/external", external),
        ],
    );
    laws
}

/// A scene's terms at its start.
fn model_of(scene: &Scene) -> (Model, Particles, Columns) {
    let (particles, state) = place(scene).unwrap();
    (Model::new(scene, &particles, &state.position), particles, state.position)
}

fn forces(model: &mut Model, r: &Columns) -> Columns {
    let mut force = Columns::zeros(r.len());
    model.forces(r, &mut force);
    force
}

fn energy(model: &Model, r: &Columns) -> f64 {
    let (near_field, binding) = model.field.as_ref().map_or((0.0, 0.0), |field| field.energies(r));
    near_field + binding + model.external.as_ref().map_or(0.0, |external| external.energy(r))
}

/// Distances where nothing of a law begins or ends within the stencil.
const DISTANCES: [f64; 5] = [0.21, 0.31, 0.47, 0.83, 1.27];

#[test]
fn the_force_is_minus_the_slope_of_the_energy() {
    for (name, changes) in laws() {
        for s in DISTANCES {
            let scene = scene(&pair_of(&changes, s));
            let (mut model, particles, r) = model_of(&scene);
            let force = forces(&mut model, &r);
            let terms = twin::pair(&scene, &particles, 0, 1, s);
            let outside = force.get(0) + force.get(1);
            // Fourth-order differences over h = s/5000: h^4 F''''/30 is 3e-11 of the force at beta = 13, and round-off
            // of the energies, (energy/s) 5000 * 2e-16, is 1e-12 of energy/s; external energies are F.r, |r| < 3.
            let h = s / 5000.0;
            let scale = terms.force_size + terms.energy_size / s + 10.0 * outside.norm() / s;
            for i in 0..2 {
                for axis in 0..3 {
                    let at = |k: f64| {
                        let mut moved = r.clone();
                        moved.axes_mut()[axis][i] += k * h;
                        energy(&model, &moved)
                    };
                    let slope = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h);
                    let force = force.axes()[axis][i];
                    assert!(
                        (force + slope).abs() <= 1e-10 * scale,
                        "{name} at {s} m, particle {i}, axis {axis}: force {force}, slope of the energy {slope}"
                    );
                }
            }
        }
    }
}

#[test]
fn forces_and_energies_are_those_of_the_equations() {
    for (name, changes) in laws() {
        for s in DISTANCES {
            let scene = scene(&pair_of(&changes, s));
            let (model, particles, r) = model_of(&scene);
            let Some(mut field) = model.field else { continue };
            let mut force = Columns::zeros(2);
            field.add_forces(&r, &mut force);
            let (near_field, binding) = field.energies(&r);
            let d = r.get(1) - r.get(0);
            let expected = twin::pair(&scene, &particles, 0, 1, d.norm());
            let along = force.get(0).dot(&d) / d.norm();
            // exp(beta ln s) is good to beta |ln s| + 1 roundings, at most 25 of 1.1e-16 here; 1e-14 leaves a factor 3.
            let near = |a: f64, b: f64, size: f64| (a - b).abs() <= 1e-14 * size;
            assert!(near(along, expected.force, expected.force_size), "{name} at {s} m: {along} {expected:?}");
            assert!(near(near_field, expected.near_field, expected.energy_size), "{name} at {s} m: {near_field}");
            assert!(near(binding, expected.binding, expected.energy_size), "{name} at {s} m: {binding} {expected:?}");
        }
    }
}

/// Signs of the three weights: like charges repel, unlike attract, nothing collapses.
#[test]
fn like_charges_repel_and_unlike_attract() {
    let along = |field: Value, charge: f64, s: f64| {
        let scene = scene(&pair_of(&[("/near_field", field), ("/particles/list/1/charge", json!(charge))], s));
        let (mut model, _, r) = model_of(&scene);
        forces(&mut model, &r).get(0).dot(&(r.get(1) - r.get(0)))
    };
    let term = json!({ "strength": 1.0, "exponent": 2.0 });
    let attraction = json!({ "attraction": term, "weight": "charge-product" });
    let repulsion = json!({ "repulsion": term, "weight": "charge-product" });
    assert!(along(attraction.clone(), 1.0, 0.5) < 0.0);
    assert!(along(attraction.clone(), -1.0, 0.5) > 0.0);
    assert_eq!(along(attraction, 0.0, 0.5), 0.0);
    assert!(along(repulsion.clone(), 1.0, 0.5) < 0.0);
    assert!(along(repulsion, -1.0, 0.5) < 0.0);
}

#[test]
fn the_papers_pair_rests_at_d_e_and_pulls_hardest_at_the_inflection() {
    let field = json!({
        "attraction": { "strength": 0.5, "exponent": 1.0 }, "repulsion": { "strength": 0.25, "exponent": 2.0 },
        "cutoff": "inflection"
    });
    let force = |s: f64| {
        let (mut model, _, r) = model_of(&scene(&pair_of(&[("/near_field", field.clone())], s)));
        let d = r.get(1) - r.get(0);
        forces(&mut model, &r).get(0).dot(&d) / d.norm()
    };
    // d_e = 0.5: both terms are 1 N and cancel to round-off. d* = 1: the force there is 0.25 N, and zero beyond.
    assert!(force(0.5).abs() <= 1e-15);
    let at_cutoff = force(1.0 - 1e-12);
    assert!((at_cutoff - 0.25).abs() <= 1e-11, "{at_cutoff}");
    assert!(force(0.95) < at_cutoff && force(0.9) < force(0.95));
    assert_eq!(force(1.0 + 1e-12), 0.0);
}

/// Energy at distance s of near field and binding.
fn energies_at(changes: &[(&str, Value)], s: f64) -> (f64, f64) {
    let (model, _, r) = model_of(&scene(&pair_of(changes, s)));
    model.field.unwrap().energies(&r)
}

#[test]
fn potentials_are_zero_at_the_cut_off_and_at_activation() {
    for beta in EXPONENTS {
        for (pointer, range) in [("/near_field/attraction", 0.9), ("/binding", 0.65)] {
            let mut changes = vec![(pointer, json!({ "strength": 0.8, "exponent": beta }))];
            if pointer == "/binding" {
                changes[0].1["range"] = json!(range / 0.13);
            } else {
                changes.push(("/near_field/cutoff", json!(range)));
            }
            let total = |s: f64| {
                let (near_field, binding) = energies_at(&changes, s);
                near_field + binding
            };
            // 1e-9 inside the end the energy is at most the force there, 0.8 * 0.65^-13 < 217 N, times 1e-9 m.
            let just_inside = total(range * (1.0 - 1e-9));
            let force = 0.8 * range.powf(-beta);
            assert!(just_inside < 0.0 && just_inside.abs() <= 1.01 * force * range * 1e-9, "{beta}: {just_inside}");
            assert_eq!(total(range * (1.0 + 1e-9)), 0.0);
            assert!(total(0.5) < just_inside, "an attracting well below its end");
        }
    }
}

/// Slope of the force from one side, first order.
fn force_slope(changes: &[(&str, Value)], s: f64, h: f64) -> f64 {
    let force = |s: f64| {
        let (mut model, _, r) = model_of(&scene(&pair_of(changes, s)));
        let d = r.get(1) - r.get(0);
        forces(&mut model, &r).get(0).dot(&d) / d.norm()
    };
    (force(s + h) - force(s)) / h
}

#[test]
fn the_switch_is_smooth_to_the_second_derivative_at_both_ends() {
    for beta in [1.0, 2.0, 5.25] {
        let (from, to) = (0.5, 0.9);
        let changes = [
            ("/near_field/attraction", json!({ "strength": 0.8, "exponent": beta })),
            ("/near_field/cutoff", json!(to)),
            ("/near_field/switch_from", json!(from)),
        ];
        let width: f64 = to - from;
        let depth = energies_at(&changes, from).0.abs();
        let h = 1e-5 * width;
        for end in [from, to] {
            let (left, right) = (force_slope(&changes, end - h, h), force_slope(&changes, end, h));
            // Over h the slope changes by h times 60 depth/width^3 (the quintic's third derivative) and h F'' of the law
            // itself; a cubic switch, smooth to the first derivative only, would jump by 6 depth/width^2.
            let law = 0.8 * beta * (beta + 1.0) * end.powf(-beta - 2.0);
            let allowed = 2.0 * h * (60.0 * depth / width.powi(3) + law) + 1e-9;
            assert!(allowed < 0.1 * 6.0 * depth / width.powi(2), "the test must be able to fail");
            assert!((left - right).abs() <= allowed, "beta {beta} at {end} m: {left} {right}, allowed {allowed}");
        }
    }
}

/// A cloud with every effect at once: the whole gradient, all particles.
#[test]
fn a_cloud_in_a_partly_periodic_box_has_the_gradient_of_its_energy() {
    let mut random = Random(3);
    // A loose lattice, so that no pair comes so close that its force hides all others.
    let list: Vec<Value> = (0..48)
        .map(|k: u32| {
            let cell = [k % 4, (k / 4) % 4, k / 16].map(f64::from);
            let jitter = random.vector(-0.15, 0.15);
            let position: Vec<f64> = (0..3).map(|a| 0.5 * cell[a] + 0.25 + jitter[a]).collect();
            let charge = if k.is_multiple_of(2) { 0.5 } else { -0.7 };
            json!({ "position": position, "radius": 0.04 + 0.01 * f64::from(k % 3),
                    "mass": 1.0 + f64::from(k % 5), "charge": charge })
        })
        .collect();
    let scene = scene(&json!({
        "duration": 1.0, "particles": { "list": list },
        "near_field": {
            "attraction": { "strength": 0.5, "exponent": 2.0, "weight": "charge-product" },
            "repulsion": { "strength": 0.02, "exponent": 4.0 },
            "weight": "mass-product", "cutoff": 0.9, "switch_from": 0.3
        },
        "binding": { "strength": 0.3, "exponent": 1.0, "range": 2.5 },
        "external": { "gravity": [0.0, 0.0, -9.81], "electric_field": [1.0, 0.0, 0.0] },
        "domain": { "periodic": [2.0, null, 2.0] }
    }));
    let (mut model, particles, r) = model_of(&scene);
    let force = forces(&mut model, &r);
    let sizes = twin::cloud(&scene, &particles, &r);
    let h = 1e-4;
    for i in 0..r.len() {
        for axis in 0..3 {
            let at = |k: f64| {
                let mut moved = r.clone();
                moved.axes_mut()[axis][i] += k * h;
                energy(&model, &moved)
            };
            let slope = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h);
            let force = force.axes()[axis][i];
            // Truncation, (h/s)^4 * 5*6*7*8/30 of the force for beta = 4 at s > 0.2, is 4e-12; round-off of an energy of
            // the cloud, 1e-16 of its size, divided by h. No pair may enter or leave the binding range within 2 h.
            let allowed = 1e-10 * sizes.force_size[i] + 1e-15 * (sizes.energy_size + 1500.0) / h;
            assert!((force + slope).abs() <= allowed, "particle {i}, axis {axis}: {force} {slope} allowed {allowed}");
        }
    }
}
