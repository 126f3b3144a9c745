"""Makes a set of scans whose field, walls, lobes and elements are levitate's, to check diagnoses on physics that is not fieldgap's.

Levitate (https://github.com/AppliedAcousticsChalmers/levitate) sums far-field pistons and their images in mirror planes. The robot, the
receiver and the noise are written here. Run it after `pip install levitate "scipy<1.15"`:

    python python/outside/levitate_set sets/levitate --count 100 --seed 1 --answers levitate-answers.json
    fieldgap blind seal sets/levitate levitate-answers.json
    fieldgap blind run sets/levitate
    fieldgap blind score sets/levitate

With `--varied`, scans are of many kinds, elements radiate otherwise than pistons too, and more causes act.

A tenth of the scans has no cause, a fifth two, a fifth one that the catalogue does not have, the rest one. Of a cause with a size, the
size makes a gap that is uniform in its logarithm from 0.3 to 8 standard deviations of a reading's noise.
"""

import argparse
import json
import math
import pathlib
import sys

import numpy as np
from causes import CATALOGUE, OUTSIDE, WITHOUT_SIZE
from laboratory import Laboratory
from truth import Truth
from varied import VariedLaboratory
from varied_causes import AIR_AND_RECEIVER, MIRRORS, VARIED

GAPS_SIGMA = (0.3, 8.0)
# How well careful labs set the robot's origin, standard deviation along each axis.
ORIGIN_M = 3e-4
DARK_READINGS = 64


class Believed:
    """The readings that the record's simulator expects, and how they change as the robot's origin is shifted."""

    def __init__(self, laboratory):
        self.levels = np.abs(Truth(laboratory).pressures())
        self.peak = self.levels.max()
        self.sd = np.hypot(laboratory.noise * self.levels, laboratory.floor * self.peak)
        slopes = []
        for axis in range(3):
            truth = Truth(laboratory)
            truth.visits_m[axis] += 1e-5
            slopes.append((np.abs(truth.pressures()) - self.levels) / 1e-5)
        self.slopes = np.array(slopes)

    def gap_sigma(self, levels):
        """Root mean square of the gap at the best gain and shift, in standard deviations of the noise of a reading."""
        columns = np.vstack([levels, -self.slopes]) / self.sd
        stiffness = np.diag([0.0, *[1 / ORIGIN_M**2] * 3])
        best = np.linalg.solve(columns @ columns.T + stiffness, columns @ (self.levels / self.sd))
        return math.sqrt(np.mean((best @ columns - self.levels / self.sd) ** 2))


def truth_of(laboratory, acting, peak):
    truth = Truth(laboratory, peak)
    for act, size in acting:
        act(truth, size)
    return truth


def sized(laboratory, act, target, believed):
    """The size of a cause that makes the wanted gap, or the largest there is; and the gap."""

    def gap(size):
        truth = truth_of(laboratory, [(act, size)], believed.peak)
        return believed.gap_sigma(truth.readings(truth.pressures()))

    low, high = 1e-4, 1.0
    if gap(high) <= target:
        return high, gap(high)
    for _ in range(12):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if gap(middle) < target else (low, middle)
    return low, gap(low)


def drawn(random, catalogue):
    """Category and causes of a scan."""
    kind = random.random()
    names = list(catalogue)
    if kind < 0.1:
        return "none", []
    if kind < 0.3:
        return "two", [str(name) for name in random.choice(names, 2, replace=False)]
    if kind < 0.5:
        return "outside", [str(random.choice(list(OUTSIDE)))]
    return "one", [str(random.choice(names))]


def fits(cause, others, laboratory):
    """Whether a cause can be made beside these.

    Levitate gives the sum of direct path and images, and what acts on a path acts on one of them. A receiver that gives
    phases adds no floor to its levels.
    """
    names = {cause, *others}
    if names & AIR_AND_RECEIVER and names & MIRRORS:
        return False
    has_phases = laboratory.reference_rad is not None
    return cause not in others and not (has_phases and cause == "noise-floor")


def one(folder, name, random, varied):
    """Writes a scan, and returns its answer."""
    catalogue = CATALOGUE | VARIED if varied else CATALOGUE
    laboratory = (VariedLaboratory if varied else Laboratory)(random)
    category, names = drawn(random, catalogue)
    believed = Believed(laboratory)
    peak = believed.peak
    least = 0.5 if category == "two" else GAPS_SIGMA[0]
    acting, gaps, parameters = [], [], {}
    for number, cause in enumerate(names):
        target = math.exp(random.uniform(math.log(least), math.log(GAPS_SIGMA[1])))
        gap = 0.0
        while gap < 0.9 * least:
            describe, act = (catalogue | OUTSIDE)[cause](laboratory, random)
            size, gap = sized(laboratory, act, math.inf if cause in WITHOUT_SIZE else target, believed)
            others = names[:number] + names[number + 1 :]
            if category in ("one", "two") and (gap < 0.9 * least or not fits(cause, others, laboratory)):
                # Here this cause makes less than that at its largest, or cannot be made.
                gap = 0.0
                cause = str(random.choice([name for name in catalogue if name not in names]))
                names[number] = cause
        acting.append((act, size))
        gaps.append(gap)
        parameters |= describe(size)
    truth = truth_of(laboratory, acting, peak)
    pressures = truth.pressures()
    gap = believed.gap_sigma(truth.readings(pressures))

    def quadratures(count):
        return laboratory.floor * peak * (random.standard_normal(count) + 1j * random.standard_normal(count))

    def noisy(p):
        return p * (1 + laboratory.noise * random.standard_normal(p.size)) + quadratures(p.size)

    # Volts: the largest expected reading is one.
    levels = truth.readings(pressures, noisy) / peak
    dark = truth.readings(quadratures(DARK_READINGS)) / peak
    phases_rad = None
    if laboratory.reference_rad is not None:
        phases_rad = np.angle(noisy(pressures)) + laboratory.reference_rad
    write(folder / name, name, laboratory, levels, dark, phases_rad)
    in_order = sorted(range(len(names)), key=lambda n: list(catalogue | OUTSIDE).index(names[n]))
    return {
        "name": name,
        "category": category,
        "effects": [names[n] for n in in_order],
        "parameters": parameters,
        "gap_sigma": gap,
        "gaps_alone_sigma": [gaps[n] for n in in_order],
        "elements": None,
        "noise": [laboratory.noise, laboratory.floor],
        "peak_v": 1.0,
        "strata": laboratory.strata(),
    }


def write(folder, name, laboratory, levels, dark, phases_rad):
    """A recorded scan: `scan.toml` and `samples.csv`."""
    folder.mkdir(parents=True)
    keys = "\n".join(f"{key} = {json.dumps(value)}" for key, value in laboratory.layout.items())
    foci = "\n".join(f"[[focus]]\n{drive}" for drive in laboratory.drives())
    phase = '[phase]\nreference = "drive-sync"\nconvention = "exp(-iwt)"\n\n' if phases_rad is not None else ""
    (folder / "scan.toml").write_text(
        f'format = 1\nname = "{name}"\nrecorded = 2026-11-28T12:00:00Z\nreading = "V"\n\n[array]\n{keys}\n\n'
        f"[medium]\nspeed_of_sound_m_s = {laboratory.speed_m_s}\n\n"
        f'[simulator]\nmodel = "piston"\n\n{phase}{foci}\n'
    )
    lines = ["time_s,focus,x_mm,y_mm,z_mm,reading"]
    lines += [f"{-10 + 0.1 * n:.3f},-1,0,0,{1e3 * laboratory.heights_m[0]:.4f},{v:.6g}" for n, v in enumerate(dark)]
    visits = zip(laboratory.time_s, laboratory.focus, 1e3 * laboratory.visits_m.T, levels)
    lines += [f"{t:.3f},{focus},{x:.4f},{y:.4f},{z:.4f},{v:.6g}" for t, focus, (x, y, z), v in visits]
    if phases_rad is not None:
        of_rows = ["phase_rad", *[""] * len(dark), *[f"{phase:.5f}" for phase in phases_rad]]
        lines = [f"{line},{phase}" for line, phase in zip(lines, of_rows)]
    (folder / "samples.csv").write_text("\n".join(lines) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path, help="a new folder for the scans")
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--answers", type=pathlib.Path, required=True, help="where the true causes are written")
    parser.add_argument("--varied", action="store_true", help="scans of many kinds, other radiators, more causes")
    arguments = parser.parse_args()
    if arguments.folder.exists():
        sys.exit(f"{arguments.folder} exists already; choose another folder")
    scans = [
        one(arguments.folder, f"{number:04}", np.random.default_rng([arguments.seed, number]), arguments.varied)
        for number in range(arguments.count)
    ]
    answers = {"format": 1, "seed": arguments.seed, "answers": scans}
    arguments.answers.write_text(json.dumps(answers, indent=1))


if __name__ == "__main__":
    main()
