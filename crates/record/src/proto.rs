//! The messages of a log, generated from `schemas/` by `cargo xtask gen`, with their descriptors and source texts.

/// Messages of agglo.
pub mod agglo {
    /// Version 1 of agglo's messages; field numbers are never reused.
    #[allow(missing_docs, clippy::all)]
    pub mod v1 {
        include!("generated/agglo.v1.rs");
    }
}

/// Messages that viewers know, with agglo's own fields at numbers from 1000.
#[allow(missing_docs, clippy::all)]
pub mod foxglove {
    include!("generated/foxglove.rs");
}

/// The source texts of all messages: path below `schemas/`, and text.
pub const SOURCES: &[(&str, &str)] = &[
    ("agglo/v1/checkpoint.proto", include_str!("../proto/agglo/v1/checkpoint.proto")),
    ("agglo/v1/clusters.proto", include_str!("../proto/agglo/v1/clusters.proto")),
    ("agglo/v1/common.proto", include_str!("../proto/agglo/v1/common.proto")),
    ("agglo/v1/energy_ledger.proto", include_str!("../proto/agglo/v1/energy_ledger.proto")),
    ("agglo/v1/impacts.proto", include_str!("../proto/agglo/v1/impacts.proto")),
    ("agglo/v1/particle_static.proto", include_str!("../proto/agglo/v1/particle_static.proto")),
    ("agglo/v1/step_diagnostics.proto", include_str!("../proto/agglo/v1/step_diagnostics.proto")),
    ("foxglove/ArrowPrimitive.proto", include_str!("../proto/foxglove/ArrowPrimitive.proto")),
    ("foxglove/Color.proto", include_str!("../proto/foxglove/Color.proto")),
    ("foxglove/CubePrimitive.proto", include_str!("../proto/foxglove/CubePrimitive.proto")),
    ("foxglove/CylinderPrimitive.proto", include_str!("../proto/foxglove/CylinderPrimitive.proto")),
    ("foxglove/KeyValuePair.proto", include_str!("../proto/foxglove/KeyValuePair.proto")),
    ("foxglove/LinePrimitive.proto", include_str!("../proto/foxglove/LinePrimitive.proto")),
    ("foxglove/Log.proto", include_str!("../proto/foxglove/Log.proto")),
    ("foxglove/ModelPrimitive.proto", include_str!("../proto/foxglove/ModelPrimitive.proto")),
    ("foxglove/PackedElementField.proto", include_str!("../proto/foxglove/PackedElementField.proto")),
    ("foxglove/Point3.proto", include_str!("../proto/foxglove/Point3.proto")),
    ("foxglove/PointCloud.proto", include_str!("../proto/foxglove/PointCloud.proto")),
    ("foxglove/Pose.proto", include_str!("../proto/foxglove/Pose.proto")),
    ("foxglove/Quaternion.proto", include_str!("../proto/foxglove/Quaternion.proto")),
    ("foxglove/SceneEntity.proto", include_str!("../proto/foxglove/SceneEntity.proto")),
    ("foxglove/SceneEntityDeletion.proto", include_str!("../proto/foxglove/SceneEntityDeletion.proto")),
    ("foxglove/SceneUpdate.proto", include_str!("../proto/foxglove/SceneUpdate.proto")),
    ("foxglove/SpherePrimitive.proto", include_str!("../proto/foxglove/SpherePrimitive.proto")),
    ("foxglove/TextPrimitive.proto", include_str!("../proto/foxglove/TextPrimitive.proto")),
    ("foxglove/TriangleListPrimitive.proto", include_str!("../proto/foxglove/TriangleListPrimitive.proto")),
    ("foxglove/Vector3.proto", include_str!("../proto/foxglove/Vector3.proto")),
];
