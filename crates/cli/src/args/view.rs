//! Arguments of `agglo view`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `agglo view`.
#[derive(Args, Debug)]
pub struct ViewArgs {
    /// Log file
    pub log: PathBuf,
    /// Open the log in Rerun, arranged, instead of serving it; needs Rerun's program `rerun`
    #[arg(long, conflicts_with_all = ["port", "open", "allow_origin"])]
    pub rerun: bool,
    /// Port to serve on; 0 takes a free one
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub port: u16,
    /// Open the log in Foxglove, in the browser
    #[arg(long)]
    pub open: bool,
    /// Let a page of this origin read the log as well, such as `http://localhost:9090` for a viewer that you serve
    /// yourself
    #[arg(long, value_name = "ORIGIN")]
    pub allow_origin: Vec<String>,
}
