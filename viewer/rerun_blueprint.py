#!/usr/bin/env python3
"""Writes the blueprints that arrange a log in Rerun, one for each kind of scene, beside this file in rerun/.

usage: rerun_blueprint.py        (needs PyPI rerun-sdk and zstandard; made with rerun-sdk 0.41)

`agglo view LOG --rerun` takes the one that fits and puts the particles' radius in place of RADIUS.
"""

import pathlib
import struct

import rerun as rr
import rerun.blueprint as rrb
import zstandard
from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping

APPLICATION = "agglo"
# A 32-bit float that stands for the radius and nothing else: pi * 1e-5, with bits that no other number has.
RADIUS = struct.unpack("<f", struct.pack("<I", 0x3803_CAFE))[0]


def plot(name, topic, message, *fields):
    """A plot of fields of a topic's protobuf messages."""
    series = [
        rr.SeriesLines(names=label).visualizer(
            mappings=[
                VisualizerComponentMapping(
                    "Scalars:scalars",
                    ComponentSourceKind.SourceComponent,
                    source_component=f"agglo.v1.{message}:message",
                    selector=f".{field}",
                )
            ]
        )
        for field, label in fields
    ]
    return rrb.TimeSeriesView(name=name, origin="/", contents=[topic], overrides={topic: series})


def blueprint(thermal, clusters):
    """Particles at the left, what they do in the middle, how the solver fares at the right."""
    energy, step = ("/energy", "EnergyLedger"), ("/diagnostics", "StepDiagnostics")
    middle = [plot("Kinetic energy per mass [J/kg]", *energy, ("kinetic_per_mass", "kinetic energy per mass"))]
    if thermal:
        middle.append(plot("Temperature [K]", *energy, ("mean_temperature", "mean"), ("max_temperature", "highest")))
    if clusters:
        fields = ("count", "clusters"), ("largest", "particles in the largest")
        middle.append(plot("Clusters", "/clusters", "Clusters", *fields))
    middle.append(plot("Energy residual [J]", *energy, ("residual", "unexplained")))
    right = [
        plot("Step size [s]", *step, ("dt", "step size")),
        plot("Iterations per step", *step, ("iterations", "iterations")),
        rrb.TextLogView(name="Log", origin="/log"),
        rrb.DataframeView(name="Impacts", origin="/impacts"),
        rrb.DataframeView(name="Diagnostics", origin="/diagnostics"),
    ]
    particles = rrb.Spatial3DView(
        name="Particles",
        origin="/",
        contents=["/particles"],
        overrides={"/particles": rr.Points3D.from_fields(radii=RADIUS)},
    )
    columns = rrb.Horizontal(particles, rrb.Vertical(*middle), rrb.Vertical(*right), column_shares=[4, 3, 3])
    return rrb.Blueprint(columns, collapse_panels=True)


def main():
    folder = pathlib.Path(__file__).parent / "rerun"
    folder.mkdir(exist_ok=True)
    for name, thermal, clusters in [
        ("plain", False, False),
        ("thermal", True, False),
        ("clusters", False, True),
        ("thermal-clusters", True, True),
    ]:
        path = folder / f"{name}.rbl"
        blueprint(thermal, clusters).save(APPLICATION, str(path))
        content = path.read_bytes()
        path.unlink()
        assert content.count(struct.pack("<f", RADIUS)) == 1, f"{name}: the radius must be found once"
        path.with_suffix(".rbl.zst").write_bytes(zstandard.ZstdCompressor(level=19).compress(content))


if __name__ == "__main__":
    main()
