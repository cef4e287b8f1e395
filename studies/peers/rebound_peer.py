"""REBOUND on a problem of agglo's: reads it as JSON from standard input, answers with curves of error and wall time.

Wants the package rebound, version 4, and a C compiler `cc`; the forces are compiled C (force.c), so that Python times nothing.
"""

import ctypes
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import rebound


def compiled():
    folder = tempfile.mkdtemp()
    library = pathlib.Path(folder) / "force.so"
    source = pathlib.Path(__file__).with_name("force.c")
    subprocess.run(["cc", "-O3", "-march=native", "-shared", "-fPIC", "-o", library, source, "-lm"], check=True)
    lib = ctypes.CDLL(str(library))
    lib.set_layout.argtypes = [ctypes.c_long] * 4
    lib.set_law.argtypes = [ctypes.c_double, ctypes.c_int, ctypes.c_double, ctypes.c_int, ctypes.c_int]
    fields = dict(rebound.Simulation._fields_)
    particles = "_particles" if "_particles" in fields else "particles"
    count = "N" if "N" in fields else "_N"
    mass = getattr(rebound.Particle, "m").offset
    lib.set_layout(
        getattr(rebound.Simulation, count).offset,
        getattr(rebound.Simulation, particles).offset,
        ctypes.sizeof(rebound.Particle),
        mass,
    )
    return lib


def solved(lib, problem, settings):
    """Errors against the reference and wall time of one setting, the median of three."""
    walls, error = [], None
    for _ in range(3):
        sim = rebound.Simulation()
        sim.G = 0.0
        bodies = zip(problem["mass"], problem["radius"], problem["position"], problem["velocity"])
        for m, b, x, v in bodies:
            sim.add(m=m, r=b, x=x[0], y=x[1], z=x[2], vx=v[0], vy=v[1], vz=v[2])
        sim.gravity = "none"
        if problem["restitution"] is not None:
            sim.collision = "direct"
            sim.collision_resolve = "hardsphere"
            sim.coefficient_of_restitution = lambda _, speed: problem["restitution"]
        settings(sim)
        sim.additional_forces = lib.add_forces
        started = time.perf_counter()
        sim.integrate(problem["duration"], exact_finish_time=1)
        walls.append(time.perf_counter() - started)
        truth = problem["reference"]
        square = sum((p.x - r[0]) ** 2 + (p.y - r[1]) ** 2 + (p.z - r[2]) ** 2 for p, r in zip(sim.particles, truth))
        error = (square / len(truth)) ** 0.5 / problem["diameter"]
        if walls[0] > 1.0:
            break
    return [error, statistics.median(walls)]


def main():
    problem = json.load(sys.stdin)
    (a1, b1), (a2, b2) = problem["attraction"], problem["repulsion"]
    if b1 != int(b1) or b2 != int(b2):
        sys.exit("force.c knows whole exponents only")
    lib = compiled()
    lib.set_law(a1, int(b1), a2, int(b2), int(problem["weight"] == "mass-product"))

    def ias15(epsilon):
        def settings(sim):
            sim.integrator = "ias15"
            # The mode that compares the largest acceleration with the largest last term of its series: the default divides
            # by every particle's own acceleration, and stands still where that passes through zero.
            sim.ri_ias15.adaptive_mode = 1
            sim.ri_ias15.min_dt = 1e-4 * duration
            sim.ri_ias15.epsilon = epsilon
            sim.dt = 1e-3

        return settings

    def leapfrog(dt):
        def settings(sim):
            sim.integrator = "leapfrog"
            sim.dt = dt

        return settings

    duration = problem["duration"]
    steps = [problem["duration"] / (32 << k) for k in range(0, 13, 2)]

    def ias15_fixed(dt):
        def settings(sim):
            sim.integrator = "ias15"
            sim.ri_ias15.epsilon = 0
            sim.dt = dt

        return settings

    curves = [
        ("REBOUND IAS15", [ias15(10.0 ** -k) for k in (1, 3, 5, 7, 9, 11)]),
        ("REBOUND leapfrog", [leapfrog(dt) for dt in steps]),
    ]
    note = "IAS15 with epsilon from 1e-1 to 1e-11, adaptive_mode 1 and a least step of 1e-4 of the duration"
    if problem["restitution"] is not None:
        # Its impacts happen at the ends of steps: long steps would miss them.
        curves[0] = ("REBOUND IAS15", [ias15_fixed(dt) for dt in steps])
        note = "impacts by its direct search and hardsphere, at the ends of fixed steps"
    answer = [{"name": name, "points": [solved(lib, problem, s) for s in settings]} for name, settings in curves]
    note = (
        f"REBOUND {rebound.__version__} with the pair law as additional forces in C (cc -O3 -march=native), each time the median "
        f"of three; {note}."
    )
    json.dump({"note": note, "curves": answer}, sys.stdout)


if __name__ == "__main__":
    main()
