"""Times `fieldgap.simulate` beside other packages on one core, at the same field.

Run it after `pip install ./python levitate "scipy<1.15"` (levitate uses a function that later versions of SciPy do not have), and for AcousTools
`pip install acoustools torch`, several gigabytes:

    python python/benches/compare_packages.py [--rounds 15] [--json]

All take the same array, points, frequency and speed of sound, and sum monopoles or pistons with 1/d. In each round the packages run in turn; the
best round of each counts. A field that differs from fieldgap's by more than 1e-6 of its largest value ends the run. What is prepared
once for an array (levitate's and fieldgap's objects) is outside the time; what depends on the points is inside.

Packages that are not installed are left out and named.
"""

import os

# One core, before any of them starts its threads.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[variable] = "1"

import argparse
import json
import sys
import time

import numpy as np

import fieldgap as fg

FREQUENCY = 40e3
SPEED_OF_SOUND = 343.0
K = 2 * np.pi * FREQUENCY / SPEED_OF_SOUND
FACE_RADIUS = 4.5e-3
FOCUS = (0.01, -0.005, 0.15)


def cases():
    """The arrays and points: a cloud of points, which have no structure, and a plane."""
    cloud = np.random.default_rng(1).uniform([-0.05, -0.05, 0.05], [0.05, 0.05, 0.2], size=(10_201, 3))
    plane = fg.plane(0.15, size=0.1, step=1e-3)
    small, large = fg.Array.square(6, 6, pitch=10.5e-3), fg.Array.square(16, 16, pitch=10.5e-3)
    for name, array, points in [
        ("6 x 6 elements, 10,201 points at random", small, cloud),
        ("6 x 6 elements, a plane of 101 x 101 points", small, plane),
        ("16 x 16 elements, 10,201 points at random", large, cloud),
        ("16 x 16 elements, a plane of 101 x 101 points", large, plane),
    ]:
        distance = np.linalg.norm(array.positions - np.array(FOCUS), axis=1)
        yield name, array, points, np.exp(1j * K * (distance.max() - distance))


def of_fieldgap(array, points, drive, model, method):
    medium = fg.Medium(speed_of_sound=SPEED_OF_SOUND)
    return lambda: fg.simulate(
        array, points, drive=drive, medium=medium, frequency=FREQUENCY, transducer=model, method=method, threads=1
    )


def of_numpy(array, points, drive, model):
    """The sum over elements, written as one expression on whole arrays; J1 from SciPy where it is installed."""
    positions = array.positions
    if model == "piston":
        from scipy.special import j1

    def field():
        ray = points[..., np.newaxis, :] - positions
        square = np.einsum("...i,...i->...", ray, ray)
        distance = np.sqrt(square)
        level = 1 / distance
        if model == "piston":
            x = K * FACE_RADIUS * np.sqrt(ray[..., 0] ** 2 + ray[..., 1] ** 2) * level
            with np.errstate(invalid="ignore"):
                level *= np.where(x == 0, 1.0, 2 * j1(x) / x)
        return (level * np.exp(1j * K * distance)) @ drive

    return field


def of_numpy_loop(array, points, drive, model):
    """The same, element by element: its arrays stay in the processor's cache."""
    positions = array.positions
    if model == "piston":
        from scipy.special import j1

    def field():
        total = np.zeros(points.shape[:-1], dtype=complex)
        for position, weight in zip(positions, drive):
            ray = points - position
            distance = np.sqrt((ray * ray).sum(axis=-1))
            level = 1 / distance
            if model == "piston":
                x = K * FACE_RADIUS * np.hypot(ray[..., 0], ray[..., 1]) * level
                with np.errstate(invalid="ignore"):
                    level *= np.where(x == 0, 1.0, 2 * j1(x) / x)
            total += weight * level * np.exp(1j * K * distance)
        return total

    return field


def of_levitate(array, points, drive, model):
    import levitate

    levitate.materials.air.c = SPEED_OF_SOUND
    kinds = {"monopole": levitate.transducers.PointSource, "piston": levitate.transducers.CircularPiston}
    options = {"effective_radius": FACE_RADIUS} if model == "piston" else {}
    transducer = kinds[model](freq=FREQUENCY, p0=1.0, **options)
    positions = np.ascontiguousarray(array.positions.T)
    normals = np.ascontiguousarray(array.normals.T)
    places = np.ascontiguousarray(points.reshape(-1, 3).T)

    def field():
        return (drive @ transducer.pressure(positions, normals, places)).reshape(points.shape[:-1])

    return field


class OtherField(Exception):
    """A package that has no such model."""


def of_acoustools(array, points, drive, model):
    if model == "piston":
        raise OtherField("its directivity is a series of three terms, which is not a piston's at large angles")
    # The package reads its precision and its device from the arguments of the program, when it is imported.
    arguments, sys.argv = sys.argv, [sys.argv[0], "-c128", "-cpu"]
    try:
        import torch
        from acoustools.Utilities import propagate
    finally:
        sys.argv = arguments
    torch.set_num_threads(1)
    board = torch.tensor(array.positions)
    places = torch.tensor(points.reshape(-1, 3).T.copy())[None]
    weights = torch.tensor(drive)[None, :, None]
    # A face without extent is a monopole.
    options = {"p_ref": 1.0, "k": K, "transducer_radius": 0.0, "norms": torch.tensor(array.normals, dtype=torch.complex128)}
    return lambda: propagate(weights, places, board, **options).numpy().reshape(points.shape[:-1])


PACKAGES = {
    "NumPy, one expression": of_numpy,
    "NumPy, element by element": of_numpy_loop,
    "levitate": of_levitate,
    "AcousTools": of_acoustools,
}


def best_of(calls, rounds):
    """The shortest time of each call in seconds; the calls run in turn, in an order that changes from round to round."""
    best = dict.fromkeys(calls, float("inf"))
    order = np.random.default_rng(2)
    for _ in range(rounds):
        for name in order.permutation(list(calls)):
            call = calls[name]
            start = time.perf_counter()
            call()
            best[name] = min(best[name], time.perf_counter() - start)
    return best


def off(field, expected):
    return float(np.abs(field - expected).max() / np.abs(expected).max())


def compare(name, array, points, drive, model, rounds, missing):
    calls = {"fieldgap": of_fieldgap(array, points, drive, model, "auto")}
    calls["fieldgap, direct"] = of_fieldgap(array, points, drive, model, "direct")
    for package, of in PACKAGES.items():
        try:
            calls[package] = of(array, points, drive, model)
        except (ImportError, OtherField) as error:
            missing[f"{package}, {model}s" if isinstance(error, OtherField) else package] = str(error)
    ours = calls["fieldgap"]()
    for package, call in calls.items():
        difference = off(call(), ours)
        if not difference < 1e-6:
            raise SystemExit(f"{name}, {model}: the field of {package} differs by {difference:.1e}")
    best = best_of(calls, rounds)
    others = {package: seconds for package, seconds in best.items() if package in PACKAGES}
    fastest = min(others, key=others.get)
    return {
        "case": name,
        "model": model,
        "seconds": best,
        "fastest_other": fastest,
        "ratio": others[fastest] / best["fieldgap"],
        "ratio_direct": others[fastest] / best["fieldgap, direct"],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    missing = {}
    results = [
        compare(name, array, points, drive, model, arguments.rounds, missing)
        for name, array, points, drive in cases()
        for model in ("monopole", "piston")
    ]
    if arguments.json:
        print(json.dumps({"results": results, "missing": missing}, indent=2))
        return
    for result in results:
        print(f"{result['case']}, {result['model']}s")
        for package, seconds in result["seconds"].items():
            print(f"  {package:28} {1e3 * seconds:10.3f} ms")
        print(f"  {result['ratio']:.1f} x as fast as {result['fastest_other']}; every point summed: {result['ratio_direct']:.1f} x")
    for package, why in missing.items():
        print(f"{package} is left out: {why}")


if __name__ == "__main__":
    main()
