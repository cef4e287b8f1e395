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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    #[test]
    fn every_gap_of_the_page_is_filled_and_every_figure_drawn() {
        let seeds = Seeds::new(3);
        let plan = plan::setups(seeds);
        let count: u64 = plan.iter().map(|(_, count)| count).sum();
        let run = |k: u64| Run {
            times: vec![0.0, 5.0],
            kinetic: vec![0.7, 0.5 + 1e-3 * k as f64],
            temperature: vec![300.0, 320.0 + k as f64],
            ..Run::default()
        };
        let files = files(&Results::new(seeds, &plan, (0..count).map(run).collect())).unwrap();
        let paths: Vec<&str> = files.iter().map(|file| file.path.as_str()).collect();
        assert_eq!(
            paths,
            [
                "docs/paper.md",
                "docs/paper/figure-6.svg",
                "docs/paper/figure-7.svg",
                "docs/paper/figure-8.svg",
                "docs/paper/figure-9.svg"
            ]
        );
        assert!(!files[0].text.contains("{{"), "{}", files[0].text);
        for figure in &files[1..] {
            assert!(figure.text.starts_with("<svg ") && figure.text.ends_with("</svg>\n"), "{}", figure.path);
            let name = figure.path.strip_prefix("docs/").unwrap();
            assert!(files[0].text.contains(&format!("({name})")), "the page does not show {name}");
        }
    }

    /// The page in the repository takes minutes to make; that its text is the current one is seen at once.
    #[test]
    fn the_page_in_the_repository_has_this_text() {
        let page = include_str!("../../../docs/paper.md");
        let mut rest = page;
        for piece in
            include_str!("page.md").split("{{").map(|piece| piece.split_once("}}").map_or(piece, |(_, text)| text))
        {
            let Some(at) = rest.find(piece) else {
                panic!("docs/paper.md lacks `{piece}`: run `cargo run --release -p agglo-studies --bin paper`")
            };
            rest = &rest[at + piece.len()..];
        }
        assert_eq!(rest, "", "docs/paper.md goes on where its text ends");
    }
}
