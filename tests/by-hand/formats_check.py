"""Opens what `agglo export` writes with the programs that it is written for, and compares every number.

usage: python formats_check.py AGGLO SCENE

needs: pip install pandas pyarrow polars pyvista ovito freud-analysis mcap mcap-protobuf-support
AGGLO is the program; SCENE is run, recorded and exported in all formats. Its particles must have equal radii and bonds
and no periodic box, so that its clusters are those of a cut-off distance, which OVITO and freud find as well.
"""

import json
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

import freud
import numpy as np
import pandas
import polars
import pyvista
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from ovito.io import import_file
from ovito.modifiers import ClusterAnalysisModifier

COLUMNS = ["x", "y", "z", "vx", "vy", "vz"]


def recorded(path):
    """The states of a log as another reader of MCAP sees them: time, step and columns of each; and radii, scene."""
    states, radius, scene = [], None, None
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for attachment in reader.iter_attachments():
            if attachment.name == "scene.json":
                scene = json.loads(attachment.data)
        for _, channel, _, message in reader.iter_decoded_messages(topics=["/particles", "/particles/static"]):
            if channel.topic == "/particles/static":
                radius = np.array(message.radius)
                continue
            kinds = {5: "<u4", 8: "<f8"}
            columns = {
                field.name: np.ndarray(
                    len(radius), kinds[field.type], message.data, field.offset, (message.point_stride,)
                )
                for field in message.fields
                if field.type in kinds
            }
            states.append((message.t, message.step, columns))
    return states, radius, scene


def same(name, a, b):
    a, b = np.asarray(a), np.asarray(b)
    assert a.shape == b.shape, (name, a.shape, b.shape)
    assert (a == b).all(), (name, np.abs(a - b).max())


def nearly(name, a, b):
    """OVITO's reader of text rounds the last place its own way."""
    a, b = np.asarray(a), np.asarray(b)
    assert a.shape == b.shape and (np.abs(a - b) <= 4 * np.finfo(float).eps * np.abs(b)).all(), name


def partition(labels):
    """Clusters as sets of particles, whatever their numbers."""
    groups = {}
    for particle, label in enumerate(labels):
        groups.setdefault(int(label), set()).add(particle)
    return {frozenset(group) for group in groups.values()}


def tables(folder, states, radius):
    """CSV and Parquet: every number of every state, to the last bit."""
    csv = pandas.read_csv(folder / "all.csv", float_precision="round_trip")
    frames = {"pandas": pandas.read_parquet(folder / "all.parquet")}
    frames["polars"] = polars.read_parquet(folder / "all.parquet").to_pandas()
    for name, table in {"csv": csv, **frames}.items():
        assert list(table.columns) == list(csv.columns), name
        same(f"{name} t", table["t"].to_numpy().reshape(len(states), -1)[:, 0], [t for t, _, _ in states])
        for column in COLUMNS + ["temperature", "cluster"]:
            same(f"{name} {column}", table[column], np.concatenate([columns[column] for _, _, columns in states]))
        same(f"{name} radius", table["radius"], np.tile(radius, len(states)))


def vtk(folder, states, radius):
    """VTP and its .pvd, through VTK's own reader."""
    reader = pyvista.get_reader(folder / "all.pvd")
    same("pvd times", reader.time_values, [t for t, _, _ in states])
    for k in (0, len(states) // 2, len(states) - 1):
        _, _, columns = states[k]
        reader.set_active_time_value(reader.time_values[k])
        points = reader.read()[0]
        same("vtp points", points.points, np.column_stack([columns[axis] for axis in "xyz"]))
        same("vtp velocity", points["velocity"], np.column_stack([columns["v" + axis] for axis in "xyz"]))
        same("vtp radius", points["radius"], radius)
        same("vtp temperature", points["temperature"], columns["temperature"])


def ovito(folder, states, radius):
    """Extended XYZ and VTP in OVITO; returns its pipeline."""
    pipeline = import_file(folder / "all.xyz")
    assert pipeline.source.num_frames == len(states)
    for k in (0, len(states) // 2, len(states) - 1):
        t, step, columns = states[k]
        data = pipeline.compute(k)
        assert (data.attributes["Time"], data.attributes["Step"]) == (t, step)
        nearly("xyz position", data.particles["Position"], np.column_stack([columns[axis] for axis in "xyz"]))
        same("xyz radius", data.particles["Radius"], radius.astype(np.asarray(data.particles["Radius"]).dtype))
        nearly("xyz temperature", data.particles["temperature"], columns["temperature"])
    data = import_file(folder / "end.vtp").compute()
    same("vtp in ovito", data.particles["Position"], np.column_stack([states[-1][2][axis] for axis in "xyz"]))
    same("vtp radius in ovito", data.particles["Radius"], radius.astype(np.asarray(data.particles["Radius"]).dtype))
    assert "temperature" in data.particles
    return pipeline


def clusters(pipeline, states, radius, reach):
    """Clusters of every state by OVITO and by freud: the same sets of particles."""
    cutoff = reach * 2 * radius[0]
    pipeline.modifiers.append(ClusterAnalysisModifier(cutoff=cutoff))
    box = freud.box.Box.cube(1e6)
    box.periodic = False
    for k, (_, _, columns) in enumerate(states):
        ours = partition(columns["cluster"])
        assert partition(np.asarray(pipeline.compute(k).particles["Cluster"])) == ours, f"OVITO, state {k}"
        points = np.column_stack([columns[axis] for axis in "xyz"])
        found = freud.cluster.Cluster().compute((box, points - points.mean(axis=0)), neighbors={"r_max": cutoff})
        assert partition(found.cluster_idx) == ours, f"freud, state {k}"


def main(agglo, scene):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run([agglo, "run", scene, "-q", "-o", folder / "run.mcap"], check=True)
        for kind, at, file in [
            ("csv", "all", "all.csv"),
            ("parquet", "all", "all.parquet"),
            ("extxyz", "all", "all.xyz"),
            ("vtp", "all", "all.pvd"),
            ("vtp", "end", "end.vtp"),
        ]:
            command = [agglo, "export", folder / "run.mcap", "--format", kind, "--at", at, "-o", folder / file]
            subprocess.run(command, check=True)
        states, radius, resolved = recorded(folder / "run.mcap")
        assert (radius == radius[0]).all(), "clusters by a cut-off distance need equal radii"
        tables(folder, states, radius)
        vtk(folder, states, radius)
        pipeline = ovito(folder, states, radius)
        clusters(pipeline, states, radius, resolved["binding"]["range"])
    programs = ["pandas", "polars", "vtk", "pyvista", "ovito", "freud-analysis"]
    print(f"{len(states)} states of {len(radius)} particles agree in", *(f"{p} {version(p)}," for p in programs))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2])
