"""Makes a set of scans whose field, walls, lobes and elements are levitate's, to check diagnoses on physics that is not fieldgap's.

Levitate (https://github.com/AppliedAcousticsChalmers/levitate) sums far-field pistons and their images in mirror planes. The robot, the
receiver and the noise are written here. Run it after `pip install levitate "scipy<1.15"`:

    python python/outside/levitate_set.py sets/levitate --count 100 --seed 1 --answers levitate-answers.json
    fieldgap blind seal sets/levitate levitate-answers.json
    fieldgap blind run sets/levitate
    fieldgap blind score sets/levitate

A tenth of the scans has no cause, a fifth two, a fifth one that the catalogue does not have, the rest one. Of a cause with a size, the
size makes a gap that is uniform in its logarithm from 0.3 to 8 standard deviations of a reading's noise.
"""

import argparse
import json
import math
import pathlib
import sys
import warnings

import numpy as np
from levitate.arrays import TransducerArray
from levitate.materials import Air
from levitate.transducers import CircularPiston, PointSource, TransducerReflector

# Levitate warns of a second air; each scan has its own.
warnings.filterwarnings("ignore", message="Material `Air` with modified properties")

FREQUENCY_HZ = 40e3
GAPS_SIGMA = (0.3, 8.0)
# Radius of the piston that the record's simulator has.
FACE_M = 4.5e-3
# How well careful labs set the robot's origin, standard deviation along each axis.
ORIGIN_M = 3e-4
DARK_READINGS = 64
REPEATED_PLACES = 60


class Laboratory:
    """A set-up as the record states it: array, foci, path of the robot, and noise."""

    def __init__(self, random):
        self.speed_m_s = random.uniform(340.0, 348.0)
        self.layout, self.places_m, self.pitch_m = layout(random)
        width_m = np.ptp(self.places_m[0]) + self.pitch_m
        self.foci_m = [
            np.array([*random.uniform(-0.02, 0.02, 2), width_m * random.uniform(1.2, 2.2)])
            for _ in range(random.choice([1, 1, 1, 2, 3]))
        ]
        self.heights_m = self.foci_m[0][2] * np.array([0.6, 1.0, 1.4, 1.8])[: random.integers(2, 5)]
        self.path(random)
        self.noise = random.uniform(0.005, 0.03)
        self.floor = random.uniform(0.001, 0.005)

    def path(self, random):
        """Serpentine rows in each plane, all of it for each focus, and some places again at the end."""
        x = np.arange(-0.03, 0.0301, random.choice([2e-3, 2.5e-3, 3e-3]))
        rows = [(x[:: 1 if n % 2 == 0 else -1], y) for n, y in enumerate(x)]
        plane = np.concatenate([np.stack([row, np.full_like(row, y)]) for row, y in rows], axis=1)
        planes = [np.vstack([plane, np.full(plane.shape[1], z)]) for z in self.heights_m]
        once_m = np.concatenate(planes, axis=1)
        again = np.sort(random.choice(once_m.shape[1], REPEATED_PLACES, replace=False))
        visits_m = np.concatenate([once_m, once_m[:, again]], axis=1)
        self.visits_m = np.tile(visits_m, len(self.foci_m))
        self.focus = np.repeat(np.arange(len(self.foci_m)), visits_m.shape[1])
        self.time_s = 0.1 * np.arange(self.focus.size)
        # The first visit of a row comes from the row before, up or down the rows.
        step_m = np.diff(self.visits_m[0], prepend=self.visits_m[0, 0] - 1e-3)
        self.way = np.sign(step_m)
        for n in np.flatnonzero(self.way == 0):
            self.way[n] = self.way[n - 1]

    def delays_s(self):
        """Delays of the elements by focus, for the speed of sound as believed."""
        paths_m = [np.linalg.norm(self.places_m.T - focus_m, axis=1) for focus_m in self.foci_m]
        return [(path_m.max() - path_m) / self.speed_m_s for path_m in paths_m]


def layout(random):
    """The keys of `[array]`, the elements' places in its order, and their pitch, which is their diameter too."""
    pitch_m = random.choice([10e-3, 10.5e-3, 16e-3])
    kind = random.choice(["6", "6", "8", "hexagonal", "16"])
    if kind == "hexagonal":
        corner = lambda n: np.array([math.sin(n * math.pi / 3), math.cos(n * math.pi / 3)])  # noqa: E731
        places = [np.zeros(2)]
        for ring in range(1, 4):
            for side in range(6):
                a, b = ring * corner(side), ring * corner(side + 1)
                places += [a + (b - a) * step / ring for step in range(ring)]
        keys = {"layout": "hexagonal", "rings": 3}
        flat = pitch_m * np.array(places).T
    else:
        side = int(kind)
        if side == 16:
            pitch_m = 10e-3
        along = (np.arange(side) - (side - 1) / 2) * pitch_m
        flat = np.array([(x, y) for y in along[::-1] for x in along]).T
        keys = {"layout": "square", "columns": side, "rows": side}
    keys |= {"frequency_hz": FREQUENCY_HZ, "element_diameter_mm": 1e3 * pitch_m, "spacing_mm": 0.0}
    return keys, np.vstack([flat, np.zeros(flat.shape[1])]), pitch_m


class Truth:
    """What is really there: first as the record states it, then changed by causes."""

    def __init__(self, laboratory, peak=1.0):
        self.laboratory = laboratory
        self.peak = peak
        count = laboratory.places_m.shape[1]
        self.speed_m_s = laboratory.speed_m_s + np.zeros_like(laboratory.time_s)
        self.frequency_hz = FREQUENCY_HZ
        self.radius_m = FACE_M
        self.elements_m = laboratory.places_m.copy()
        self.normals = np.tile([[0.0], [0.0], [1.0]], count)
        self.emitted = np.ones(count, complex)
        self.order = np.arange(count)
        self.steps = None
        self.coupling = 0.0
        self.mirrors = []
        self.visits_m = laboratory.visits_m.copy()
        self.face_m = 0.0
        self.gain = np.ones_like(laboratory.time_s)
        self.focus = laboratory.focus.copy()
        self.others = []
        self.of_receiver = []

    def states(self):
        """Complex drive of each element by focus."""
        omega = 2 * math.pi * self.frequency_hz
        drives = []
        for delay_s in self.laboratory.delays_s():
            phase = omega * delay_s
            if self.steps:
                step = 2 * math.pi / self.steps
                phase = step * np.round(phase / step)
            drive = np.exp(1j * phase)[self.order]
            if self.coupling:
                apart_m = np.linalg.norm(self.elements_m[:, :, None] - self.elements_m[:, None, :], axis=0)
                near = (apart_m > 0) & (apart_m < 1.1 * self.laboratory.pitch_m)
                drive = drive + self.coupling * near @ drive
            drives.append(drive * self.emitted)
        return drives

    def transducer(self, speed_m_s):
        radiator = CircularPiston(
            effective_radius=self.radius_m, freq=self.frequency_hz, p0=1.0, medium=Air(c=speed_m_s)
        )
        for point_m, normal, coefficient in self.mirrors:
            radiator = TransducerReflector(
                radiator, plane_intersect=point_m, plane_normal=normal, reflection_coefficient=coefficient
            )
        return radiator

    def pressures(self):
        """Complex pressure at each visit."""
        found = np.zeros(self.time_s.size, complex)
        states = self.states()
        offsets_m = face(self.face_m)
        # A speed of sound that changes is a stair of sixty steps, a hundredth of what matters.
        for speed_m_s in np.unique(self.speed_m_s):
            array = TransducerArray(
                self.elements_m, self.normals, transducer=self.transducer(speed_m_s)
            )
            for focus, state in enumerate(states):
                here = (self.speed_m_s == speed_m_s) & (self.focus == focus)
                if not here.any():
                    continue
                for offset_m in offsets_m.T:
                    at_m = self.visits_m[:, here] + offset_m[:, None]
                    found[here] += state @ array.pressure_derivs(at_m, orders=0)[0] / offsets_m.shape[1]
                    for source in self.others:
                        found[here] += source(at_m)
        return found * self.gain

    @property
    def time_s(self):
        return self.laboratory.time_s

    def readings(self, pressures, noise=None):
        """Magnitudes, with the noise that comes in before the receiver changes them."""
        levels = np.abs(pressures if noise is None else noise(pressures))
        for change in self.of_receiver:
            levels = change(levels)
        return levels


def face(radius_m):
    """Places that average over a disc: its centre and three rings with the same area each between them."""
    if radius_m == 0.0:
        return np.zeros((3, 1))
    places = []
    for ring in range(5):
        r = radius_m * math.sqrt((ring + 0.5) / 5)
        turns = 2 * math.pi * (np.arange(8) + 0.5 * (ring % 2)) / 8
        places.append(np.stack([r * np.cos(turns), r * np.sin(turns), np.zeros(8)]))
    return np.concatenate(places, axis=1)


# Causes: each draws itself for a laboratory and returns its parameters by size, and a function that changes the truth.
# A size of 1 is as much as laboratories have.


def numbers(effect, names, draw, change, neutral=0.0):
    """A cause whose parameters depart from the neutral ones in proportion to its size."""

    def cause(laboratory, random):
        full = np.atleast_1d(draw(random))

        def parameters(size):
            return {f"{effect}.{name}": neutral + size * float(value) for name, value in zip(names, full)}

        return parameters, lambda truth, size: change(truth, *(size * full))

    return cause


def sign(random):
    return random.choice([-1.0, 1.0])


def shifted(truth, x_mm, y_mm, z_mm):
    truth.visits_m += 1e-3 * np.array([[x_mm], [y_mm], [z_mm]])


def turned(truth, angle):
    x, y, z = truth.visits_m
    truth.visits_m = np.stack([x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle), z])


def skewed(truth, angle):
    x, y, z = truth.visits_m
    truth.visits_m = np.stack([x + y * math.sin(angle), y * math.cos(angle), z])


def trailed(truth, play_mm):
    truth.visits_m[0] -= 0.5e-3 * play_mm * truth.laboratory.way


def tilted(truth, about_x, about_y):
    (cx, sx), (cy, sy) = [(math.cos(a), math.sin(a)) for a in (about_x, about_y)]
    turn = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]) @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    truth.elements_m = turn @ truth.elements_m
    truth.normals = turn @ truth.normals


def bowed(truth, sagitta_mm):
    square = (truth.elements_m[:2] ** 2).sum(axis=0)
    truth.elements_m[2] += 1e-3 * sagitta_mm * square / square.max()


def drifted(truth, relative):
    truth.gain *= 1 + relative * truth.time_s / truth.time_s[-1]


def warmed(truth, k_per_h):
    stairs = np.round(60 * truth.time_s / truth.time_s[-1]) / 60
    truth.speed_m_s = truth.speed_m_s * np.sqrt(1 + k_per_h * stairs * truth.time_s[-1] / 3600 / 293.15)


def faster(truth, speed_m_s):
    truth.speed_m_s = truth.speed_m_s + speed_m_s


def detuned(truth, ratio):
    truth.frequency_hz *= 1 + ratio


def stretched(truth, ratio):
    truth.elements_m[:2] *= 1 + ratio


def narrowed(truth, ratio):
    truth.radius_m *= 1 + ratio


def averaged(truth, radius_mm):
    truth.face_m = 1e-3 * radius_mm


def scaled(truth, x, y, z):
    truth.visits_m *= 1 + np.array([[x], [y], [z]])


def element_gain(laboratory, random):
    normal = random.standard_normal(laboratory.places_m.shape[1])

    def change(truth, size):
        truth.emitted = truth.emitted * np.maximum(1 + 0.3 * size * normal, 0.05)

    return lambda size: {"element-gain.spread": 0.3 * size}, change


def element_phase(laboratory, random):
    normal = random.standard_normal(laboratory.places_m.shape[1])

    def change(truth, size):
        truth.emitted = truth.emitted * np.exp(1j * 0.6 * size * normal)

    return lambda size: {"element-phase.spread_rad": 0.6 * size}, change


def some(laboratory, random, most):
    count = laboratory.places_m.shape[1]
    return sorted(int(n) for n in random.choice(count, random.integers(1, most + 1), replace=False))


def dead(laboratory, random):
    elements = some(laboratory, random, 3)

    def change(truth, _):
        truth.emitted[elements] = 0.0

    return lambda _: {"dead-elements.elements": elements}, change


def reversed_elements(laboratory, random):
    elements = some(laboratory, random, 3)

    def change(truth, _):
        truth.emitted[elements] *= -1.0

    return lambda _: {"polarity.elements": elements}, change


def swapped(laboratory, random):
    count = laboratory.places_m.shape[1]
    pair = sorted(int(n) for n in random.choice(count, 2, replace=False))

    def change(truth, _):
        truth.order[pair] = truth.order[pair[::-1]]

    return lambda _: {"swapped-channels.elements": pair}, change


def rounded(laboratory, random):
    steps = int(random.choice([3, 4, 5, 6, 8, 10]))

    def change(truth, _):
        truth.steps = steps

    return lambda _: {"phase-quantisation.steps": steps}, change


def complex_number(random, size):
    value = random.uniform(0.3, 1.0) * np.exp(2j * math.pi * random.random())
    return size * value


def crosstalk(laboratory, random):
    full = complex_number(random, 0.15)

    def change(truth, size):
        truth.coupling = size * full

    return lambda size: {"crosstalk.coefficient": [size * full.real, size * full.imag]}, change


def reflection(laboratory, random):
    height_m = laboratory.heights_m.max() + random.uniform(0.03, 0.2)
    full = complex_number(random, 0.8)

    def change(truth, size):
        truth.mirrors.append(([0, 0, height_m], [0, 0, -1], size * full))

    def parameters(size):
        return {"reflection.height_mm": 1e3 * height_m, "reflection.coefficient": [size * full.real, size * full.imag]}

    return parameters, change


def wall(laboratory, random):
    turn, lean = random.uniform(0, 2 * math.pi), random.uniform(-0.15, 0.15)
    normal = np.array([math.cos(lean) * math.cos(turn), math.cos(lean) * math.sin(turn), math.sin(lean)])
    distance_m = random.uniform(0.08, 0.2) + laboratory.places_m[:2].max()
    full = complex_number(random, 0.8)

    def change(truth, size):
        truth.mirrors.append((distance_m * normal, -normal, size * full))

    return lambda size: {"wall.distance_mm": 1e3 * distance_m}, change


def at_level(name, change):
    """A limit of the receiver: a size of 1 is at a fifth of the largest reading."""

    def cause(laboratory, random):
        def of(truth, size):
            level = limit(size) * truth.peak
            truth.of_receiver.append(lambda levels: change(levels, level))

        return lambda size: {f"{name}.level": limit(size)}, of

    def limit(size):
        return 0.2 * size if name == "noise-floor" else 0.2 / size

    return cause


# Causes that no effect of the catalogue is.


def second_source(laboratory, random):
    at_m = np.array([*(sign(random) * random.uniform(0.1, 0.3, 2)), random.uniform(0.0, 0.2)])

    def change(truth, size):
        source = TransducerArray(
            at_m[:, None],
            -at_m[:, None] / np.linalg.norm(at_m),
            transducer=PointSource(freq=FREQUENCY_HZ, p0=1.0, medium=Air(c=laboratory.speed_m_s)),
        )
        level = size * 20.0
        truth.others.append(lambda places_m: level * source.pressure_derivs(places_m, orders=0)[0, 0])

    return lambda _: {}, change


def lost_steps(laboratory, random):
    since = int(random.uniform(0.2, 0.8) * laboratory.time_s.size)
    axis, direction = random.integers(0, 2), sign(random)

    def change(truth, size):
        truth.visits_m[axis, since:] += direction * 5e-3 * size

    return lambda _: {}, change


def squinting_elements(laboratory, random):
    lean = random.standard_normal(laboratory.places_m.shape)

    def change(truth, size):
        normals = truth.normals + 0.5 * size * lean
        truth.normals = normals / np.linalg.norm(normals, axis=0)

    return lambda _: {}, change


def jumps_of_level(laboratory, random):
    stairs = random.uniform(-1, 1, 7)

    def change(truth, size):
        truth.gain *= 1 + 0.5 * size * stairs[(6.999 * truth.time_s / truth.time_s[-1]).astype(int)]

    return lambda _: {}, change


def sound_speed(laboratory, random):
    full = sign(random) * 12.0
    return lambda size: {"sound-speed.c_m_s": laboratory.speed_m_s + size * full}, lambda t, size: faster(t, size * full)


def directivity(laboratory, random):
    full = sign(random) * 0.4
    # What is told of a lobe is its width by another measure than the radius of a face.
    return lambda size: {}, lambda truth, size: narrowed(truth, size * full)


CATALOGUE = {
    "sound-speed": sound_speed,
    "directivity": directivity,
    "element-gain": element_gain,
    "element-phase": element_phase,
    "dead-elements": dead,
    "polarity": reversed_elements,
    "swapped-channels": swapped,
    "pitch": numbers("pitch", ["ratio"], lambda r: sign(r) * 0.05, stretched, 1.0),
    "array-tilt": numbers(
        "array-tilt", ["about_x_rad", "about_y_rad"], lambda r: r.uniform(-0.1, 0.1, 2), tilted
    ),
    "phase-quantisation": rounded,
    "drive-frequency": numbers("drive-frequency", ["ratio"], lambda r: sign(r) * 0.03, detuned, 1.0),
    "offset": numbers("offset", ["x_mm", "y_mm", "z_mm"], lambda r: r.uniform(-8, 8, 3), shifted),
    "rotation": numbers("rotation", ["rad"], lambda r: sign(r) * 0.2, turned),
    "axis-scale": numbers("axis-scale", ["x", "y", "z"], lambda r: r.uniform(-0.1, 0.1, 3), scaled, 1.0),
    "skew": numbers("skew", ["rad"], lambda r: sign(r) * 0.2, skewed),
    "backlash": numbers("backlash", ["mm"], lambda r: 3.0, trailed),
    "aperture": numbers("aperture", ["radius_mm"], lambda r: 8.0, averaged),
    "saturation": at_level("saturation", lambda v, level: v / np.sqrt(1 + (v / level) ** 2)),
    "noise-floor": at_level("noise-floor", np.hypot),
    "clipping": at_level("clipping", np.minimum),
    "reflection": reflection,
    "wall": wall,
    "gain-drift": numbers("gain-drift", ["relative"], lambda r: sign(r) * 0.5, drifted),
    "temperature-drift": numbers("temperature-drift", ["k_per_h"], lambda r: sign(r) * 40.0, warmed),
    "bowed-array": numbers("bowed-array", ["sagitta_mm"], lambda r: sign(r) * 5.0, bowed),
    "crosstalk": crosstalk,
}
OUTSIDE = {
    "second source": second_source,
    "lost steps": lost_steps,
    "squinting elements": squinting_elements,
    "jumps of level": jumps_of_level,
}
WITHOUT_SIZE = {"dead-elements", "polarity", "swapped-channels", "phase-quantisation"}


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


def drawn(random):
    """Category and causes of a scan."""
    kind = random.random()
    names = list(CATALOGUE)
    if kind < 0.1:
        return "none", []
    if kind < 0.3:
        return "two", [str(name) for name in random.choice(names, 2, replace=False)]
    if kind < 0.5:
        return "outside", [str(random.choice(list(OUTSIDE)))]
    return "one", [str(random.choice(names))]


def one(folder, name, random):
    """Writes a scan, and returns its answer."""
    laboratory = Laboratory(random)
    category, names = drawn(random)
    believed = Believed(laboratory)
    peak = believed.peak
    least = 0.5 if category == "two" else GAPS_SIGMA[0]
    acting, gaps, parameters = [], [], {}
    for number, cause in enumerate(names):
        target = math.exp(random.uniform(math.log(least), math.log(GAPS_SIGMA[1])))
        gap = 0.0
        while gap < 0.9 * least:
            describe, act = (CATALOGUE | OUTSIDE)[cause](laboratory, random)
            size, gap = sized(laboratory, act, math.inf if cause in WITHOUT_SIZE else target, believed)
            if gap < 0.9 * least and category in ("one", "two"):
                # Here this cause makes less than that at its largest.
                cause = str(random.choice([name for name in CATALOGUE if name not in names]))
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
    write(folder / name, name, laboratory, levels, dark)
    return {
        "name": name,
        "category": category,
        "effects": names,
        "parameters": parameters,
        "gap_sigma": gap,
        "gaps_alone_sigma": gaps,
        "elements": None,
        "noise": [laboratory.noise, laboratory.floor],
        "peak_v": 1.0,
        "strata": {"elements": str(laboratory.places_m.shape[1]), "drives": str(len(laboratory.foci_m))},
    }


def write(folder, name, laboratory, levels, dark):
    """A recorded scan: `scan.toml` and `samples.csv`."""
    folder.mkdir(parents=True)
    keys = "\n".join(f"{key} = {json.dumps(value)}" for key, value in laboratory.layout.items())
    foci = "\n".join(
        "[[focus]]\n" + "\n".join(f"{axis}_mm = {1e3 * x:.4f}" for axis, x in zip("xyz", focus_m))
        for focus_m in laboratory.foci_m
    )
    (folder / "scan.toml").write_text(
        f'format = 1\nname = "{name}"\nrecorded = 2026-11-28T12:00:00Z\nreading = "V"\n\n[array]\n{keys}\n\n'
        f"[medium]\nspeed_of_sound_m_s = {laboratory.speed_m_s}\n\n"
        f'[simulator]\nmodel = "piston"\n\n{foci}\n'
    )
    lines = ["time_s,focus,x_mm,y_mm,z_mm,reading"]
    lines += [f"{-10 + 0.1 * n:.3f},-1,0,0,{1e3 * laboratory.heights_m[0]:.4f},{v:.6g}" for n, v in enumerate(dark)]
    visits = zip(laboratory.time_s, laboratory.focus, 1e3 * laboratory.visits_m.T, levels)
    lines += [f"{t:.3f},{focus},{x:.4f},{y:.4f},{z:.4f},{v:.6g}" for t, focus, (x, y, z), v in visits]
    (folder / "samples.csv").write_text("\n".join(lines) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path, help="a new folder for the scans")
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--answers", type=pathlib.Path, required=True, help="where the true causes are written")
    arguments = parser.parse_args()
    if arguments.folder.exists():
        sys.exit(f"{arguments.folder} exists already; choose another folder")
    scans = [
        one(arguments.folder, f"{number:04}", np.random.default_rng([arguments.seed, number]))
        for number in range(arguments.count)
    ]
    answers = {"format": 1, "seed": arguments.seed, "answers": scans}
    arguments.answers.write_text(json.dumps(answers, indent=1))


if __name__ == "__main__":
    main()
