//! (f) A charged cloud without a cut-off: the fast multipole method against the sum over all pairs.

use agglo_core::assembly::Model;
use agglo_core::placement::place;
use agglo_core::state::{Columns, Particles};

use super::measure::{cpu_seconds, median, row, threads};
use super::{Context, Row, Section};
use crate::Failure;

/// Repetitions of a measurement.
const ROUNDS: usize = 5;

pub fn run(context: &Context) -> Result<Section, Failure> {
    let mut rows = Vec::new();
    threads(1, || compare(context, &mut rows))??;
    Ok(Section {
        title: "Charged cloud without a cut-off",
        about: "Forces of n charges of both signs in a cube of mean spacing 1, exponents 2 and 4, weight `charge-product`; \
                `near_field.accuracy` against the sum over all pairs with the same kernel, computing time of one evaluation on \
                one thread. The sum over all pairs of a million is taken as a hundred times that of 1e5 in the same run."
            .to_owned(),
        rows,
        figure: None,
    })
}

fn compare(context: &Context, rows: &mut Vec<Row>) -> Result<(), Failure> {
    let n = if context.quick { 20_000 } else { 100_000 };
    let rounds = if context.quick { 1 } else { ROUNDS };
    let cloud = Cloud::new(n)?;
    let mut pairs = cloud.model(None)?;
    let (mut direct, mut exact) = (Vec::new(), Columns::zeros(n));
    for _ in 0..rounds {
        direct.push(seconds(&mut pairs, &cloud.r, &mut exact));
    }
    rows.push(row(format!("n = {n}, all pairs"), direct.clone(), "s", None));
    for (accuracy, limit) in [(1e-4, 1.0 / 20.0), (1e-6, 1.0 / 8.0)] {
        let mut model = cloud.model(Some(accuracy))?;
        let (mut times, mut force) = (Vec::new(), Columns::zeros(n));
        for _ in 0..rounds {
            times.push(seconds(&mut model, &cloud.r, &mut force));
        }
        let name = format!("n = {n}, accuracy {accuracy:e}");
        let ratios = times.iter().zip(&direct).map(|(far, direct)| far / direct).collect();
        let error = error(&force, &exact);
        rows.push(row(format!("{name}, over all pairs"), ratios, "-", Some(("limit".into(), limit))));
        rows.push(row(format!("{name}, error"), vec![error], "-", Some(("asked for".into(), accuracy))));
        rows.push(row(name, times, "s", None));
    }
    if context.quick {
        return Ok(());
    }
    let (n, whole) = (1_000_000, 100.0 * median(&direct));
    let cloud = Cloud::new(n)?;
    let mut model = cloud.model(Some(1e-4))?;
    let mut force = Columns::zeros(n);
    let times: Vec<f64> = (0..3).map(|_| seconds(&mut model, &cloud.r, &mut force)).collect();
    let ratios = times.iter().map(|far| far / whole).collect();
    let name = format!("n = {n}, accuracy 1e-4");
    rows.push(row(format!("{name}, over all pairs"), ratios, "-", Some(("limit".into(), 1.0 / 40.0))));
    rows.push(row(name, times, "s", None));
    Ok(())
}

/// Charges at rest.
struct Cloud {
    n: usize,
    particles: Particles,
    r: Columns,
}

impl Cloud {
    fn new(n: usize) -> Result<Self, Failure> {
        let (particles, state) = place(&super::parse(&text(n, None))?)?;
        Ok(Self { n, particles, r: state.position })
    }

    fn model(&self, accuracy: Option<f64>) -> Result<Model, Failure> {
        Ok(Model::new(&super::parse(&text(self.n, accuracy))?, &self.particles, &self.r))
    }
}

fn text(n: usize, accuracy: Option<f64>) -> String {
    let accuracy = accuracy.map_or(String::new(), |accuracy| format!(r#", "accuracy": {accuracy:e}"#));
    format!(
        r#"{{ "duration": 1, "particles": {{ "random_cube": {{
            "count": {n}, "side": {:?}, "radius_ratio": 0.25, "density": 2, "charge": [1, -1] }} }},
            "near_field": {{ "attraction": {{ "strength": 1, "exponent": 2 }},
                "repulsion": {{ "strength": 0.01, "exponent": 4 }}, "weight": "charge-product"{accuracy} }} }}"#,
        (n as f64).cbrt()
    )
}

fn seconds(model: &mut Model, r: &Columns, force: &mut Columns) -> f64 {
    let start = cpu_seconds();
    model.forces(r, force);
    cpu_seconds() - start
}

/// Root of the sum of squares of the differences, over that of the exact forces.
fn error(found: &Columns, exact: &Columns) -> f64 {
    let n = exact.len();
    let off: f64 = (0..n).map(|i| (found.get(i) - exact.get(i)).norm_squared()).sum();
    let all: f64 = (0..n).map(|i| exact.get(i).norm_squared()).sum();
    (off / all).sqrt()
}
