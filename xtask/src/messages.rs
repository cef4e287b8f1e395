//! From `schemas/**/*.proto` to Rust types and to the descriptor sets that logs embed.

use std::path::{Path, PathBuf};

use prost::Message;
use prost_types::{FileDescriptorProto, FileDescriptorSet};

use crate::Failure;
use crate::outputs::{Output, files_below};

/// Where the generated code lives.
const TARGET: &str = "crates/record/src/generated";

/// Messages that are written to logs of their own channel; each gets a descriptor set with no more than it needs.
const LOGGED: &[(&str, &str)] = &[
    ("agglo/v1/particle_static.proto", "agglo.v1.ParticleStatic"),
    ("agglo/v1/step_diagnostics.proto", "agglo.v1.StepDiagnostics"),
    ("agglo/v1/energy_ledger.proto", "agglo.v1.EnergyLedger"),
    ("agglo/v1/clusters.proto", "agglo.v1.Clusters"),
    ("agglo/v1/impacts.proto", "agglo.v1.Impacts"),
    ("agglo/v1/checkpoint.proto", "agglo.v1.Checkpoint"),
    ("foxglove/PointCloud.proto", "foxglove.PointCloud"),
    ("foxglove/SceneUpdate.proto", "foxglove.SceneUpdate"),
    ("foxglove/Log.proto", "foxglove.Log"),
];

/// Rust modules, one per package, and descriptor sets.
pub fn generate(root: &Path) -> Result<Vec<Output>, Failure> {
    let schemas = root.join("schemas");
    let mut protos = Vec::new();
    for path in files_below(&schemas, Path::new(""))? {
        if path.extension().is_some_and(|e| e == "proto") {
            protos.push(path);
        }
    }
    let set = compile(&schemas, &protos, true)?;
    let mut outputs = Vec::new();
    let modules = set
        .file
        .into_iter()
        .map(|file| (prost_build::Module::from_protobuf_package_name(file.package()), file))
        .collect();
    for (module, text) in prost_build::Config::new().generate(modules)? {
        let name = module.to_file_name_or("messages");
        // Google's own messages come with the crate prost-types.
        if !name.starts_with("google.") {
            outputs.push(Output { path: Path::new(TARGET).join(name), content: text.into_bytes() });
        }
    }
    outputs.sort_by(|a, b| a.path.cmp(&b.path));
    for (file, message) in LOGGED {
        let content = compile(&schemas, &[PathBuf::from(file)], false)?.encode_to_vec();
        outputs.push(Output { path: Path::new(TARGET).join(format!("{message}.bin")), content });
    }
    Ok(outputs)
}

/// Compiles files and all that they import, in the order of dependence.
fn compile(schemas: &Path, files: &[PathBuf], comments: bool) -> Result<FileDescriptorSet, Failure> {
    let mut compiler = protox::Compiler::new([schemas])?;
    compiler.include_imports(true).include_source_info(comments).open_files(files)?;
    let bytes = compiler.encode_file_descriptor_set();
    let mut set = FileDescriptorSet::decode(bytes.as_slice())?;
    if !comments {
        for file in &mut set.file {
            file.source_code_info = None;
        }
    }
    Ok(FileDescriptorSet { file: in_order(set.file) })
}

/// Files after those that they import: readers add them to a pool one by one.
fn in_order(mut files: Vec<FileDescriptorProto>) -> Vec<FileDescriptorProto> {
    files.sort_by(|a, b| a.name().cmp(b.name()));
    let mut ordered: Vec<FileDescriptorProto> = Vec::new();
    while !files.is_empty() {
        let ready = files
            .iter()
            .position(|file| file.dependency.iter().all(|needed| ordered.iter().any(|done| done.name() == needed)));
        // Imports cannot form a circle, or protox would have refused them.
        ordered.push(files.remove(ready.unwrap_or(0)));
    }
    ordered
}
