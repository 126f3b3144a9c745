"""Laboratories that differ in how they scan: at rest or in flight, planes, lines, volumes, few readings, many drives; with
phases or without.
"""

import json
import math

import numpy as np
from laboratory import FREQUENCY_HZ, REPEATED_PLACES, Laboratory

# How each scan is made, and how often.
SCANS = {"planes": 0.25, "flown": 0.2, "volume": 0.15, "lines": 0.1, "few": 0.15, "coded": 0.15}
WITH_PHASES = 0.25
# Of a reading at rest: the move to it, and its dwell.
REST_S = 0.4
ACCELERATION_M_S2 = 0.5
# From the end of a row to the first sample of the next, beyond the ramps.
TURN_S = 0.3
# Drives of random phases at most: more would take hours.
MOST_CODED = 400


class VariedLaboratory(Laboratory):
    """As `Laboratory`, with one of several kinds of scan."""

    def __init__(self, random):
        super().__init__(random)
        # It wanders by a tenth of a radian through the scan, as a record allows that does not state it.
        if random.random() < WITH_PHASES:
            self.reference_rad = random.uniform(-math.pi, math.pi) + np.cumsum(
                random.normal(0, 0.1 / math.sqrt(self.time_s.size), self.time_s.size)
            )

    def path(self, random):
        self.scan = str(random.choice(list(SCANS), p=list(SCANS.values())))
        self.along = None
        getattr(self, self.scan)(random)

    def planes(self, random):
        super().path(random)
        self.time_s = REST_S * np.arange(self.focus.size)

    def at_rest(self, random, once_m, repeats):
        super().at_rest(random, once_m, repeats)
        self.time_s = REST_S * np.arange(self.focus.size)

    def anywhere(self, random, count):
        low, high = 0.6 * self.foci_m[0][2], 1.6 * self.foci_m[0][2]
        at_m = np.stack([*random.uniform(-0.03, 0.03, (2, count)), random.uniform(low, high, count)])
        self.heights_m = np.array([at_m[2].min(), at_m[2].max()])
        return np.round(at_m, 5)

    def volume(self, random):
        self.at_rest(random, self.anywhere(random, random.integers(400, 3000)), REPEATED_PLACES)

    def few(self, random):
        count = int(math.exp(random.uniform(math.log(30), math.log(300))))
        self.at_rest(random, self.anywhere(random, count), max(8, count // 5))

    def lines(self, random):
        """Through the first focus, along each axis, there and back."""
        focus_m = np.array(self.foci_m[0])
        self.heights_m = focus_m[2] * np.array([0.6, 1.6])
        lines = []
        for axis in range(3):
            line = np.repeat(focus_m[:, None], 60, axis=1)
            line[axis] = np.linspace(-0.03, 0.03, 60) if axis < 2 else np.linspace(*self.heights_m, 60)
            lines += [line, line[:, ::-1]]
        self.at_rest(random, np.round(np.concatenate(lines, axis=1), 5), 40)

    def coded(self, random):
        """A few places, and at each of them many drives of random phases; some of the drives again."""
        count = self.places_m.shape[1]
        drives = min(int(count * random.uniform(1.5, 5.0)), MOST_CODED)
        self.phases_rad = random.uniform(0, 2 * math.pi, (drives, count)).round(6)
        at_m = self.anywhere(random, random.integers(1, 5))
        order = np.concatenate([np.arange(drives), np.sort(random.choice(drives, drives // 8, replace=False))])
        self.visits_m = np.repeat(at_m, order.size, axis=1)
        self.focus = np.tile(order, at_m.shape[1])
        self.time_s = 0.05 * np.arange(self.focus.size) + 2.0 * np.repeat(np.arange(at_m.shape[1]), order.size)

    def flown(self, random):
        """Serpentine rows, each flown with a ramp at both ends and sampled at equal distances; the last rows once more."""
        step_m = random.choice([1e-3, 1.5e-3, 2e-3])
        speeds_m_s = random.choice([0.02, 0.04, 0.08], random.integers(1, 3), replace=False)
        x = np.arange(-0.024, 0.0241, step_m)
        rows = [(y, z) for z in self.heights_m[:3] for y in np.arange(-0.024, 0.0241, 2 * step_m)]
        rows += rows[-3:]
        # A ramp before the first sample and after the last, or within the row.
        lead_m = random.choice([0.0, 1.0]) * speeds_m_s.max() ** 2 / (2 * ACCELERATION_M_S2)
        places, times, focus, directions, flights = [], [], [], [], []
        now_s = 0.0
        for number in range(len(self.foci_m)):
            for row, (y, z) in enumerate(rows):
                speed_m_s = speeds_m_s[row % speeds_m_s.size]
                direction = 1 if row % 2 == 0 else -1
                flight = Flight(2 * lead_m + x[-1] - x[0], speed_m_s)
                here = x[::direction]
                times.append(now_s + flight.time_at(lead_m + np.abs(here - here[0])))
                places.append(np.stack([here, np.full_like(here, y), np.full_like(here, z)]))
                focus.append(np.full(here.size, number))
                directions += [direction] * here.size
                flights += [(flight, now_s, here[0] - direction * lead_m)] * here.size
                now_s += flight.duration_s + TURN_S
        self.visits_m = np.concatenate(places, axis=1)
        self.time_s = np.concatenate(times)
        self.focus = np.concatenate(focus)
        self.along = (np.array(directions), flights)

    def later_m(self, lag_s):
        """By how much the robot is behind along x if each reading is of this long before it."""
        directions, flights = self.along
        then = [
            start_m + direction * flight.place_at(time_s - lag_s - since_s)
            for direction, time_s, (flight, since_s, start_m) in zip(directions, self.time_s, flights)
        ]
        return np.array(then) - self.visits_m[0]

    def turns_m(self):
        turns_m = super().turns_m()
        if self.scan == "flown":
            # Beyond the end of the row before.
            first = np.flatnonzero(np.diff(self.visits_m[1], prepend=np.nan))
            turns_m[first] = [self.along[1][n][2] for n in first]
        return turns_m

    def drives(self):
        if self.scan == "coded":
            return [f"phases_rad = {json.dumps(list(phases_rad))}" for phases_rad in self.phases_rad]
        return super().drives()

    def strata(self):
        return {
            "elements": str(self.places_m.shape[1]),
            "scan": self.scan,
            "readings": "amplitude" if self.reference_rad is None else "phase",
        }

    def delays_s(self):
        if self.scan == "coded":
            return list(self.phases_rad / (2 * math.pi * FREQUENCY_HZ))
        return super().delays_s()


class Flight:
    """A straight way from rest to rest: speed up, steady, slow down."""

    def __init__(self, length_m, speed_m_s):
        self.length_m = length_m
        self.speed_m_s = speed_m_s
        self.ramp_s = speed_m_s / ACCELERATION_M_S2
        self.ramp_m = 0.5 * speed_m_s * self.ramp_s
        self.duration_s = 2 * self.ramp_s + (length_m - 2 * self.ramp_m) / speed_m_s

    def time_at(self, place_m):
        place_m = np.clip(place_m, 0, self.length_m)
        end_m = self.length_m - place_m
        up = np.sqrt(2 * np.minimum(place_m, self.ramp_m) / ACCELERATION_M_S2)
        down = np.sqrt(2 * np.minimum(end_m, self.ramp_m) / ACCELERATION_M_S2)
        steady = self.ramp_s + (place_m - self.ramp_m) / self.speed_m_s
        return np.where(place_m < self.ramp_m, up, np.where(end_m < self.ramp_m, self.duration_s - down, steady))

    def place_at(self, time_s):
        time_s = min(max(time_s, 0.0), self.duration_s)
        left_s = self.duration_s - time_s
        if time_s < self.ramp_s:
            return 0.5 * ACCELERATION_M_S2 * time_s**2
        if left_s < self.ramp_s:
            return self.length_m - 0.5 * ACCELERATION_M_S2 * left_s**2
        return self.ramp_m + (time_s - self.ramp_s) * self.speed_m_s
