//! From CSV to particles.

use std::io::Read;

use agglo_core::scene::ListedParticle;

use super::COLUMNS;

/// Columns that a particle cannot do without.
const REQUIRED: &str = "x, y, z, radius and mass or density";

/// A column that may stand in place of `mass`; exports do not have it.
const DENSITY: &str = "density";

/// Something wrong in a CSV file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CsvError {
    /// Line, from 1; 0 for the whole file.
    pub line: u64,
    /// Column, from 1; 0 for the whole line.
    pub column: u64,
    /// What is wrong, as a sentence.
    pub message: String,
}

impl std::fmt::Display for CsvError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.line, self.column) {
            (0, _) => f.write_str(&self.message),
            (line, 0) => write!(f, "line {line}: {}", self.message),
            (line, column) => write!(f, "line {line}, column {column}: {}", self.message),
        }
    }
}

impl std::error::Error for CsvError {}

/// Reads particles from CSV with the columns of an export, in any order; of several times the last. Columns `vx`, `vy`,
/// `vz`, `charge`, `temperature` may be absent, `density` [kg/m^3] may stand for `mass`; `step`, `id` and `cluster` are
/// not used. Lines that begin with `#` are comments.
///
/// # Errors
/// The first thing that is wrong, with its line and column.
pub fn read_particles(input: impl Read) -> Result<Vec<ListedParticle>, CsvError> {
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).has_headers(false).flexible(true).from_reader(input);
    let mut header = csv::ByteRecord::new();
    read_row(&mut reader, &mut header)?;
    let columns = Columns::new(&header)?;
    let mut particles = Vec::new();
    let mut latest = f64::NEG_INFINITY;
    let mut record = csv::ByteRecord::new();
    while read_row(&mut reader, &mut record)? {
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != header.len() {
            let message = format!("there are {} values for {} columns", record.len(), header.len());
            return Err(CsvError { line, column: 0, message });
        }
        let row = Row { record: &record, line };
        let t = columns.t.map_or(Ok(latest.max(0.0)), |column| row.number("t", column))?;
        if t < latest {
            continue;
        }
        if t > latest {
            particles.clear();
            latest = t;
        }
        particles.push(columns.particle(&row)?);
    }
    if particles.is_empty() {
        return Err(CsvError { line: 0, column: 0, message: "there is no particle below the header".to_owned() });
    }
    Ok(particles)
}

/// Reads the next record that is no comment. The reader's own comments would count as part of the record after them, and
/// its line would be wrong.
fn read_row(reader: &mut csv::Reader<impl Read>, record: &mut csv::ByteRecord) -> Result<bool, CsvError> {
    while reader.read_byte_record(record).map_err(|e| from_csv(&e))? {
        if !record.get(0).is_some_and(|cell| cell.starts_with(b"#")) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Where the columns stand that are used.
struct Columns {
    t: Option<usize>,
    position: [usize; 3],
    velocity: [Option<usize>; 3],
    radius: usize,
    weight: Weight,
    charge: Option<usize>,
    temperature: Option<usize>,
}

/// Which column says how heavy a particle is.
#[derive(Clone, Copy)]
enum Weight {
    Mass(usize),
    Density(usize),
}

impl Columns {
    fn new(header: &csv::ByteRecord) -> Result<Self, CsvError> {
        // Comments may stand above the header; an empty file has none.
        let line = header.position().map_or(1, csv::Position::line);
        let mut names: Vec<String> = Vec::new();
        for (k, cell) in header.iter().enumerate() {
            let name = String::from_utf8_lossy(cell);
            // Spreadsheets put a byte order mark in front of UTF-8.
            let name = name.trim_start_matches('\u{feff}').to_owned();
            let fail = |message| Err(CsvError { line, column: k as u64 + 1, message });
            if name.contains([';', '\t']) {
                return fail(format!("the column {name:?} is several; columns are separated by commas"));
            }
            if name != DENSITY && !COLUMNS.contains(&name.as_str()) {
                let near = COLUMNS
                    .iter()
                    .chain([&DENSITY])
                    .max_by(|a, b| strsim::jaro_winkler(a, &name).total_cmp(&strsim::jaro_winkler(b, &name)));
                let meant = near.filter(|near| strsim::jaro_winkler(near, &name) > 0.8);
                let meant = meant.map(|near| format!("; did you mean {near:?}?")).unwrap_or_default();
                return fail(format!("the column {name:?} is none of {}{meant}", COLUMNS.join(", ")));
            }
            if names.contains(&name) {
                return fail(format!("there is a second column {name:?}"));
            }
            names.push(name);
        }
        let find = |name: &str| names.iter().position(|found| found == name);
        let need = |name: &str| {
            find(name).ok_or_else(|| CsvError {
                line,
                column: 0,
                message: format!("there is no column {name:?}; {REQUIRED} are needed"),
            })
        };
        let position = [need("x")?, need("y")?, need("z")?];
        let radius = need("radius")?;
        let weight = match (find("mass"), find(DENSITY)) {
            (Some(_), Some(column)) => {
                let message = "there is a column \"density\" beside \"mass\"; leave one of them out".to_owned();
                return Err(CsvError { line, column: column as u64 + 1, message });
            }
            (None, Some(column)) => Weight::Density(column),
            _ => Weight::Mass(need("mass")?),
        };
        Ok(Self {
            t: find("t"),
            position,
            velocity: [find("vx"), find("vy"), find("vz")],
            radius,
            weight,
            charge: find("charge"),
            temperature: find("temperature"),
        })
    }

    fn particle(&self, row: &Row<'_>) -> Result<ListedParticle, CsvError> {
        let [x, y, z] = self.position;
        let [vx, vy, vz] = self.velocity;
        let or_zero = |name, column: Option<usize>| column.map_or(Ok(0.0), |column| row.number(name, column));
        let (mass, density) = match self.weight {
            Weight::Mass(column) => (Some(row.positive("mass", column)?), None),
            Weight::Density(column) => (None, Some(row.positive(DENSITY, column)?)),
        };
        Ok(ListedParticle {
            position: [row.number("x", x)?, row.number("y", y)?, row.number("z", z)?],
            velocity: [or_zero("vx", vx)?, or_zero("vy", vy)?, or_zero("vz", vz)?],
            radius: row.positive("radius", self.radius)?,
            density,
            mass,
            temperature: self.temperature.map(|column| row.positive("temperature", column)).transpose()?,
            charge: self.charge.map(|column| row.number("charge", column)).transpose()?,
        })
    }
}

/// A line of the file.
struct Row<'a> {
    record: &'a csv::ByteRecord,
    line: u64,
}

impl Row<'_> {
    fn number(&self, name: &str, column: usize) -> Result<f64, CsvError> {
        let cell = String::from_utf8_lossy(self.record.get(column).unwrap_or_default());
        match cell.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.fail(column, format!("{name} is {cell:?}, not a finite number"))),
        }
    }

    fn positive(&self, name: &str, column: usize) -> Result<f64, CsvError> {
        match self.number(name, column)? {
            value if value > 0.0 => Ok(value),
            value => Err(self.fail(column, format!("{name} is {value:?}, but must be above 0"))),
        }
    }

    fn fail(&self, column: usize, message: String) -> CsvError {
        CsvError { line: self.line, column: column as u64 + 1, message }
    }
}

fn from_csv(error: &csv::Error) -> CsvError {
    let line = error.position().map_or(0, csv::Position::line);
    let message = match error.kind() {
        csv::ErrorKind::Io(e) => format!("cannot be read: {e}"),
        _ => error.to_string(),
    };
    CsvError { line, column: 0, message }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fails(text: &str) -> String {
        read_particles(text.as_bytes()).expect_err(text).to_string()
    }

    #[test]
    fn columns_are_found_by_name_and_the_last_time_wins() {
        let text =
            "t,mass,radius,z,y,x,vx,charge\n0,1,1,0,0,0,0,0\n1.5,2,0.5,3,2,1,-1,1e-9\n1.5,4,0.25,6,5,4,0,-1e-9\n";
        let particles = read_particles(text.as_bytes()).expect("a table");
        assert_eq!(particles.len(), 2);
        assert_eq!(particles[0].position, [1.0, 2.0, 3.0]);
        assert_eq!(particles[0].velocity, [-1.0, 0.0, 0.0]);
        assert_eq!((particles[1].radius, particles[1].mass), (0.25, Some(4.0)));
        assert_eq!(particles[1].charge, Some(-1e-9));
        assert_eq!(particles[1].temperature, None);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        assert_eq!(
            fails("x,y,z,radius\n0,0,0,1\n"),
            "line 1: there is no column \"mass\"; x, y, z, radius and mass or density are needed"
        );
        let near = fails("x,y,z,radius,mass,temprature\n");
        assert!(near.starts_with("line 1, column 6:") && near.contains("did you mean \"temperature\"?"), "{near}");
        assert_eq!(fails("x,x\n"), "line 1, column 2: there is a second column \"x\"");
        assert_eq!(
            fails("x,y,z,radius,mass\n0,0,0,1,1\n0,0,1 um,1,1\n"),
            "line 3, column 3: z is \"1 um\", not a finite number"
        );
        assert_eq!(fails("x,y,z,radius,mass\n0,0,0,1,0\n"), "line 2, column 5: mass is 0.0, but must be above 0");
        assert_eq!(fails("x,y,z,radius,mass\n0,0,NaN,1,1\n"), "line 2, column 3: z is \"NaN\", not a finite number");
        assert_eq!(fails("x,y,z,radius,mass\n0,0,0,1\n"), "line 2: there are 4 values for 5 columns");
        assert_eq!(fails("x,y,z,radius,mass\n"), "there is no particle below the header");
        assert_eq!(fails(""), "line 1: there is no column \"x\"; x, y, z, radius and mass or density are needed");
        let semicolons = fails("# a comment\nx;y;z;radius;mass\n0;0;0;1;1\n");
        assert!(semicolons.starts_with("line 2, column 1:"), "{semicolons}");
        assert!(semicolons.ends_with("columns are separated by commas"), "{semicolons}");
        assert!(fails("x,y,z,radius,mass,density\n0,0,0,1,1,1\n").contains("beside \"mass\""));
    }

    #[test]
    fn density_stands_for_mass_and_comments_are_passed_over() {
        let text = "# two spheres\nx,y,z,radius,density\n0,0,0,1,2000\n# the other one\n3,0,0,1,1000\n";
        let particles = read_particles(text.as_bytes()).expect("a table");
        let weights: Vec<_> = particles.iter().map(|p| (p.mass, p.density)).collect();
        assert_eq!(weights, [(None, Some(2000.0)), (None, Some(1000.0))]);
    }

    #[test]
    fn no_bytes_make_it_panic() {
        for text in
            [&b"\xff\xfe\x00"[..], b"x,y,z,radius,mass\n\xff,0,0,1,1\n", b"\"x", b"\xef\xbb\xbfx,y,z,radius,mass\n"]
        {
            assert!(read_particles(text).is_err());
        }
        let marked = b"\xef\xbb\xbfx,y,z,radius,mass\r\n0,0,0,1,1\r\n";
        assert_eq!(read_particles(&marked[..]).expect("a byte order mark is passed over").len(), 1);
    }
}
