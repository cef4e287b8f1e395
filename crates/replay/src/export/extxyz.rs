//! Extended XYZ: a state is a line with the number of particles, a line that describes the columns, and a line per
//! particle. OVITO takes radii, masses, charges, velocities and numbers from columns of these names, and ASE reads them as
//! arrays.

use std::fmt::Write as _;
use std::io::Write;

use agglo_core::scene::{Domain, Scene};
use agglo_core::state::Particles;
use agglo_record::cloud::Frame;

use super::ExportError;
use crate::csv::number;

/// What stands for a particle where other programs expect a chemical symbol.
const SPECIES: &str = "X";

/// Writes states one behind the other.
pub struct ExtendedXyz<W> {
    out: W,
    periodic: [Option<f64>; 3],
    line: String,
}

impl<W: Write> ExtendedXyz<W> {
    /// A file of states of a scene.
    #[must_use]
    pub fn new(out: W, scene: Option<&Scene>) -> Self {
        let periodic =
            scene.and_then(|scene| scene.domain.as_ref()).and_then(|Domain { periodic, walls: _ }| *periodic);
        Self { out, periodic: periodic.unwrap_or_default(), line: String::new() }
    }

    /// Writes a state; returns the number of particles.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn write(&mut self, frame: &Frame, particles: &Particles) -> Result<u64, ExportError> {
        let Frame { t, step, position, velocity, temperature, cluster } = frame;
        let Particles { radius, mass, charge } = particles;
        let n = position.len().min(radius.len());
        writeln!(self.out, "{n}")?;
        let mut header = self.cell(frame, particles, n);
        header += "Properties=species:S:1:pos:R:3:velo:R:3:radius:R:1:mass:R:1";
        for (name, on) in [("charge:R:1", charge.is_some()), ("temperature:R:1", temperature.is_some())] {
            if on {
                _ = write!(header, ":{name}");
            }
        }
        header += if cluster.is_some() { ":cluster:I:1:id:I:1" } else { ":id:I:1" };
        // The shortest texts that read back to the same numbers.
        _ = write!(header, " Time={t:?} Step={step}");
        writeln!(self.out, "{header}")?;
        for k in 0..n {
            let line = &mut self.line;
            line.clear();
            line.push_str(SPECIES);
            for column in position.axes().into_iter().chain(velocity.axes()).chain([&radius[..], &mass[..]]) {
                line.push(' ');
                number(line, column[k]);
            }
            for column in [charge, temperature].into_iter().flatten() {
                line.push(' ');
                number(line, column[k]);
            }
            if let Some(cluster) = cluster {
                _ = write!(line, " {}", cluster[k]);
            }
            _ = writeln!(line, " {k}");
            self.out.write_all(line.as_bytes())?;
        }
        Ok(n as u64)
    }

    /// Box and periodic directions. An open direction of a box is as long as the cloud; a cloud in the open has no box.
    fn cell(&self, frame: &Frame, particles: &Particles, n: usize) -> String {
        let flags = self.periodic.map(|length| if length.is_some() { "T" } else { "F" }).join(" ");
        if self.periodic.iter().all(Option::is_none) {
            return format!("pbc=\"{flags}\" ");
        }
        let span = |axis: usize| -> (f64, f64) {
            if let Some(length) = self.periodic[axis] {
                return (0.0, length);
            }
            let column = frame.position.axes()[axis];
            let reach = |low: f64, high: f64, k: usize| {
                (low.min(column[k] - particles.radius[k]), high.max(column[k] + particles.radius[k]))
            };
            let (low, high) = (0..n).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), k| reach(low, high, k));
            if low < high { (low, high - low) } else { (0.0, 1.0) }
        };
        let [(x, a), (y, b), (z, c)] = [span(0), span(1), span(2)];
        format!("Lattice=\"{a:?} 0.0 0.0 0.0 {b:?} 0.0 0.0 0.0 {c:?}\" Origin=\"{x:?} {y:?} {z:?}\" pbc=\"{flags}\" ")
    }

    /// Completes the file.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn finish(mut self) -> Result<(), ExportError> {
        Ok(self.out.flush()?)
    }
}
