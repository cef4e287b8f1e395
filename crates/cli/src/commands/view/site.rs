//! What `agglo view` serves: one log, its layout, to named origins; and the links that open it.

use std::fmt::Write;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// Pages that may read the log: the viewers' own, and a viewer of one's own at the port that Lichtblick's image serves on.
const ORIGINS: [&str; 4] = [
    "https://app.foxglove.dev",
    "https://lichtblick-suite.github.io",
    "http://localhost:8080",
    "http://127.0.0.1:8080",
];

/// The web apps of the viewers.
const FOXGLOVE: &str = "https://app.foxglove.dev/~/view";
const LICHTBLICK: &str = "https://lichtblick-suite.github.io/lichtblick/";

/// One log, ready to be served.
#[derive(Debug)]
pub struct Site {
    /// The log.
    pub log: PathBuf,
    /// Its name in the address: letters, digits, `-`, `_`, `.`, and `.mcap` at the end, by which viewers know it.
    pub name: String,
    /// The layout that fits it.
    pub layout: Vec<u8>,
    /// The secret in the address: whoever does not know it gets nothing.
    pub token: String,
    /// Origins of pages that may read it.
    pub origins: Vec<String>,
    /// Where it is served.
    pub address: SocketAddr,
}

impl Site {
    /// A site of a log with an extra list of origins.
    pub fn new(log: &Path, layout: Vec<u8>, token: String, more: &[String], address: SocketAddr) -> Self {
        let origins = ORIGINS.iter().copied().map(str::to_owned);
        let more = more.iter().cloned();
        Self { log: log.to_owned(), name: name(log), layout, token, origins: origins.chain(more).collect(), address }
    }

    /// Values of `Host` that a browser sends for this address; a page that has a name of its own point here sends that.
    pub fn hosts(&self) -> [String; 2] {
        let port = self.address.port();
        [format!("127.0.0.1:{port}"), format!("localhost:{port}")]
    }

    /// Address of the log.
    pub fn log_url(&self) -> String {
        format!("http://127.0.0.1:{}/{}/{}", self.address.port(), self.token, self.name)
    }

    /// Address of the layout.
    pub fn layout_url(&self) -> String {
        format!("http://127.0.0.1:{}/{}/layout.json", self.address.port(), self.token)
    }

    /// The log in Foxglove's web app.
    pub fn foxglove(&self) -> String {
        format!("{FOXGLOVE}?ds=remote-file&ds.url={}", encoded(&self.log_url()))
    }

    /// The log and its layout in Lichtblick's web app.
    pub fn lichtblick(&self) -> String {
        let (log, layout) = (encoded(&self.log_url()), encoded(&self.layout_url()));
        format!("{LICHTBLICK}?ds=remote-file&ds.url={log}&layoutUrl={layout}")
    }

    /// What to do with all that, for people.
    pub fn text(&self) -> String {
        let log = self.log.display();
        format!(
            "log:         {}\n\
             layout:      {}\n\
             \n\
             Lichtblick:  {}\n\
             Foxglove:    {}\n             \
             import the layout there: Layout menu, Import from file; `agglo view` serves it at the address above\n\
             desktop:     open {log} in Foxglove or Lichtblick (File, Open local file), and import the layout there\n\
             Rerun:       agglo view {log} --rerun\n\
             \n\
             Pages that may read it: {}\n\
             Ctrl-C ends this.\n",
            self.log_url(),
            self.layout_url(),
            self.lichtblick(),
            self.foxglove(),
            self.origins.join(", "),
        )
    }
}

/// A file's name as it can stand in an address.
fn name(log: &Path) -> String {
    let stem = log.file_stem().unwrap_or_default().to_string_lossy();
    let keep = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let stem: String = stem.chars().map(|c| if keep(c) { c } else { '_' }).collect();
    format!("{}.mcap", if stem.is_empty() { "log" } else { &stem })
}

/// A text as the value of a query.
fn encoded(text: &str) -> String {
    text.bytes().fold(String::new(), |mut to, byte| {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            to.push(byte.into());
        } else {
            _ = write!(to, "%{byte:02X}");
        }
        to
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain() {
        for (file, expected) in [
            ("a/clustering.mcap", "clustering.mcap"),
            ("../x y&z?.mcap", "x_y_z_.mcap"),
            ("{token}.mcap", "_token_.mcap"),
            ("run.x.mcap.part", "run_x_mcap.mcap"),
            ("Häufchen", "H_ufchen.mcap"),
            ("/", "log.mcap"),
        ] {
            assert_eq!(name(Path::new(file)), expected);
        }
    }

    #[test]
    fn links_carry_the_addresses_encoded() {
        let address = SocketAddr::from(([127, 0, 0, 1], 4567));
        let site = Site::new(Path::new("a.mcap"), Vec::new(), "secret".to_owned(), &[], address);
        let link = "https://lichtblick-suite.github.io/lichtblick/?ds=remote-file\
                    &ds.url=http%3A%2F%2F127.0.0.1%3A4567%2Fsecret%2Fa.mcap\
                    &layoutUrl=http%3A%2F%2F127.0.0.1%3A4567%2Fsecret%2Flayout.json";
        assert_eq!(site.lichtblick(), link);
    }
}
