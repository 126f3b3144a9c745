"""Causes beside those of `causes`: of the air, the receiver, the robot in motion, and of elements that are no pistons."""

import math

import numpy as np
from causes import CATALOGUE, directivity, numbers, sign


def of_paths(effect, names, draw, factor):
    """A cause that changes what each element adds by a factor, given its parameters and the places."""

    def change(truth, *values):
        truth.of_paths.append(lambda truth, at_m, here: factor(truth, at_m, here, *values))

    return numbers(effect, names, draw, change)


def paths(truth, at_m):
    """Vectors from each element to each place: axis, element, place; and their lengths."""
    apart_m = at_m[:, None, :] - truth.elements_m[:, :, None]
    return apart_m, np.linalg.norm(apart_m, axis=0)


def wavenumbers_rad_m(truth, here):
    return 2 * math.pi * truth.frequency_hz / truth.speed_m_s[here]


def absorbed(truth, at_m, here, db_per_m):
    return 10 ** (-db_per_m * paths(truth, at_m)[1] / 20)


def blown(truth, at_m, here, x_m_s, y_m_s):
    apart_m, length_m = paths(truth, at_m)
    along_m_s = (x_m_s * apart_m[0] + y_m_s * apart_m[1]) / length_m
    speed_m_s = truth.speed_m_s[here]
    return np.exp(1j * wavenumbers_rad_m(truth, here) * length_m * (speed_m_s / (speed_m_s + along_m_s) - 1))


def graded(truth, at_m, here, x, y, z):
    """The slowness is averaged along straight paths."""
    _, length_m = paths(truth, at_m)
    gradient = np.array([x, y, z])
    at_element, at_place = (gradient @ truth.elements_m)[:, None], (gradient @ at_m)[None, :]
    nodes, weights = np.polynomial.legendre.leggauss(5)
    shares = 0.5 * (nodes + 1)
    slowness = sum(
        0.5 * weight / (1 + at_element + share * (at_place - at_element)) for share, weight in zip(shares, weights)
    )
    return np.exp(1j * wavenumbers_rad_m(truth, here) * length_m * (slowness - 1))


def heard_from(truth, at_m, here, inverse_square):
    apart_m, length_m = paths(truth, at_m)
    angle_deg = np.degrees(np.arccos(np.clip(apart_m[2] / length_m, -1, 1)))
    return 0.5 ** (angle_deg**2 * inverse_square)


def receiver_directivity(laboratory, random):
    full = 1 / random.uniform(15.0, 30.0) ** 2

    def change(truth, size):
        truth.of_paths.append(lambda truth, at_m, here: heard_from(truth, at_m, here, size * full))

    return lambda size: {"receiver-directivity.half_angle_deg": 1 / math.sqrt(size * full)}, change


def turbulence(laboratory, random):
    """The phase of each path by itself, and of each reading."""
    shape = (laboratory.places_m.shape[1], laboratory.time_s.size)
    normal = random.standard_normal(shape).astype(np.float32)
    full = 2.5

    def change(truth, size):
        def factor(truth, at_m, here):
            return np.exp(1j * size * full * np.sqrt(paths(truth, at_m)[1]) * normal[:, here])

        truth.of_paths.append(factor)

    return lambda size: {"turbulence.rad_per_sqrt_m": size * full}, change


def lag(laboratory, random):
    """In flight only."""
    full_s = 0.12

    def change(truth, size):
        if laboratory.along:
            truth.visits_m[0] += laboratory.later_m(size * full_s)

    return lambda size: {"lag.s": size * full_s}, change


def jitter(laboratory, random):
    normal = random.standard_normal(laboratory.visits_m.shape)
    full_mm = random.uniform(0.3, 1.0, 3) * 2.0

    def change(truth, size):
        truth.visits_m += 1e-3 * size * full_mm[:, None] * normal

    return lambda size: {f"position-jitter.{a}_mm": float(size * f) for a, f in zip("xyz", full_mm)}, change


def lead_screw(laboratory, random):
    axis, lead_mm, phase = random.integers(0, 2), random.choice([5.0, 8.0, 10.0]), random.uniform(0, 2 * math.pi)

    def change(truth, size):
        along_mm = 1e3 * laboratory.visits_m[axis]
        truth.visits_m[axis] += 1e-3 * size * np.sin(2 * math.pi * along_mm / lead_mm + phase)

    return lambda _: {}, change


def drift(laboratory, random):
    """Of the level: steady, or fast at first."""
    if random.random() < 0.5:
        return CATALOGUE["gain-drift"](laboratory, random)
    full, constant = sign(random) * 0.4, random.uniform(0.1, 0.3)

    def change(truth, size):
        truth.gain *= 1 + size * full * np.exp(-truth.time_s / truth.time_s[-1] / constant)

    return lambda _: {}, change


def any_directivity(laboratory, random):
    """A face of another size; one that moves less at its rim, or the other way; or one with the lobe of a ring in it."""
    kind = random.integers(0, 3)
    if kind == 0 or (kind == 1 and laboratory.places_m.shape[1] > 64):
        return directivity(laboratory, random)
    full = random.uniform(0.8, 1.4)

    def change(truth, size):
        if kind == 1:
            truth.falls_by = full * size
        else:
            truth.of_ring = 0.6 * full * size

    return lambda _: {}, change


def rounded_from_anywhere(laboratory, random):
    """To the nearest step or to the one before, from a zero that is anybody's."""
    steps = int(random.choice([3, 4, 5, 6, 8, 10, 12, 16]))
    rounding, zero = [np.round, np.floor][random.integers(0, 2)], random.random()

    def change(truth, _):
        truth.steps, truth.rounding, truth.zero = steps, rounding, zero

    return lambda _: {"phase-quantisation.steps": steps}, change


def horizontal(most):
    def draw(random):
        turn = random.uniform(0, 2 * math.pi)
        return [most * math.cos(turn), most * math.sin(turn)]

    return draw


VARIED = {
    "directivity": any_directivity,
    "phase-quantisation": rounded_from_anywhere,
    "absorption": of_paths("absorption", ["db_per_m"], lambda r: 20.0, absorbed),
    "flow": of_paths("flow", ["vx_m_s", "vy_m_s"], horizontal(6.0), blown),
    "temperature-gradient": of_paths(
        "temperature-gradient", ["gx", "gy", "gz"], lambda r: 0.3 * r.standard_normal(3), graded
    ),
    "turbulence": turbulence,
    "receiver-directivity": receiver_directivity,
    "lag": lag,
    "position-jitter": jitter,
    "lead-screw": lead_screw,
    "gain-drift": drift,
}
AIR_AND_RECEIVER = {"absorption", "flow", "temperature-gradient", "turbulence", "receiver-directivity"}
MIRRORS = {"reflection", "wall"}
