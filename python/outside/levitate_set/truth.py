"""What is really there, and the field that levitate makes of it."""

import math
import warnings

import numpy as np
from laboratory import FREQUENCY_HZ
from levitate.arrays import TransducerArray
from levitate.materials import Air
from levitate.transducers import CircularPiston, TransducerReflector

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
            array = TransducerArray(self.elements_m, self.normals, transducer=self.transducer(speed_m_s))
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
