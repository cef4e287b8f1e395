//! Sums over pairs against a plain double loop: third law, lists, periodic boxes, the ends of blocks.

use crate::twin;
use agglo_core::assembly::Model;
use agglo_core::neighbor::Neighbors;
use agglo_core::placement::place;
use agglo_core::scene::Scene;
use agglo_core::state::{Columns, Particles};
use agglo_tests::{Random, scene, with};
use serde_json::{Value, json};

/// n particles of unequal radii, masses and charges in a box, never closer than about a fifth of their spacing.
fn cloud_of(n: usize, size: [f64; 3], changes: &[(&str, Value)]) -> Scene {
    let mut random = Random(n as u64);
    let spacing = (size[0] * size[1] * size[2] / n as f64).cbrt();
    let cells = size.map(|length| (length / spacing).ceil().max(1.0) as usize);
    // Sites of a lattice with room for all, each particle somewhere about its own.
    let cells = [cells[0], cells[1], n.div_ceil(cells[0] * cells[1])];
    let list: Vec<Value> = (0..n)
        .map(|k| {
            let site = [k % cells[0], (k / cells[0]) % cells[1], k / (cells[0] * cells[1])];
            let position: Vec<f64> = (0..3)
                .map(|a| size[a] / cells[a] as f64 * (site[a] as f64 + 0.5 + random.between(-0.4, 0.4)))
                .collect();
            let charge = random.between(0.5, 1.5) * if k.is_multiple_of(3) { -1.0 } else { 1.0 };
            json!({ "position": position, "radius": spacing * random.between(0.05, 0.09),
                    "mass": random.between(0.5, 2.0), "charge": charge })
        })
        .collect();
    scene(&with(&json!({ "duration": 1.0, "particles": { "list": list } }), changes))
}

/// Near field of two weights, a real exponent, and binding.
fn rich(cutoff: Value) -> Vec<(&'static str, Value)> {
    vec![
        (
            "/near_field",
            json!({
                "attraction": { "strength": 0.5, "exponent": 1.5, "weight": "charge-product" },
                "repulsion": { "strength": 0.2, "exponent": 2.2, "weight": "mass-product" }, "cutoff": cutoff
            }),
        ),
        ("/binding", json!({ "strength": 0.7, "exponent": 1.0, "range": 4.0 })),
    ]
}

fn model_of(scene: &Scene) -> (Model, Particles, Columns) {
    let (particles, state) = place(scene).unwrap();
    (Model::new(scene, &particles, &state.position), particles, state.position)
}

/// In a periodic box coordinates go on beyond its ends, which rounds them by an ulp of the box: in a force like s^-2.2, with
/// its direction, of the nearest partner that is 3.2 times this over the distance [-].
fn unwrapped(model: &Model, r: &Columns, i: usize) -> f64 {
    let periodic = &model.domain.periodic;
    let length = periodic.length.iter().copied().fold(0.0, f64::max);
    let others = (0..r.len()).filter(|&j| j != i);
    let nearest = others.map(|j| periodic.separation(r, i, j).norm()).fold(f64::INFINITY, f64::min);
    3.2 * f64::EPSILON * length / nearest
}

/// Forces and energies of a model's field against the plain double loop.
fn compare(what: &str, scene: &Scene, model: &mut Model, particles: &Particles, r: &Columns) {
    let mut force = Columns::zeros(r.len());
    let (near_field, binding) = {
        let field = model.field.as_mut().unwrap();
        field.add_forces(r, &mut force);
        field.energies(r)
    };
    let expected = twin::cloud(scene, particles, r);
    for i in 0..r.len() {
        // A term is good to 10 roundings (powf and exp ln), a sum in lanes or in a row to at most one per partner, and
        // those average out: 1e-14 of the sum of sizes.
        let difference = (force.get(i) - expected.force[i]).norm();
        let allowed = (1e-14 + unwrapped(model, r, i)) * expected.force_size[i];
        assert!(difference <= allowed, "{what}: particle {i} of {}: {difference} > {allowed}", r.len());
    }
    let allowed = 1e-14 * expected.energy_size;
    assert!((near_field - expected.near_field).abs() <= allowed, "{what}: {near_field} {}", expected.near_field);
    assert!((binding - expected.binding).abs() <= allowed, "{what}: {binding} {}", expected.binding);
}

#[test]
fn the_third_law_holds_to_the_last_bit_of_a_pair() {
    let mut random = Random(1);
    for law in 0..200 {
        let exponents: [f64; 3] = std::array::from_fn(|_| match law % 2 {
            0 => random.between(0.0, 13.0),
            _ => (random.between(0.0, 26.0)).floor() / 2.0,
        });
        let weights = ["none", "mass-product", "charge-product"];
        let mut changes = vec![
            (
                "/near_field",
                json!({
                    "attraction": { "strength": random.unit(), "exponent": exponents[0] },
                    "repulsion": { "strength": random.unit(), "exponent": exponents[1], "weight": weights[law % 3] },
                    "weight": weights[law / 3 % 3], "cutoff": 1.5, "switch_from": random.between(0.1, 1.0)
                }),
            ),
            ("/binding", json!({ "strength": 1.0, "exponent": exponents[2], "range": 10.0 })),
        ];
        if law % 4 < 2 {
            changes.push(("/domain", json!({ "periodic": [3.0, null, 3.0] })));
        }
        let scene = cloud_of(2, [1.3, 0.7, 2.9], &changes);
        let (mut model, ..) = model_of(&scene);
        for _ in 0..20 {
            let mut r = Columns::default();
            r.push(random.vector(0.0, 3.0));
            let near = random.vector(-1.5, 1.5);
            r.push(std::array::from_fn(|k| r.get(0)[k] + near[k]));
            let mut force = Columns::zeros(2);
            model.forces(&r, &mut force);
            // Not `-0.0 == 0.0` is meant: equal numbers are enough.
            assert_eq!(force.get(0), -force.get(1), "law {law} at {r:?}");
        }
    }
}

/// Blocks hold 64 pairs in lanes of 8: every length of the last, unfilled block and lane.
#[test]
fn every_number_of_particles_from_1_to_130_sums_right() {
    for n in 1..=130 {
        for periodic in [false, true] {
            let mut changes = rich(json!(if periodic { json!(0.45) } else { json!("none") }));
            if periodic {
                changes.push(("/domain", json!({ "periodic": [2.0, 2.0, 2.0] })));
            }
            // A spacing of at most 1 m keeps twice the largest radius, 0.18 spacings, and the binding range in the box.
            let scene = cloud_of(n.max(8), [2.0; 3], &changes);
            let scene = Scene {
                particles: match scene.particles {
                    agglo_core::scene::ParticleSource::List(list) => {
                        agglo_core::scene::ParticleSource::List(list[..n].to_vec())
                    }
                    other => other,
                },
                ..scene
            };
            let (mut model, particles, r) = model_of(&scene);
            compare(&format!("n = {n}, periodic {periodic}"), &scene, &mut model, &particles, &r);
        }
    }
}

/// A cloud that gets lists, one so dense that it gets none, both wide enough for several threads; open, periodic and
/// partly periodic boxes. Then everyone moves: a little, which the skin allows, and a lot, which needs new lists.
#[test]
fn lists_and_threads_change_no_force() {
    for (name, domain) in [
        ("open", json!([null, null, null])),
        ("periodic", json!([4.0, 4.0, 4.0])),
        ("partly periodic", json!([4.0, null, 4.0])),
        ("long box", json!([4.0, 40.0, 4.0])),
    ] {
        for (cutoff, listed) in [(0.35, true), (1.9, false)] {
            let mut changes = rich(json!(cutoff));
            changes.push(("/domain", json!({ "periodic": domain })));
            let scene = cloud_of(700, [4.0; 3], &changes);
            let (mut model, particles, mut r) = model_of(&scene);
            let lists = matches!(model.field.as_ref().unwrap().neighbors, Neighbors::List(_));
            // Of a long box the cloud fills a tenth; lists are chosen by the volume of the box.
            assert!(lists == listed || name == "long box", "{name}, cut-off {cutoff}: lists {lists}");
            compare(&format!("{name}, cut-off {cutoff}"), &scene, &mut model, &particles, &r);
            let mut random = Random(9);
            for (what, far) in [("a little", 0.01), ("a little more", 0.03), ("a lot", 0.2)] {
                for i in 0..r.len() {
                    r.add(i, random.vector(-far, far).into());
                }
                compare(&format!("{name}, cut-off {cutoff}, moved {what}"), &scene, &mut model, &particles, &r);
            }
        }
    }
}

/// A sample taken between two steps sees the right energies although the lists are out of date, and leaves them alone.
#[test]
fn energies_need_no_lists_of_their_own() {
    let scene = cloud_of(700, [4.0; 3], &rich(json!(0.35)));
    let (mut model, particles, mut r) = model_of(&scene);
    model.forces(&r.clone(), &mut Columns::zeros(r.len()));
    let field = model.field.as_ref().unwrap();
    let built_at = field.neighbors.built_at().cloned().unwrap();
    let mut random = Random(4);
    for i in 0..r.len() {
        r.add(i, random.vector(-0.2, 0.2).into());
    }
    let (near_field, binding) = field.energies(&r);
    let expected = twin::cloud(&scene, &particles, &r);
    // As in `compare`.
    assert!((near_field - expected.near_field).abs() <= 1e-14 * expected.energy_size);
    assert!((binding - expected.binding).abs() <= 1e-14 * expected.energy_size);
    assert_eq!(field.neighbors.built_at(), Some(&built_at));
}

/// Forces of a cloud add up to nothing: every pair cancels, so only the sums' round-off is left.
#[test]
fn a_cloud_pulls_itself_nowhere() {
    let scene = cloud_of(500, [4.0; 3], &rich(json!("none")));
    let (mut model, particles, r) = model_of(&scene);
    let mut force = Columns::zeros(r.len());
    model.forces(&r, &mut force);
    let total = (0..r.len()).map(|i| force.get(i)).sum::<nalgebra::Vector3<f64>>().norm();
    let size: f64 = twin::cloud(&scene, &particles, &r).force_size.iter().sum();
    // 500 sums of 499 terms: the roundings of 1.1e-16 each are random.
    assert!(total <= 1e-15 * size, "{total} of {size}");
}
