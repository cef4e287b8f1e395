use agglo_core::{assembly::Model, placement::place, scene::Scene, state::Columns};
fn main() {
    let n: usize = std::env::args().nth(1).map_or(100_000, |a| a.parse().unwrap());
    let rounds: usize = std::env::args().nth(2).map_or(3, |a| a.parse().unwrap());
    let kind = std::env::args().nth(3).unwrap_or("12".into());
    let text = |acc: Option<f64>| {
        let a = acc.map_or(String::new(), |a| format!(r#", "accuracy": {a:e}"#));
        let law = if kind == "12" {
            r#""attraction": { "strength": 1, "exponent": 1 }, "repulsion": { "strength": 0.01, "exponent": 2 }, "weight": "none""#
        } else {
            r#""attraction": { "strength": 1, "exponent": 2 }, "repulsion": { "strength": 0.01, "exponent": 4 }, "weight": "charge-product""#
        };
        format!(
            r#"{{ "duration": 1, "particles": {{ "random_cube": {{ "count": {n}, "side": {:?}, "radius_ratio": 0.25, "density": 2, "charge": [1, -1] }} }}, "near_field": {{ {law} {a} }} }}"#,
            (n as f64).cbrt()
        )
    };
    let scene = Scene::parse(&text(None), &[]).unwrap();
    let (p, s) = place(&scene).unwrap();
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    let mut exact = Columns::zeros(n);
    let mut m = Model::new(&scene, &p, &s.position);
    let t = std::time::Instant::now();
    if std::env::var("ONLY").is_err() || std::env::var("ERR").is_ok() {
        m.forces(&s.position, &mut exact);
    }
    let direct = t.elapsed().as_secs_f64();
    println!("direct {direct:.3} s {:.2} ns/pair", direct * 2e9 / (n as f64 * n as f64));
    let accs: Vec<f64> = if std::env::var("ONLY").is_ok() { vec![1e-4] } else { vec![1e-4, 1e-6] };
    for acc in accs {
        let sc = Scene::parse(&text(Some(acc)), &[]).unwrap();
        let mut m = Model::new(&sc, &p, &s.position);
        let mut best = f64::MAX;
        let mut f = Columns::zeros(n);
        for _ in 0..rounds {
            f = Columns::zeros(n);
            let t = std::time::Instant::now();
            m.forces(&s.position, &mut f);
            best = best.min(t.elapsed().as_secs_f64());
        }
        let off: f64 = (0..n).map(|i| (f.get(i) - exact.get(i)).norm_squared()).sum();
        let all: f64 = (0..n).map(|i| exact.get(i).norm_squared()).sum();
        println!(
            "{acc:e}: {best:.3} s  x{:.1}  error {:.2e}",
            direct / best,
            (off / all).sqrt()
        );
    }
}
