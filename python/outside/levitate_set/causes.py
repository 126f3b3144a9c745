"""Causes of a gap: each draws itself for a laboratory, and returns its parameters by size and a function that changes the truth.

A size of one is as much as laboratories have.
"""

import math

import numpy as np
from laboratory import FREQUENCY_HZ
from levitate.arrays import TransducerArray
from levitate.materials import Air
from levitate.transducers import PointSource


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
    """The nozzle trails by half of the play, or leads by it; after a turn it stands until the play is taken up."""
    half_m = 0.5e-3 * abs(play_mm)
    nozzle_m = -math.inf
    for n, way_m in enumerate(zip(truth.laboratory.turns_m(), truth.laboratory.visits_m[0])):
        for motor_m in way_m:
            nozzle_m = min(max(nozzle_m, motor_m - half_m), motor_m + half_m)
        truth.visits_m[0, n] += math.copysign(1, play_mm) * (nozzle_m - motor_m)


def tilted(truth, about_x, about_y):
    (cx, sx), (cy, sy) = [(math.cos(a), math.sin(a)) for a in (about_x, about_y)]
    turn = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]) @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    truth.elements_m = turn @ truth.elements_m
    truth.normals = turn @ truth.normals


def bowed(truth, sagitta_mm):
    """A bowl: the elements stand on it and face away from it."""
    flat = truth.elements_m[:2]
    curvature = 2e-3 * sagitta_mm / (flat**2).sum(axis=0).max()
    truth.elements_m[2] += 0.5 * curvature * (flat**2).sum(axis=0)
    normals = np.vstack([truth.normals[:2] - curvature * flat, truth.normals[2:]])
    truth.normals = normals / np.linalg.norm(normals, axis=0)


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


def jumps_of_level(laboratory, random):
    stairs = random.uniform(-1, 1, 7)

    def change(truth, size):
        truth.gain *= 1 + 0.5 * size * stairs[(6.999 * truth.time_s / truth.time_s[-1]).astype(int)]

    return lambda _: {}, change


def leaning(laboratory, random):
    lean = random.standard_normal(laboratory.places_m.shape)

    def change(truth, size):
        normals = truth.normals + 0.5 * size * lean
        truth.normals = normals / np.linalg.norm(normals, axis=0)

    return lambda size: {"element-tilt.spread_rad": 0.5 * size}, change


def sound_speed(laboratory, random):
    full = sign(random) * 12.0
    return lambda size: {"sound-speed.c_m_s": laboratory.speed_m_s + size * full}, lambda t, size: faster(
        t, size * full
    )


def directivity(laboratory, random):
    full = sign(random) * 0.4
    # What is told of a lobe is its width by another measure than the radius of a face.
    return lambda size: {}, lambda truth, size: narrowed(truth, size * full)


CATALOGUE = {
    "sound-speed": sound_speed,
    "directivity": directivity,
    "element-gain": element_gain,
    "element-phase": element_phase,
    "element-tilt": leaning,
    "dead-elements": dead,
    "polarity": reversed_elements,
    "swapped-channels": swapped,
    "pitch": numbers("pitch", ["ratio"], lambda r: sign(r) * 0.05, stretched, 1.0),
    "array-tilt": numbers("array-tilt", ["about_x_rad", "about_y_rad"], lambda r: r.uniform(-0.1, 0.1, 2), tilted),
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
    "jumps of level": jumps_of_level,
}
WITHOUT_SIZE = {"dead-elements", "polarity", "swapped-channels", "phase-quantisation"}
