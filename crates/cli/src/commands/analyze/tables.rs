//! An analysis as tables, a file each.

use std::fmt::Write as _;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use agglo_replay::analysis::history::Life;
use agglo_replay::analysis::{StateRow, StepRow};

use super::json::ending;
use crate::failure::Failure;
use crate::output::{self, Output};
use crate::target::Target;

/// What a row came to: the table's name with the error.
type Written = Result<(), (String, io::Error)>;

/// Names and columns of the tables.
const TABLES: [(&str, &str); 6] = [
    (
        "energy.csv",
        "t,step,kinetic,near_field,binding,external,thermal,reaction_heat,radiated,convected,impact_loss,friction_loss,\
         resting_loss,periodic_work,residual,px,py,pz,lx,ly,lz",
    ),
    ("steps.csv", "t,step,dt,iterations,rejected,contraction,impacts"),
    ("temperature.csv", "t,step,mean,min,max"),
    ("clusters.csv", "t,step,count,largest,singletons,mean_size,bonds,mean_gyration,gyration_of_largest"),
    ("cluster_sizes.csv", "t,step,size,count"),
    ("cluster_lives.csv", "id,from,to,end,from_start,largest"),
];
const ENERGY: usize = 0;
const STEPS: usize = 1;
const TEMPERATURE: usize = 2;
const CLUSTERS: usize = 3;
const SIZES: usize = 4;
const LIVES: usize = 5;

/// A table being written.
struct Table {
    output: Output,
    writer: BufWriter<Box<dyn Write + Send>>,
    /// Whether it is kept without rows.
    always: bool,
    rows: u64,
}

/// Tables being written; those that get no row do not appear.
pub struct Tables {
    tables: Vec<Table>,
    line: String,
}

impl Tables {
    /// Opens all tables in a folder, which is made if it does not exist.
    ///
    /// # Errors
    /// A folder that cannot be made or written to, tables that exist and are not to be replaced.
    pub fn open(folder: &Path, log: &Path, replace: bool) -> Result<Self, Failure> {
        std::fs::create_dir_all(folder).map_err(|error| Failure::open(folder, &error))?;
        let targets = TABLES.map(|(name, _)| Target::Path(folder.join(name)));
        for target in &targets {
            output::differs(target, Some(log))?;
            output::check(target, replace)?;
        }
        let mut tables = Vec::new();
        for (k, (target, (_, header))) in targets.iter().zip(TABLES).enumerate() {
            let output = Output::open(target, replace)?;
            let writer = output.writer().map_err(|error| Failure::write(output.name(), &error))?;
            let mut writer = BufWriter::with_capacity(1 << 16, writer);
            writeln!(writer, "{header}").map_err(|error| Failure::write(output.name(), &error))?;
            tables.push(Table { output, writer, always: k == ENERGY || k == STEPS, rows: 0 });
        }
        Ok(Self { tables, line: String::new() })
    }

    /// Gives the tables their names.
    ///
    /// # Errors
    /// A failing disk.
    pub fn finish(self) -> Result<(), Failure> {
        for Table { output, mut writer, always, rows } in self.tables {
            writer.flush().map_err(|error| Failure::write(output.name(), &error))?;
            drop(writer);
            if always || rows > 0 {
                output.finish()?;
            }
        }
        Ok(())
    }

    /// Takes a step.
    ///
    /// # Errors
    /// A table that cannot be written.
    pub fn step(&mut self, row: &StepRow) -> Written {
        let StepRow { t, step, dt, iterations, rejected, contraction, impacts } = *row;
        self.key(t, step);
        self.number(dt);
        _ = write!(self.line, ",{iterations},{rejected},");
        // A single iteration tells nothing of contraction.
        if !contraction.is_nan() {
            self.line.pop();
            self.number(contraction);
        }
        _ = write!(self.line, ",{impacts}");
        self.end(STEPS)
    }

    /// Takes a state.
    ///
    /// # Errors
    /// A table that cannot be written.
    pub fn state(&mut self, row: &StateRow) -> Written {
        let StateRow { t, step, ledger, momentum, angular_momentum, temperature, clusters } = row;
        let totals = &ledger.totals;
        let energies = [
            ledger.kinetic,
            ledger.near_field,
            ledger.binding,
            ledger.external,
            ledger.thermal,
            totals.reaction_heat,
            totals.radiated,
            totals.convected,
            totals.impact_loss,
            totals.friction_loss,
            totals.resting_loss,
            totals.periodic_work,
            ledger.residual,
        ];
        self.key(*t, *step);
        energies.iter().chain(momentum).chain(angular_momentum).for_each(|&value| self.number(value));
        self.end(ENERGY)?;
        if let Some(found) = temperature {
            self.key(*t, *step);
            [found.mean, found.min, found.max].into_iter().for_each(|value| self.number(value));
            self.end(TEMPERATURE)?;
        }
        let Some(found) = clusters else { return Ok(()) };
        self.key(*t, *step);
        _ = write!(self.line, ",{},{},{}", found.count, found.largest, found.singletons);
        self.number(found.mean_size);
        _ = write!(self.line, ",{}", found.bonds);
        self.number(found.mean_gyration);
        self.number(found.gyration_of_largest);
        self.end(CLUSTERS)?;
        for (size, count) in &found.sizes {
            self.key(*t, *step);
            _ = write!(self.line, ",{size},{count}");
            self.end(SIZES)?;
        }
        Ok(())
    }

    /// Takes a cluster that ended.
    ///
    /// # Errors
    /// A table that cannot be written.
    pub fn life(&mut self, life: &Life) -> Written {
        let Life { id, born, from_start, ended, end, largest } = *life;
        self.line.clear();
        _ = write!(self.line, "{id}");
        self.number(born);
        self.number(ended);
        _ = write!(self.line, ",{},{from_start},{largest}", ending(end));
        self.end(LIVES)
    }

    fn key(&mut self, t: f64, step: u64) {
        self.line.clear();
        self.number(t);
        self.line.remove(0);
        _ = write!(self.line, ",{step}");
    }

    /// Appends a comma and the shortest text that reads back to the same number.
    fn number(&mut self, value: f64) {
        _ = match value {
            _ if value.is_nan() => write!(self.line, ",NaN"),
            _ if value.is_infinite() => write!(self.line, ",{}Infinity", if value < 0.0 { "-" } else { "" }),
            _ => write!(self.line, ",{value:?}"),
        };
    }

    fn end(&mut self, table: usize) -> Written {
        self.line.push('\n');
        let table = &mut self.tables[table];
        table.rows += 1;
        table.writer.write_all(self.line.as_bytes()).map_err(|error| (table.output.name().to_owned(), error))
    }
}
