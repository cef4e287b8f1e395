//! What agglo takes, each case against its limit or a peer in the same run; `docs/performance.md` is made of it.
//!
//! A case is a file of its own and a line in [`CASES`].

mod cloud;
mod cooling;
mod effects;
mod far;
mod fluid;
mod measure;
mod page;
mod pairs;
mod paper;
mod recording;
mod scaling;
mod threads;

use std::path::PathBuf;

pub use cloud::child;
pub use page::page;

use agglo_core::{Scene, SetupError};

use crate::Failure;

/// A scene from its text.
fn parse(text: &str) -> Result<Scene, Failure> {
    Ok(Scene::parse(text, &[]).map_err(|problems| SetupError { problems })?)
}

/// What cases may use.
#[derive(Clone, Debug)]
pub struct Context {
    /// The workspace's folder.
    pub root: PathBuf,
    /// A folder for files that nobody needs afterwards.
    pub scratch: PathBuf,
    /// LAMMPS's program, where there is one.
    pub lammps: Option<PathBuf>,
    /// A C compiler, where there is one.
    pub compiler: Option<PathBuf>,
    /// Shorter runs, to see whether everything works.
    pub quick: bool,
}

/// One measured number.
#[derive(Clone, Debug)]
pub struct Row {
    /// What was measured.
    pub what: String,
    /// Median.
    pub value: f64,
    /// Smallest and largest.
    pub spread: (f64, f64),
    /// Unit.
    pub unit: &'static str,
    /// What it is held against: its name, and the largest value allowed.
    pub limit: Option<(String, f64)>,
}

/// What a case found.
#[derive(Clone, Debug)]
pub struct Section {
    /// Heading.
    pub title: &'static str,
    /// What was run, in a sentence or two.
    pub about: String,
    /// Numbers.
    pub rows: Vec<Row>,
    /// A diagram: its name and SVG.
    pub figure: Option<(&'static str, String)>,
}

/// A case.
pub struct Case {
    /// Its name on the command line.
    pub name: &'static str,
    /// Runs it.
    pub run: fn(&Context) -> Result<Section, Failure>,
}

/// All cases, in the order of the page.
pub const CASES: &[Case] = &[
    Case { name: "paper", run: paper::run },
    Case { name: "pairs", run: pairs::run },
    Case { name: "fluid", run: fluid::run },
    Case { name: "cloud", run: cloud::run },
    Case { name: "cooling", run: cooling::run },
    Case { name: "far", run: far::run },
    Case { name: "recording", run: recording::run },
    Case { name: "effects", run: effects::run },
    Case { name: "threads", run: threads::run },
];
