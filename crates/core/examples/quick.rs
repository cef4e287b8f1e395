use agglo_core::Scene;
use agglo_core::assembly::Model;
use agglo_core::state::Columns;
fn cpu() -> f64 { std::fs::read_dir("/proc/self/task").unwrap().map(|t| std::fs::read_to_string(t.unwrap().path().join("schedstat")).unwrap().split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9).sum() }
fn main() {
    let a: Vec<String> = std::env::args().collect();
    if a.len() > 2 { agglo_core::simd::limit(agglo_core::simd::LEVELS[a[2].parse::<usize>().unwrap()]); }
    let threads: usize = a.get(3).map_or(1, |t| t.parse().unwrap());
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().unwrap();
    println!("{:?}", agglo_core::simd::Level::current());
    if a[1] == "c" {
        let m: usize = a[4].parse().unwrap();
        let spacing = libm::cbrt(4.0 / 0.8442);
        let mut list = Vec::new();
        let mut x = 1u64; let mut rnd = || { x = x.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); (x >> 11) as f64 / (1u64 << 53) as f64 - 0.5 };
        for k in 0..4 * m * m * m { let c = k / 4; let b = [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]][k % 4];
            let c = [c % m, c / m % m, c / m / m];
            let p: Vec<String> = (0..3).map(|a| format!("{}", (c[a] as f64 + b[a] + 0.25) * spacing)).collect();
            let v: Vec<String> = (0..3).map(|_| format!("{}", rnd() * 4.1569)).collect();
            list.push(format!(r#"{{"position":[{}],"velocity":[{}],"radius":0.5,"mass":1.0}}"#, p.join(","), v.join(","))); }
        let l = spacing * m as f64;
        let n = list.len();
        let steps = a[5].parse::<usize>().unwrap();
        let text = format!(r#"{{ "duration": {}, "particles": {{ "list": [{}] }}, "near_field": {{ "attraction": {{ "strength": 24, "exponent": 7 }}, "repulsion": {{ "strength": 48, "exponent": 13 }}, "weight": "none", "cutoff": 2.5 }},
          "domain": {{ "periodic": [{l}, {l}, {l}] }}, "solver": {{ "integrator": "velocity-verlet", "step": {{ "fixed": 0.005 }} }}, "record": {{ "every_steps": 1000000 }} }}"#, 0.005 * steps as f64, list.join(","));
        let scene = Scene::parse(&text, &[]).unwrap();
        struct O; impl agglo_core::Observer for O { fn step(&mut self, r: &agglo_core::StepReport<'_>) -> Result<agglo_core::Flow, agglo_core::observer::ObserverError> { if let Some(s) = r.sample { println!("t {} E/n {:?} {:?}", r.time, s.ledger.near_field / r.state.position.len() as f64, s.ledger.kinetic / r.state.position.len() as f64); } Ok(agglo_core::Flow::Continue) } fn wants_checkpoints(&self) -> bool { false } }
        let mut sim = agglo_core::Simulation::new(&scene).unwrap();
        let s = cpu(); let w = std::time::Instant::now();
        sim.run(&mut O).unwrap();
        println!("n {n}: cpu {:.1} wall {:.1} ns per particle-step", (cpu() - s) / (n * steps) as f64 * 1e9, w.elapsed().as_secs_f64() / (n * steps) as f64 * 1e9);
        // parts
        let mut m = Model::new(&scene, sim.particles(), &sim.state().position);
        let r = sim.state().position.clone(); let mut f = Columns::zeros(n);
        m.forces(&r, &mut f);
        for what in ["forces", "build"] { let s = cpu(); for _ in 0..20 { if what == "build" { m.field.as_mut().unwrap().rebuild_lists(&r); } else { m.forces(&r, &mut f); } } println!("{what}: {:.1} ns per particle, pairs per particle {}", (cpu() - s) / 20.0 / n as f64 * 1e9, m.field.as_ref().unwrap().neighbors.pairs(n) as f64 / n as f64); }
        return;
    }
    if a[1] == "b" {
        for (n, e1, e2, bind) in [(100, 1.0, 2.0,""),(1000, 1.0, 2.0,""), (4000, 1.0, 2.0,""), (1000, 1.0, 2.0, r#","binding": { "strength": 1.75, "exponent": 1, "range": 1.65 }"#), (1000, 1.3, 2.4,""), (1000, 2.0, 4.0,""), (1000, 7.0, 13.0,"")] {
            let text = format!(r#"{{ "duration": 1, "particles": {{ "random_cube": {{ "count": {n}, "side": 1, "radius_ratio": 0.25, "density": 2000 }} }},
              "near_field": {{ "attraction": {{ "strength": 0.5, "exponent": {e1} }}, "repulsion": {{ "strength": 0.25, "exponent": {e2} }}, "weight": "mass-product", "cutoff": 1.0 }} {bind} }}"#);
            let scene = Scene::parse(&text, &[]).unwrap();
            let (p, s) = agglo_core::placement::place(&scene).unwrap();
            let mut m = Model::new(&scene, &p, &s.position);
            let mut f = Columns::zeros(n);
            let r = s.position.clone();
            let mut inside = 0u64;
            for i in 0..n { for j in i + 1..n { if (r.get(i) - r.get(j)).norm() <= 1.0 { inside += 1; } } }
            let reps = (200_000_000 / (n * n)).max(10);
            let mut t = Vec::new();
            for _ in 0..9 { let start = cpu(); for _ in 0..reps / 9 + 1 { m.forces(&r, &mut f); } t.push((cpu() - start) / (reps / 9 + 1) as f64); }
            t.sort_by(f64::total_cmp);
            println!("n {n} {e1} {e2} {bind}: {:.3} ns/pair inside (min {:.3}); f0 {:e}", t[4] / inside as f64 * 1e9, t[0] / inside as f64 * 1e9, f.x[0]);
        }
    }
}
