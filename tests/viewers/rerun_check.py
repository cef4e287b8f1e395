"""Opens a log in the real Rerun, headless, and checks what it loaded and what it shows.

usage: python rerun_check.py AGGLO LOG OUT.png [TIME]
       (needs PyPI rerun-sdk, pillow and Debian's mesa-vulkan-drivers; the program `rerun` must be on the path)

`rerun mcap check` must pass; coloured 3D points and the scalars of the plots must be in the converted recording; the
blueprint of `agglo view --rerun` must open every view without a report; the picture must hold the particles' colours.
"""

import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy
import rerun as rr
from PIL import Image
from rerun.experimental import ViewerClient

os.environ["RERUN_ANALYTICS"] = "0"

# Called as `rerun` by agglo: does all that is asked, but keeps the recording instead of showing it.
KEEP = """#!/bin/sh
case "$1" in mcap|rrd) exec rerun "$@";; esac
for last; do :; done
cp "$last" "$AGGLO_KEEP"
"""


def prepared(agglo, log, folder):
    """The recording with its blueprint, as agglo would show it."""
    program, kept = folder / "keep", folder / "kept.rrd"
    program.write_text(KEEP)
    program.chmod(0o755)
    environment = os.environ | {"AGGLO_RERUN": str(program), "AGGLO_KEEP": str(kept)}
    subprocess.run([agglo, "view", log, "--rerun"], env=environment, check=True)
    return kept


def check_loaded(schema):
    """Coloured points, and the messages that the plots are of, must be in what Rerun loaded."""
    found = {entity.entity_path: {part.component for part in entity.components} for entity in schema.entities}
    assert {"Points3D:positions", "Points3D:colors"} <= found["/particles"], found["/particles"]
    assert "agglo.v1.EnergyLedger:message" in found["/energy"], found["/energy"]
    assert "agglo.v1.StepDiagnostics:message" in found["/diagnostics"], found["/diagnostics"]
    return len(found)


def main(agglo, log, picture, moment=1.0):
    subprocess.run(["rerun", "mcap", "check", "--full", log], check=True)
    with tempfile.TemporaryDirectory() as folder:
        recording = prepared(agglo, log, pathlib.Path(folder))
        with ViewerClient.spawn(headless=True, port=9977, hide_welcome_screen=True) as viewer:
            viewer.open(str(recording))
            time.sleep(8)
            entities = check_loaded(viewer.get_recording_schema())
            viewer.set_time("message_log_time", duration=float(moment), play_state="paused")
            time.sleep(6)
            views = viewer.get_state().views
            kinds = {view.view_class for view in views}
            assert {"3D", "TimeSeries", "TextLog", "Dataframe"} <= kinds, kinds
            troubled = [(view.name, view.reports) for view in views if view.reports]
            assert not troubled, troubled
            viewer.save_screenshot(picture)
            print(f"rerun {rr.__version__}: {entities} entities, {len(views)} views: {', '.join(sorted(view.name for view in views))}")
    pixels = numpy.asarray(Image.open(picture).convert("RGB")).astype(int)
    left = pixels[60:-60, : pixels.shape[1] * 2 // 5]
    colored = (left.max(axis=2) - left.min(axis=2) > 60).mean()
    assert colored > 0.005, f"only {colored:.2%} of the 3D view is coloured"
    print(f"{colored:.1%} of the 3D view is coloured")


if __name__ == "__main__":
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__)
    main(*sys.argv[1:])
