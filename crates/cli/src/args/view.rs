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
    #[arg(long, value_name = "ORIGIN", value_parser = origin)]
    pub allow_origin: Vec<String>,
}

/// An origin as browsers send it: scheme, host and perhaps a port, no path.
fn origin(text: &str) -> Result<String, String> {
    let origin = text.trim_end_matches('/');
    let host = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
    let named = |host: &str| {
        !host.is_empty() && host.bytes().all(|byte| byte.is_ascii_alphanumeric() || b".-_:[]".contains(&byte))
    };
    if host.is_some_and(named) {
        Ok(origin.to_owned())
    } else {
        Err("an origin is SCHEME://HOST or SCHEME://HOST:PORT, such as http://localhost:9090".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn origins_are_a_scheme_and_a_host() {
        assert_eq!(origin("http://localhost:9090/"), Ok("http://localhost:9090".to_owned()));
        assert!(origin("https://viewer.example").is_ok() && origin("http://[::1]:8080").is_ok());
        for wrong in
            ["*", "", "null", "viewer.example", "file:///tmp", "http://", "http://*", "http://a/b", "http://a b"]
        {
            assert!(origin(wrong).is_err(), "{wrong}");
        }
    }
}
