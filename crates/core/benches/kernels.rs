//! Forces, energies and list builds alone: `cargo bench -p agglo-core`.

#![allow(missing_docs, reason = "the macros make functions without any")]
#![allow(clippy::unwrap_used, reason = "a benchmark may stop")]

use agglo_core::Scene;
use agglo_core::assembly::Model;
use agglo_core::contact::search::visit_close;
use agglo_core::placement::place;
use agglo_core::state::Columns;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

/// A model and positions: n particles at mean spacing 1 with two exponents and a cut-off.
fn cloud(n: usize, (attraction, repulsion): (f64, f64), cutoff: &str) -> (Model, Columns) {
    let text = format!(
        r#"{{ "duration": 1, "particles": {{ "random_cube": {{
            "count": {n}, "side": {:?}, "radius_ratio": 0.25, "density": 2 }} }},
            "near_field": {{ "attraction": {{ "strength": 0.5, "exponent": {attraction} }},
                "repulsion": {{ "strength": 0.25, "exponent": {repulsion} }},
                "weight": "mass-product", "cutoff": {cutoff} }} }}"#,
        (n as f64).cbrt()
    );
    let scene = Scene::parse(&text, &[]).unwrap();
    let (particles, state) = place(&scene).unwrap();
    (Model::new(&scene, &particles, &state.position), state.position)
}

fn forces(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("forces");
    for (name, n, exponents, cutoff) in [
        ("all pairs, 1 and 2", 1000, (1.0, 2.0), "\"none\""),
        ("all pairs, 7 and 13", 1000, (7.0, 13.0), "\"none\""),
        ("all pairs, 1.3 and 2.4", 1000, (1.3, 2.4), "\"none\""),
        ("lists, 1 and 2", 20_000, (1.0, 2.0), "1.5"),
        ("lists, 7 and 13", 20_000, (7.0, 13.0), "1.5"),
    ] {
        let (mut model, r) = cloud(n, exponents, cutoff);
        let mut force = Columns::zeros(n);
        let pairs = model.forces(&r, &mut force);
        group.throughput(Throughput::Elements(pairs));
        group.bench_function(BenchmarkId::new(name, n), |bencher| bencher.iter(|| model.forces(&r, &mut force)));
    }
    group.finish();
}

fn lists(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("lists");
    for n in [1000, 20_000] {
        let (mut model, r) = cloud(n, (1.0, 2.0), "1.5");
        let field = model.field.as_mut().unwrap();
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("build", n), |bencher| bencher.iter(|| field.rebuild_lists(&r)));
        group.bench_function(BenchmarkId::new("energies by cells", n), |bencher| {
            bencher.iter(|| field.energies_afresh(&r));
        });
    }
    group.finish();
}

/// Every pair of a crowded cloud in one cell looked at, as for the clusters of a state.
fn close_pairs(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("close pairs");
    let n = 100;
    let (model, r) = cloud(n, (1.0, 2.0), "1.5");
    group.throughput(Throughput::Elements((n * (n - 1) / 2) as u64));
    group.bench_function(BenchmarkId::new("one cell", n), |bencher| {
        bencher.iter(|| {
            let mut sum = 0_u32;
            visit_close(&r, &[0.25; 100], &model.domain.periodic, 2.0, |pair| sum += pair.i ^ pair.j);
            sum
        });
    });
    group.finish();
}

criterion_group!(benches, forces, lists, close_pairs);
criterion_main!(benches);
