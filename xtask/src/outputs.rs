//! Everything that is generated, as one list of files and their contents, to write or to compare.

use std::path::{Path, PathBuf};

use crate::{Failure, copies, messages, schema};

/// A generated file: its path from the workspace's folder, and what it must hold.
pub struct Output {
    pub path: PathBuf,
    pub content: Vec<u8>,
}

/// Folders that hold generated files only: any other file in them is left over from an earlier generation.
const OWNED: &[&str] = &["crates/record/src/generated", "crates/record/proto"];

fn all(root: &Path) -> Result<Vec<Output>, Failure> {
    let mut outputs = messages::generate(root)?;
    outputs.extend(schema::generate()?);
    outputs.extend(copies::collect(root)?);
    Ok(outputs)
}

/// Writes every generated file that is not current, and removes left-over ones.
pub fn write(root: &Path) -> Result<(), Failure> {
    let outputs = all(root)?;
    for output in &outputs {
        let path = root.join(&output.path);
        if std::fs::read(&path).ok().as_deref() != Some(&output.content) {
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder)?;
            }
            std::fs::write(&path, &output.content).map_err(|e| format!("{}: {e}", output.path.display()))?;
            println!("wrote {}", output.path.display());
        }
    }
    for path in left_over(root, &outputs)? {
        std::fs::remove_file(root.join(&path))?;
        println!("removed {}", path.display());
    }
    Ok(())
}

/// Fails with the names of files that `write` would change.
pub fn check(root: &Path) -> Result<(), Failure> {
    let outputs = all(root)?;
    let mut stale: Vec<String> = Vec::new();
    for output in &outputs {
        if std::fs::read(root.join(&output.path)).ok().as_deref() != Some(&output.content) {
            stale.push(output.path.display().to_string());
        }
    }
    stale.extend(left_over(root, &outputs)?.iter().map(|path| path.display().to_string()));
    if stale.is_empty() {
        return Ok(());
    }
    Err(format!("generated files are out of date, run `cargo xtask gen`:\n  {}", stale.join("\n  ")).into())
}

fn left_over(root: &Path, outputs: &[Output]) -> Result<Vec<PathBuf>, Failure> {
    let mut found = Vec::new();
    for folder in OWNED {
        for path in files_below(root, Path::new(folder))? {
            if !outputs.iter().any(|output| output.path == path) {
                found.push(path);
            }
        }
    }
    Ok(found)
}

/// All files below a folder, as paths from `root`, sorted.
pub fn files_below(root: &Path, folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        let Ok(entries) = std::fs::read_dir(root.join(&folder)) else { continue };
        for entry in entries {
            let entry = entry?;
            let path = folder.join(entry.file_name());
            if entry.file_type()?.is_dir() { open.push(path) } else { found.push(path) }
        }
    }
    found.sort();
    Ok(found)
}
