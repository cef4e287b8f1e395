//! Arguments of `agglo replay`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `agglo replay`.
#[derive(Args, Debug)]
pub struct ReplayArgs {
    /// Log file
    pub log: PathBuf,
    /// Time to begin at [s]; with --verify the last checkpoint at or before it [default: the start]
    #[arg(long, value_name = "T", value_parser = time, allow_negative_numbers = true)]
    pub from: Option<f64>,
    /// Solve the run again and compare every message bit for bit
    #[arg(long)]
    pub verify: bool,
    /// Print JSON: an object a line, with --verify one object
    #[arg(long)]
    pub json: bool,
}

fn time(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(t) if t.is_finite() && t >= 0.0 => Ok(t),
        _ => Err(format!("{text:?} is not a time in seconds from 0 on")),
    }
}
