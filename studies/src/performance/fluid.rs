//! (c) A Lennard-Jones fluid, whole steps, against LAMMPS.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use agglo_core::Scene;
use rand::{Rng, SeedableRng};

use super::measure::{row, solve, threads};
use super::{Context, Row, Section};
use crate::Failure;

/// Reduced density of LAMMPS's benchmark [1/sigma^3].
const DENSITY: f64 = 0.8442;
/// Its temperature at the start.
const TEMPERATURE: f64 = 1.44;

/// LAMMPS's benchmark `in.lj`, from our start, with the potential shifted to zero at the cut-off as ours is.
const INPUT: &str = "units lj
atom_style atomic
read_data fluid.data
pair_style lj/cut 2.5
pair_coeff 1 1 1.0 1.0 2.5
pair_modify shift yes
neighbor 0.3 bin
neigh_modify delay 0 every 20 check no
fix 1 all nve
thermo_style custom step pe
thermo_modify norm no format float %.17g
thermo 100000
";

/// A lattice with random velocities.
pub struct Fluid {
    length: f64,
    position: Vec<[f64; 3]>,
    velocity: Vec<[f64; 3]>,
}

impl Fluid {
    /// A face-centred cubic lattice of `cells`^3 cells.
    pub fn new(cells: usize) -> Self {
        let width = (4.0 / DENSITY).cbrt();
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(87287);
        let spread = (12.0 * TEMPERATURE).sqrt();
        let (mut position, mut velocity) = (Vec::new(), Vec::new());
        for k in 0..cells * cells * cells {
            let corner = [k % cells, k / cells % cells, k / cells / cells];
            for site in [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]] {
                // A little off the lattice, where the energy would be a sum of few equal terms.
                let mut uniform = || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
                position.push(std::array::from_fn(|a| (corner[a] as f64 + site[a] + 0.25 + 0.02 * uniform()) * width));
                velocity.push(std::array::from_fn(|_| spread * uniform()));
            }
        }
        Self { length: width * cells as f64, position, velocity }
    }

    /// Number of atoms.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// As a scene of so many steps.
    pub fn scene(&self, steps: u64) -> Result<Scene, Failure> {
        let atom = |(r, v): (&[f64; 3], &[f64; 3])| {
            format!(r#"{{ "position": {r:?}, "velocity": {v:?}, "radius": 0.5, "mass": 1.0 }}"#)
        };
        let atoms: Vec<String> = self.position.iter().zip(&self.velocity).map(atom).collect();
        let text = format!(
            r#"{{ "duration": {}, "particles": {{ "list": [{}] }},
                "near_field": {{ "attraction": {{ "strength": 24, "exponent": 7 }},
                    "repulsion": {{ "strength": 48, "exponent": 13 }}, "weight": "none", "cutoff": 2.5 }},
                "domain": {{ "periodic": [{l:?}, {l:?}, {l:?}] }},
                "solver": {{ "integrator": "velocity-verlet", "crossings": "ignored", "step": {{ "fixed": 0.005 }} }},
                "record": {{ "every_steps": 1000000 }} }}"#,
            0.005 * steps as f64,
            atoms.join(","),
            l = self.length
        );
        super::parse(&text)
    }

    fn write(&self, path: &Path) -> Result<(), Failure> {
        let l = self.length;
        let mut text = format!("fluid\n\n{} atoms\n1 atom types\n\n", self.len());
        for axis in ["x", "y", "z"] {
            writeln!(text, "0 {l:?} {axis}lo {axis}hi")?;
        }
        text.push_str("\nMasses\n\n1 1.0\n\nAtoms\n\n");
        for (i, r) in self.position.iter().enumerate() {
            writeln!(text, "{} 1 {:?} {:?} {:?}", i + 1, r[0], r[1], r[2])?;
        }
        text.push_str("\nVelocities\n\n");
        for (i, v) in self.velocity.iter().enumerate() {
            writeln!(text, "{} {:?} {:?} {:?}", i + 1, v[0], v[1], v[2])?;
        }
        Ok(std::fs::write(path, text)?)
    }
}

pub fn run(context: &Context) -> Result<Section, Failure> {
    let (rounds, steps) = if context.quick { (1, 20) } else { (5, 100) };
    let fluid = Fluid::new(20);
    let scene = fluid.scene(steps)?;
    let (mut ours, mut theirs, mut energies) = (Vec::new(), Vec::new(), (f64::NAN, f64::NAN));
    let each = (fluid.len() as u64 * steps) as f64;
    for _ in 0..rounds {
        let solved = threads(1, || solve(&scene))??;
        ours.push(solved.cpu / each * 1e9);
        energies.0 = solved.first_energy;
        if let Some(lammps) = &context.lammps {
            let (seconds, energy) = peer(context, lammps, &fluid, steps)?;
            theirs.push(seconds / each * 1e9);
            energies.1 = energy;
        }
    }
    let mut rows: Vec<Row> = vec![row("agglo", ours.clone(), "ns/atom-step", Some(("limit".into(), 250.0)))];
    let about = if theirs.is_empty() {
        "LAMMPS was not found.".to_owned()
    } else {
        let ratio = ours.iter().zip(&theirs).map(|(a, b)| a / b).collect();
        rows.push(row("over LAMMPS lj/cut", ratio, "-", Some(("limit".into(), 0.6))));
        rows.push(row("LAMMPS lj/cut", theirs, "ns/atom-step", None));
        let difference = ((energies.0 - energies.1) / energies.1).abs();
        rows.push(row(
            "relative difference of the first energies",
            vec![difference],
            "-",
            Some(("limit".into(), 1e-10)),
        ));
        String::new()
    };
    Ok(Section {
        title: "Lennard-Jones fluid",
        about: format!(
            "{} atoms at reduced density {DENSITY}, periodic, cut-off 2.5 sigma, {steps} steps of 0.005 from a lattice, no \
             recording; whole steps, list builds included, one thread, computing time; like LAMMPS's, our scene does not locate crossings of the \
             cut-off. LAMMPS runs its benchmark `in.lj` \
             (skin 0.3, lists every 20 steps without a check) from the same start. {about}",
            fluid.len()
        ),
        rows,
        figure: None,
    })
}

/// Computing seconds of LAMMPS's loop, and its first energy.
fn peer(context: &Context, lammps: &Path, fluid: &Fluid, steps: u64) -> Result<(f64, f64), Failure> {
    let folder = &context.scratch;
    fluid.write(&folder.join("fluid.data"))?;
    std::fs::write(folder.join("in.fluid"), format!("{INPUT}run {steps}\n"))?;
    let output = Command::new(lammps).args(["-in", "in.fluid", "-log", "none"]).current_dir(folder).output()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let word =
        |line: &str, k: usize| line.split_whitespace().nth(k).and_then(|word| word.trim_end_matches('%').parse().ok());
    let find = |start: &str, k: usize| {
        text.lines().map(str::trim).find(|line| line.starts_with(start)).and_then(|line| word(line, k))
    };
    let share = text.lines().find(|line| line.contains("% CPU use")).and_then(|line| word(line, 0)).unwrap_or(100.0);
    match (find("Loop time of", 3), find("0 ", 1)) {
        (Some(seconds), Some(energy)) => Ok((seconds * share / 100.0, energy)),
        _ => Err(format!("LAMMPS did not run: {text}{}", String::from_utf8_lossy(&output.stderr)).into()),
    }
}
