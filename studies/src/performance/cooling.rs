//! (e) Free cooling of inelastic hard spheres: no fields, straight flights and located impacts.

use agglo_core::{Scene, Simulation};

use super::measure::{Unrecorded, cpu_seconds, row, threads};
use super::{Context, Row, Section};
use crate::Failure;

/// Share of the volume that the spheres fill [-].
const FILLED: f64 = 0.0655;
/// End, and Haff's time for a temperature of 1, in units of diameter, mass and that temperature.
const END: f64 = 26.57;
const HAFF: f64 = 30.05;
/// Temperature over Haff's at the end, from six runs of the event-driven program `DynamO`, and its standard error.
const EXPECTED: (f64, f64) = (1.0081, 0.0017);

/// What a run came to.
struct Cooled {
    /// Computing time of all threads [s].
    cpu: f64,
    impacts: u64,
    /// Deepest overlap [diameters].
    overlap: f64,
    /// Temperature at the end over Haff's [-].
    over_haff: f64,
}

fn scene(n: usize, seed: u64) -> Result<Scene, Failure> {
    let side = (n as f64 * std::f64::consts::PI / 6.0 / FILLED).cbrt();
    let spread = 3_f64.sqrt();
    super::parse(&format!(
        r#"{{ "duration": {END}, "seed": {seed}, "particles": {{ "random_cube": {{ "count": {n}, "side": {side:?},
            "radius": 0.5, "density": {:?}, "velocity_spread": [{spread:?}, {spread:?}, {spread:?}] }} }},
            "contact": {{ "restitution": 0.9, "rest_speed": 0.0 }},
            "domain": {{ "periodic": [{side:?}, {side:?}, {side:?}] }},
            "solver": {{ "step": {{ "initial": 0.05, "max": 0.2 }} }}, "record": {{ "interval": 10 }} }}"#,
        6.0 / std::f64::consts::PI
    ))
}

/// Mean square of the velocities about their mean, over three: the temperature in units of mass.
fn temperature(simulation: &Simulation) -> f64 {
    let axes = simulation.state().velocity.axes();
    let variance = |v: &[f64]| {
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        v.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / v.len() as f64
    };
    axes.into_iter().map(variance).sum::<f64>() / 3.0
}

fn cool(n: usize, seed: u64) -> Result<Cooled, Failure> {
    let mut simulation = Simulation::new(&scene(n, seed)?)?;
    let first = temperature(&simulation);
    let start = cpu_seconds();
    let outcome = simulation.run(&mut Unrecorded::default())?;
    let cpu = cpu_seconds() - start;
    let haff = first / (1.0 + first.sqrt() * END / HAFF).powi(2);
    let counters = outcome.counters;
    Ok(Cooled {
        cpu,
        impacts: counters.impacts,
        overlap: counters.max_overlap,
        over_haff: temperature(&simulation) / haff,
    })
}

pub fn run(context: &Context) -> Result<Section, Failure> {
    let sizes: &[(usize, u64)] = if context.quick { &[(1000, 2)] } else { &[(1000, 5), (10_000, 20), (100_000, 1)] };
    let mut rows = Vec::new();
    for &(n, seeds) in sizes {
        let runs = threads(1, || (1..=seeds).map(|seed| cool(n, seed)).collect::<Result<Vec<_>, Failure>>())??;
        let limit = [(1000, 0.1), (10_000, 1.0)].into_iter().find(|&(size, _)| size == n);
        let limit = limit.map(|(_, limit)| ("limit".to_owned(), limit));
        rows.push(row(format!("n = {n}"), runs.iter().map(|run| run.cpu).collect(), "s", limit));
        let each = runs.iter().map(|run| run.cpu / run.impacts as f64 * 1e6).collect();
        rows.push(row(format!("n = {n}, each impact"), each, "us", None));
        let overlaps = runs.iter().map(|run| run.overlap).collect();
        rows.push(row(format!("n = {n}, deepest overlap"), overlaps, "diameters", Some(("limit".into(), 1e-9))));
        if seeds >= 20 {
            rows.extend(against_haff(n, &runs));
        }
    }
    Ok(Section {
        title: "Free cooling",
        about: format!(
            "Hard spheres in a periodic box, restitution 0.9, volume fraction {FILLED}, about 20 impacts of each particle, no \
             recording, one thread, computing time; every run has a seed of its own. Peers on another machine of this kind, \
             n = 10000: DynamO (event-driven) 1.63 s, LAMMPS (soft spheres) 10.1 s."
        ),
        rows,
        figure: None,
    })
}

/// Mean over the seeds, and how far it is from what an event-driven program found.
fn against_haff(n: usize, runs: &[Cooled]) -> [Row; 2] {
    let values: Vec<f64> = runs.iter().map(|run| run.over_haff).collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let error = (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0) / count).sqrt();
    let away = (mean - EXPECTED.0).abs() / error.hypot(EXPECTED.1);
    [
        row(
            format!("n = {n}, temperature over Haff's, mean of {count} seeds"),
            vec![mean - error, mean, mean + error],
            "-",
            None,
        ),
        row(
            format!("n = {n}, its distance from DynamO's {} ± {}, in standard errors", EXPECTED.0, EXPECTED.1),
            vec![away],
            "-",
            Some(("limit".into(), 3.0)),
        ),
    ]
}
