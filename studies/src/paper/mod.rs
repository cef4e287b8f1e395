//! The paper, reproduced: its eight cases, its tables and figures, and its claims put to the test.

mod claims;
pub mod curves;
pub mod figures;
pub mod plan;
mod prose;
mod tables;
mod template;

use std::path::Path;

use plan::{Results, Seeds};

use crate::Failure;
use crate::progress::Progress;
use crate::run::run_all;

/// A generated file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File {
    /// Path from the repository's root.
    pub path: String,
    /// Content.
    pub text: String,
}

/// Runs all cases and makes the page and its figures. The same for every number of threads.
///
/// # Errors
/// A scene that cannot be read, a run that fails, a page with gaps.
pub fn generate(root: &Path, seeds: u64) -> Result<Vec<File>, Failure> {
    let seeds = Seeds::new(seeds);
    let plan = plan::setups(seeds);
    let cases = plan::cases(root, &plan)?;
    let runs = run_all(&cases, &Progress::new(cases.len()))?;
    files(&Results::new(seeds, &plan, runs))
}

fn files(results: &Results) -> Result<Vec<File>, Failure> {
    let mut values = tables::values(results);
    values.extend(prose::values(results));
    values.insert("claims", claims::claims(results));
    let mut files =
        vec![File { path: "docs/paper.md".to_owned(), text: template::fill(include_str!("page.md"), &values)? }];
    for (number, quantity, binding) in figures::FIGURES {
        let text = figures::draw(quantity, binding, results)?;
        files.push(File { path: format!("docs/paper/figure-{number}.svg"), text });
    }
    Ok(files)
}
