//! Arguments of `agglo study`.

use clap::Args;

use super::SceneArgs;
use crate::target::Target;

/// Arguments of `agglo study`.
#[derive(Args, Debug)]
pub struct StudyArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// What to try: `paper`, or integrators of the model `consistent`, each also with `+newton` [default: all of them,
    /// without Newton's method]
    #[arg(long, value_name = "SCHEME,..", value_delimiter = ',', value_parser = agglo_study::Scheme::parse)]
    pub schemes: Vec<agglo_study::Scheme>,
    /// Fixed steps to try, in seconds [default: found from the scene]
    #[arg(long, value_name = "SECONDS,..", value_delimiter = ',', value_parser = positive)]
    pub steps: Vec<f64>,
    /// Tolerances to try, in mean diameters [default: 1e-3 to 1e-12]
    #[arg(long, value_name = "TOLERANCE,..", value_delimiter = ',', value_parser = positive)]
    pub tolerances: Vec<f64>,
    /// Measure every time this often, and take the median
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeats: u32,
    /// Stop measuring after this time; what is left out is said
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = positive)]
    pub budget: f64,
    /// Where the scene is chaotic, also run this many seeds to its end and give means and standard errors
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seeds: u32,
    /// Write the study as JSON; `-` writes to standard output
    #[arg(long, value_name = "FILE")]
    pub json: Option<Target>,
    /// Write the measurements as CSV; `-` writes to standard output
    #[arg(long, value_name = "FILE")]
    pub csv: Option<Target>,
    /// Draw wall time against error as SVG; `-` writes to standard output
    #[arg(long, value_name = "FILE.svg")]
    pub svg: Option<Target>,
    /// Write a page as Markdown; `-` writes to standard output
    #[arg(long, value_name = "FILE.md")]
    pub markdown: Option<Target>,
    /// Replace files that exist
    #[arg(long)]
    pub overwrite: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a number above zero, such as 1e-3".to_owned()),
    }
}
