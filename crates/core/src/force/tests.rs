//! Both pair loops and energies: the same bits on every instruction set.

use super::Field;
use crate::domain::Domain;
use crate::neighbor::Neighbors;
use crate::placement::place;
use crate::scene::Scene;
use crate::simd::{LEVELS, Level, limit};
use crate::state::Columns;

/// Bits of all forces and energies of a scene at its start.
fn bits(scene: &Scene, listed: bool) -> Vec<u64> {
    let (particles, state) = place(scene).expect("particles without overlap");
    let r = &state.position;
    let periodic = Domain::new(scene.domain.as_ref()).periodic;
    let mut field = Field::new(scene, &particles, r, &periodic).expect("a near field");
    assert_eq!(matches!(field.neighbors, Neighbors::List(_)), listed);
    let mut force = Columns::zeros(particles.len());
    field.add_forces(r, &mut force);
    let (near_field, binding) = field.energies(r);
    let mut all = force.axes().concat();
    all.extend([near_field, binding]);
    all.extend(field.energies_afresh(r));
    assert!(all.iter().all(|x| x.is_finite()));
    all.into_iter().map(f64::to_bits).collect()
}

/// Laws with and without a kernel of their own, weights that are the same for all and that are not, a switch, binding;
/// open and periodic, all pairs and lists, block remainders of every length.
#[test]
fn every_instruction_set_gives_the_same_bits() {
    let mut cases = Vec::new();
    for domain in ["", r#", "domain": { "periodic": [2.5, null, 2.5] }"#] {
        for (exponents, more, charge, weight) in [
            ((1.0, 2.0), "", "", "mass-product"),
            ((7.0, 13.0), "", "", "none"),
            ((1.0, 3.0), "", "", "mass-product"),
            ((2.0, 4.0), "", r#", "charge": [1e-3, -2e-3]"#, "charge-product"),
            ((1.0, 2.3), r#", "switch_from": 0.3"#, "", "mass-product"),
            ((1.5, 2.0), "", r#", "charge": [1e-3, -2e-3]"#, "charge-product"),
        ] {
            for (count, cutoff, listed) in
                [(7, 1.2, false), (33, 1.2, false), (71, 1.2, false), (330, 1.2, false), (1200, 0.35, true)]
            {
                let text = format!(
                    r#"{{ "duration": 1, "particles": {{ "random_cube": {{
                        "count": {count}, "side": 2.4, "radius": 0.03, "density": 2000 {charge} }} }},
                        "near_field": {{ "attraction": {{ "strength": 0.5, "exponent": {} }},
                            "repulsion": {{ "strength": 0.25, "exponent": {} }},
                            "weight": "{weight}", "cutoff": {cutoff}{more} }},
                        "binding": {{ "strength": 1.75, "exponent": 1, "range": 3 }}{domain} }}"#,
                    exponents.0, exponents.1
                );
                cases.push((Scene::parse(&text, &[]).expect("a valid scene"), listed, text));
            }
        }
    }
    for (scene, listed, text) in &cases {
        let mut found = LEVELS.map(|level| {
            limit(level);
            bits(scene, *listed)
        });
        limit(Level::Avx512);
        let last = found.len() - 1;
        let widest = std::mem::take(&mut found[last]);
        for (level, found) in LEVELS.into_iter().zip(&found[..last]) {
            assert_eq!(*found, widest, "{level:?}: {text}");
        }
    }
}
