//! Against the sum over all pairs: errors, momentum, energies; the same bits on every instruction set.

use super::super::Field;
use crate::domain::Periodic;
use crate::placement::place;
use crate::scene::Scene;
use crate::simd::{LEVELS, Level, limit};
use crate::state::{Columns, Particles};
use rand::{Rng, SeedableRng};

const COUNT: usize = 3500;

fn scene(near_field: &str, more: &str) -> Scene {
    let text = format!(
        r#"{{ "duration": 1, "particles": {{ "random_cube": {{ "count": {COUNT}, "side": 16, "radius": 0.05, "density": 2,
            "charge": [1, -1, 2] }} }}, "near_field": {{ {near_field} }} {more} }}"#
    );
    Scene::parse(&text, &[]).expect("a valid scene")
}

fn near_field(exponents: (f64, f64), weight: &str, accuracy: Option<f64>) -> String {
    let accuracy = accuracy.map_or(String::new(), |accuracy| format!(r#", "accuracy": {accuracy:e}"#));
    format!(
        r#""attraction": {{ "strength": 0.5, "exponent": {} }}, "repulsion": {{ "strength": 0.25, "exponent": {} }},
            "weight": "{weight}" {accuracy}"#,
        exponents.0, exponents.1
    )
}

/// A cloud with density that varies a thousandfold, a sheet, a line, a cube, all with some noise so that no two coincide.
fn clouds() -> [Columns; 4] {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let mut uniform = move || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
    let mut cloud = |shape: fn([f64; 3], usize) -> [f64; 3]| {
        let mut r = Columns::default();
        for i in 0..COUNT {
            r.push(shape([uniform(), uniform(), uniform()], i));
        }
        r
    };
    [
        cloud(|u, i| {
            let centre = [[0.0; 3], [9.0, 1.0, 2.0], [3.0, -8.0, 4.0]][i % 3];
            let near = 8.0 * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
            std::array::from_fn(|k| centre[k] + 6.0 * u[k] * near)
        }),
        cloud(|u, _| [20.0 * u[0], 20.0 * u[1], 0.01 * u[2]]),
        cloud(|u, _| [80.0 * u[0], 0.01 * u[1], 0.01 * u[2]]),
        cloud(|u, _| u.map(|x| 16.0 * x)),
    ]
}

struct Found {
    force: Columns,
    energies: (f64, f64),
    /// Sum of the absolute energies of all pairs, or less.
    size: f64,
    order: Option<usize>,
}

fn found(scene: &Scene, particles: &Particles, r: &Columns) -> Found {
    let mut field = Field::new(scene, particles, r, &Periodic::default()).expect("a near field");
    let mut force = Columns::zeros(r.len());
    field.add_forces(r, &mut force);
    let [near_field, binding, size] = field.energies_afresh(r);
    assert_eq!(field.energies(r), (near_field, binding));
    Found { force, energies: (near_field, binding), size, order: field.far_order() }
}

/// Root of the sum of squares.
fn size(force: &Columns) -> f64 {
    (0..force.len()).map(|i| force.get(i).norm_squared()).sum::<f64>().sqrt()
}

#[test]
fn errors_are_as_small_as_asked_for() {
    let (particles, _) = place(&scene(&near_field((1.0, 2.0), "none", None), "")).expect("no overlap");
    for (exponents, weight) in [
        ((1.0, 2.0), "none"),
        ((2.0, 2.5), "charge-product"),
        ((1.3, 2.0), "mass-product"),
        ((0.0, 3.0), "none"),
        ((7.0, 13.0), "none"),
    ] {
        for (k, r) in clouds().iter().enumerate() {
            let exact = found(&scene(&near_field(exponents, weight, None), ""), &particles, r);
            assert_eq!(exact.order, None);
            let all = size(&exact.force);
            for accuracy in [1e-2, 1e-4, 1e-6] {
                let far = found(&scene(&near_field(exponents, weight, Some(accuracy)), ""), &particles, r);
                let case = format!("{exponents:?} {weight} cloud {k} at {accuracy:e}, order {:?}", far.order);
                if far.order.is_none() {
                    // All pairs are cheaper, where steep laws would need high orders.
                    assert!(exponents.0 > 6.0 && far.force == exact.force, "{case}");
                    continue;
                }
                let off: Vec<f64> = (0..COUNT).map(|i| (far.force.get(i) - exact.force.get(i)).norm()).collect();
                let error = off.iter().map(|off| off * off).sum::<f64>().sqrt() / all;
                assert!(error <= accuracy, "{case}: {error:e}");
                let mean = all / (COUNT as f64).sqrt();
                let beyond = off.iter().filter(|&&off| off > 10.0 * accuracy * mean).count();
                assert!(beyond <= COUNT / 1000, "{case}: {beyond} particles");
                // Of the absolute energies of all pairs: charges of both signs nearly cancel. Distant pairs, which expansions
                // are for, make more of an energy than of a force.
                let energy = (far.energies.0 - exact.energies.0).abs() / exact.size;
                assert!(energy <= 10.0 * accuracy, "{case}: energy {energy:e}");
                // Cells meet from both sides with the same derivatives: what one gains the other loses, to round-off.
                let net = far.force.axes().map(|column| column.iter().sum::<f64>().abs());
                assert!(net.iter().all(|net| *net <= 1e-11 * all), "{case}: momentum {net:?}");
            }
        }
    }
}

/// Bonds are summed pair by pair, whatever the near field does.
#[test]
fn bonds_are_exact() {
    let binding = r#", "binding": { "strength": 1.75, "exponent": 1, "range": 6 }"#;
    let (particles, state) = place(&scene(&near_field((1.0, 2.0), "none", None), "")).expect("no overlap");
    let r = &state.position;
    let exact = found(&scene(&near_field((1.0, 2.0), "none", None), binding), &particles, r);
    let far = found(&scene(&near_field((1.0, 2.0), "none", Some(1e-3)), binding), &particles, r);
    assert!(far.order.is_some() && exact.energies.1 < 0.0);
    let off = (far.energies.1 - exact.energies.1).abs() / exact.energies.1.abs();
    assert!(off <= 1e-13, "{off:e}");
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    for (exponents, weight) in [((1.0, 2.0), "charge-product"), ((1.3, 2.0), "mass-product")] {
        let scene = scene(&near_field(exponents, weight, Some(1e-3)), "");
        let (particles, state) = place(&scene).expect("no overlap");
        let [portable, avx2, avx512] = LEVELS.map(|level| {
            limit(level);
            let found = found(&scene, &particles, &state.position);
            assert!(found.order.is_some());
            let mut all = found.force.axes().concat();
            all.extend([found.energies.0, found.energies.1]);
            all.into_iter().map(f64::to_bits).collect::<Vec<_>>()
        });
        limit(Level::Avx512);
        assert!(portable == avx512 && avx2 == avx512);
    }
}
