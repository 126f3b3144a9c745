"""What is really there, and the field that levitate makes of it."""

import math
import warnings

import numpy as np
from laboratory import FREQUENCY_HZ
from levitate.arrays import TransducerArray
from levitate.materials import Air
from levitate.transducers import CircularPiston, CircularRing, PointSource, TransducerReflector

# Levitate warns of a second air; each scan has its own.
warnings.filterwarnings("ignore", message="Material `Air` with modified properties")

# Radius of the piston that the record's simulator has.
FACE_M = 4.5e-3


class Truth:
    """What is really there: first as the record states it, then changed by causes."""

    def __init__(self, laboratory, peak=1.0):
        self.laboratory = laboratory
        self.peak = peak
        count = laboratory.places_m.shape[1]
        self.speed_m_s = laboratory.speed_m_s + np.zeros_like(laboratory.time_s)
        self.frequency_hz = FREQUENCY_HZ
        self.radius_m = FACE_M
        # A ring's share of an element's lobe.
        self.of_ring = 0.0
        # How the velocity of its face falls towards the rim; `None` of a far-field piston.
        self.falls_by = None
        self.elements_m = laboratory.places_m.copy()
        self.normals = np.tile([[0.0], [0.0], [1.0]], count)
        self.emitted = np.ones(count, complex)
        self.order = np.arange(count)
        self.steps = None
        self.rounding = np.round
        self.zero = 0.0
        self.coupling = 0.0
        self.mirrors = []
        # Factors on what each element adds at each visit, of the air between them or of the receiver.
        self.of_paths = []
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
                phase = step * self.rounding(phase / step + self.zero)
            drive = np.exp(1j * phase)[self.order]
            if self.coupling:
                apart_m = np.linalg.norm(self.elements_m[:, :, None] - self.elements_m[:, None, :], axis=0)
                near = (apart_m > 0) & (apart_m < 1.1 * self.laboratory.pitch_m)
                drive = drive + self.coupling * near @ drive
            drives.append(drive * self.emitted)
        return drives

    def radiators(self, speed_m_s):
        """Of an element: what radiates, and with which share, at which places on its face."""
        air = {"freq": self.frequency_hz, "p0": 1.0, "medium": Air(c=speed_m_s)}
        middle = np.zeros((2, 1))
        if self.falls_by is not None:
            places_m, velocities = vibrating_face(self.radius_m, self.falls_by)
            found = [(PointSource(**air), velocities, places_m)]
        else:
            found = [(CircularPiston(effective_radius=self.radius_m, **air), [1 - self.of_ring], middle)]
            if self.of_ring:
                found.append((CircularRing(effective_radius=self.radius_m, **air), [self.of_ring], middle))
        return [(self.mirrored(radiator), shares, places_m) for radiator, shares, places_m in found]

    def mirrored(self, radiator):
        for point_m, normal, coefficient in self.mirrors:
            radiator = TransducerReflector(
                radiator, plane_intersect=point_m, plane_normal=normal, reflection_coefficient=coefficient
            )
        return radiator

    def contributions(self, at_m, speed_m_s, here):
        """What each element adds at each of these visits for a unit drive."""
        across = np.array([[1.0], [0.0], [0.0]]) - self.normals[0] * self.normals
        across /= np.linalg.norm(across, axis=0)
        beside = np.cross(self.normals, across, axis=0)
        total = 0.0
        for radiator, shares, places_m in self.radiators(speed_m_s):
            for share, (x_m, y_m) in zip(shares, places_m.T):
                elements_m = self.elements_m + x_m * across + y_m * beside
                array = TransducerArray(elements_m, self.normals, transducer=radiator)
                total = total + share * array.pressure_derivs(at_m, orders=0)[0]
        for factor in self.of_paths:
            total = total * factor(self, at_m, here)
        return total

    def pressures(self):
        """Complex pressure at each visit."""
        found = np.zeros(self.time_s.size, complex)
        states = np.array(self.states())
        offsets_m = face(self.face_m)
        # A speed of sound that changes is a stair of sixty steps, a hundredth of what matters.
        for speed_m_s in np.unique(self.speed_m_s):
            here = np.flatnonzero(self.speed_m_s == speed_m_s)
            for offset_m in offsets_m.T:
                at_m = self.visits_m[:, here] + offset_m[:, None]
                added = self.contributions(at_m, speed_m_s, here)
                found[here] += np.einsum("vn,nv->v", states[self.focus[here]], added) / offsets_m.shape[1]
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


def vibrating_face(radius_m, falls_by):
    """Places on a disc and the share of each in what it radiates, if its velocity is 1 - falls_by (r/radius)²."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    squares = 0.5 * (nodes + 1)
    turns = 2 * math.pi * np.arange(9) / 9
    shares = np.repeat(0.5 * weights * (1 - falls_by * squares), turns.size) / turns.size
    r_m = radius_m * np.sqrt(squares)
    places_m = np.stack([np.outer(r_m, np.cos(turns)), np.outer(r_m, np.sin(turns))]).reshape(2, -1)
    return places_m, shares / shares.sum()


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
