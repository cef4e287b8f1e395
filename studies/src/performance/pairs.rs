//! (b) All pairs of a small cloud: the force kernel, against C kernels built in the same run.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use agglo_core::assembly::Model;
use agglo_core::placement::place;
use agglo_core::state::Columns;

use super::measure::{cpu_seconds, median, row, threads};
use super::{Context, Row, Section};
use crate::Failure;

/// Times of agglo [s], and of the two C kernels where there is a compiler.
type Times = (Vec<f64>, Option<[Vec<f64>; 2]>);

/// The yardstick; compiled twice, with and without freedom.
const SOURCE: &str = include_str!("pairs.c");
/// Repetitions of a measurement.
const ROUNDS: usize = 9;

pub fn run(context: &Context) -> Result<Section, Failure> {
    let mut rows = Vec::new();
    for n in [1000, 4000] {
        threads(1, || compare(context, n, &mut rows))??;
    }
    threads(1, || -> Result<(), Failure> {
        let cloud = Cloud::new(1000, (1.3, 2.4))?;
        let (values, _) = cloud.measure(context, None)?;
        rows.push(row("n = 1000, exponents 1.3 and 2.4", values, "ns/pair", Some(("limit".into(), 6.0))));
        Ok(())
    })??;
    let compiler = if context.compiler.is_some() { "" } else { " No C compiler was found." };
    Ok(Section {
        title: "All pairs",
        about: format!(
            "Forces of n particles in a unit cube, exponents 1 and 2 unless said otherwise, weight `mass-product`, cut-off \
             1.0; nanoseconds of computing per unordered pair inside the cut-off, one thread. The C kernels \
             (`studies/src/performance/pairs.c`) evaluate each pair once as ours does: the restricted one with the same \
             exact operations, the unrestricted one with fused multiply-add and approximate reciprocal roots, which differ \
             between machines.{compiler}"
        ),
        rows,
        figure: None,
    })
}

/// Ours and both C kernels in turn, for one size.
fn compare(context: &Context, n: usize, rows: &mut Vec<Row>) -> Result<(), Failure> {
    let cloud = Cloud::new(n, (1.0, 2.0))?;
    let kernels = context.compiler.as_deref().map(|compiler| Kernels::build(context, compiler)).transpose()?;
    let (ours, theirs) = cloud.measure(context, kernels.as_ref())?;
    rows.push(row(format!("n = {n}"), ours.clone(), "ns/pair", Some(("limit".into(), 2.0))));
    if let Some([restricted, unrestricted]) = theirs {
        let ratio = |theirs: &[f64]| ours.iter().zip(theirs).map(|(a, b)| a / b).collect::<Vec<_>>();
        let limit = Some(("restricted C kernel".into(), 1.3));
        rows.push(row(format!("n = {n}, over the restricted C kernel"), ratio(&restricted), "-", limit));
        rows.push(row(format!("n = {n}, over the unrestricted C kernel"), ratio(&unrestricted), "-", None));
        rows.push(row(format!("n = {n}, the restricted C kernel"), restricted, "ns/pair", None));
        rows.push(row(format!("n = {n}, the unrestricted C kernel"), unrestricted, "ns/pair", None));
    }
    Ok(())
}

/// A cloud whose pair forces are to be had.
struct Cloud {
    model: Model,
    r: Columns,
    inside: f64,
}

impl Cloud {
    fn new(n: usize, (attraction, repulsion): (f64, f64)) -> Result<Self, Failure> {
        let text = format!(
            r#"{{ "duration": 1, "particles": {{ "random_cube": {{
                "count": {n}, "side": 1, "radius_ratio": 0.25, "density": 2000 }} }},
                "near_field": {{ "attraction": {{ "strength": 0.5, "exponent": {attraction} }},
                    "repulsion": {{ "strength": 0.25, "exponent": {repulsion} }},
                    "weight": "mass-product", "cutoff": 1.0 }} }}"#
        );
        let scene = super::parse(&text)?;
        let (particles, state) = place(&scene)?;
        let r = state.position;
        let model = Model::new(&scene, &particles, &r);
        let close = |i: usize| (0..i).filter(|&j| (r.get(i) - r.get(j)).norm() <= 1.0).count();
        let inside = (0..n).map(close).sum::<usize>() as f64;
        Ok(Self { model, r, inside })
    }

    /// Nanoseconds per pair, ours and those of C kernels, round by round.
    fn measure(mut self, context: &Context, kernels: Option<&Kernels>) -> Result<Times, Failure> {
        let n = self.r.len();
        let repetitions = (20_000_000 / (n * n)).max(3);
        let mut force = Columns::zeros(n);
        let positions = context.scratch.join("positions.txt");
        if kernels.is_some() {
            let mut text = format!("{n} {repetitions}\n");
            for i in 0..n {
                let r = self.r.get(i);
                writeln!(text, "{:?} {:?} {:?}", r.x, r.y, r.z)?;
            }
            std::fs::write(&positions, text)?;
        }
        let (mut ours, mut theirs) = (Vec::new(), [Vec::new(), Vec::new()]);
        for _ in 0..if context.quick { 1 } else { ROUNDS } {
            let each: Vec<f64> = (0..3)
                .map(|_| {
                    let start = cpu_seconds();
                    for _ in 0..repetitions {
                        self.model.forces(&self.r, &mut force);
                    }
                    (cpu_seconds() - start) / repetitions as f64
                })
                .collect();
            ours.push(median(&each) / self.inside * 1e9);
            if let Some(kernels) = kernels {
                for (values, kernel) in theirs.iter_mut().zip([&kernels.restricted, &kernels.unrestricted]) {
                    values.push(seconds(kernel, &positions)? / self.inside * 1e9);
                }
            }
        }
        Ok((ours, kernels.map(|_| theirs)))
    }
}

/// The C kernels, built.
struct Kernels {
    restricted: PathBuf,
    unrestricted: PathBuf,
}

impl Kernels {
    fn build(context: &Context, compiler: &Path) -> Result<Self, Failure> {
        let source = context.scratch.join("pairs.c");
        std::fs::write(&source, SOURCE)?;
        let build = |name: &str, flags: &[&str]| -> Result<PathBuf, Failure> {
            let program = context.scratch.join(name);
            let mut command = Command::new(compiler);
            command.args(["-O3", "-march=native", "-fopenmp-simd"]).args(flags);
            let done = command.arg(&source).arg("-o").arg(&program).arg("-lm").status()?;
            if done.success() {
                Ok(program)
            } else {
                Err(format!("{} does not build {name}", compiler.display()).into())
            }
        };
        let restricted = build("restricted", &["-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"])?;
        let unrestricted = build("unrestricted", &["-Ofast", "-mrecip=all", "-DUNRESTRICTED"])?;
        Ok(Self { restricted, unrestricted })
    }
}

/// Seconds per evaluation that a C kernel says.
fn seconds(kernel: &Path, positions: &Path) -> Result<f64, Failure> {
    let output = Command::new(kernel).arg(positions).output()?;
    let text = String::from_utf8(output.stdout)?;
    Ok(text.trim().parse().map_err(|_| format!("{} says `{text}`", kernel.display()))?)
}
