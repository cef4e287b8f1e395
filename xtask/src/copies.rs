//! Files that a crate embeds: `cargo package` needs them inside the crate, people look for them at the top.

use std::path::{Path, PathBuf};

use crate::Failure;
use crate::outputs::{Output, files_below};

/// What is copied: a file or folder, its copy, and which files of a folder.
const COPIES: &[(&str, &str, &str)] = &[
    ("schemas/agglo", "crates/record/proto/agglo", "proto"),
    ("schemas/foxglove", "crates/record/proto/foxglove", "proto"),
    ("viewer/layout.json", "crates/record/viewer/layout.json", "json"),
    ("viewer/rerun", "crates/cli/viewer/rerun", "zst"),
    ("scenes", "crates/cli/scenes", "json"),
];

/// The copies, with the contents of their originals.
pub fn collect(root: &Path) -> Result<Vec<Output>, Failure> {
    let mut outputs = Vec::new();
    for (original, copy, extension) in COPIES {
        let original = Path::new(original);
        let files =
            if root.join(original).is_dir() { files_below(root, original)? } else { vec![original.to_path_buf()] };
        for file in files.iter().filter(|file| file.extension().is_some_and(|e| e == *extension)) {
            let below = file.strip_prefix(original)?;
            let path = if below.as_os_str().is_empty() { PathBuf::from(copy) } else { Path::new(copy).join(below) };
            let content = std::fs::read(root.join(file)).map_err(|e| format!("{}: {e}", file.display()))?;
            outputs.push(Output { path, content });
        }
    }
    Ok(outputs)
}
