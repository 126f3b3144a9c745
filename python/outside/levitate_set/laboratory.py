"""The set-up that a record states."""

import math

import numpy as np

FREQUENCY_HZ = 40e3
REPEATED_PLACES = 60


class Laboratory:
    """A set-up as the record states it: array, foci, path of the robot, and noise."""

    # Phase of the receiver's reference at each visit; `None` without phases.
    reference_rad = None

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
        self.at_rest(random, once_m, REPEATED_PLACES)
        self.time_s = 0.1 * np.arange(self.focus.size)

    def at_rest(self, random, once_m, repeats):
        """All places for each focus, and some of them again at the end."""
        again = np.sort(random.choice(once_m.shape[1], min(repeats, once_m.shape[1]), replace=False))
        visits_m = np.concatenate([once_m, once_m[:, again]], axis=1)
        self.visits_m = np.tile(visits_m, len(self.foci_m))
        self.focus = np.repeat(np.arange(len(self.foci_m)), visits_m.shape[1])

    def turns_m(self):
        """Where along x the robot turned before each visit: straight from the one before, and to the first from below."""
        return np.concatenate([self.visits_m[0, :1] - 10e-3, self.visits_m[0, :-1]])

    def drives(self):
        """The entries `[[focus]]` of the record."""
        return ["\n".join(f"{axis}_mm = {1e3 * x:.4f}" for axis, x in zip("xyz", at_m)) for at_m in self.foci_m]

    def strata(self):
        """What the rates are told apart by."""
        return {"elements": str(self.places_m.shape[1]), "drives": str(len(self.foci_m))}

    def delays_s(self):
        """Delays of the elements by focus, for the speed of sound as believed."""
        paths_m = [np.linalg.norm(self.places_m.T - focus_m, axis=1) for focus_m in self.foci_m]
        return [(path_m.max() - path_m) / self.speed_m_s for path_m in paths_m]


def layout(random):
    """The keys of `[array]`, the elements' places in its order, and their pitch, which is their diameter too."""
    pitch_m = random.choice([10e-3, 10.5e-3, 16e-3])
    kind = random.choice(["6", "6", "8", "hexagonal", "16"])
    if kind == "hexagonal":
        corners = [pitch_m * np.array([math.sin(n * math.pi / 3), math.cos(n * math.pi / 3)]) for n in range(7)]
        places = [np.zeros(2)]
        for ring in range(1, 4):
            for side in range(6):
                a, b = ring * corners[side], ring * corners[side + 1]
                places += [a + (b - a) * step / ring for step in range(ring)]
        keys = {"layout": "hexagonal", "rings": 3}
        flat = np.array(places).T
    else:
        side = int(kind)
        if side == 16:
            pitch_m = 10e-3
        along = (np.arange(side) - (side - 1) / 2) * pitch_m
        flat = np.array([(x, y) for y in along[::-1] for x in along]).T
        keys = {"layout": "square", "columns": side, "rows": side}
    keys |= {"frequency_hz": FREQUENCY_HZ, "element_diameter_mm": 1e3 * pitch_m, "spacing_mm": 0.0}
    return keys, np.vstack([flat, np.zeros(flat.shape[1])]), pitch_m
