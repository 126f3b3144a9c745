"""What the tests share: the command line of this repository, and a record that is made once."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import fieldgap as fg

REPOSITORY = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def repository():
    return REPOSITORY


@pytest.fixture(scope="session")
def command_line():
    """Runs `fieldgap` with arguments; gives its standard output."""
    program = Path(os.environ.get("FIELDGAP", REPOSITORY / "target/release/fieldgap"))
    if not program.exists():
        pytest.fail(f"there is no {program}: run `cargo build --release`, or name the program in the variable FIELDGAP")

    def run(*arguments):
        done = subprocess.run([program, *map(str, arguments)], cwd=REPOSITORY, stdin=subprocess.DEVNULL, capture_output=True)
        assert done.returncode == 0, done.stderr.decode()
        return done.stdout.decode()

    return run


@pytest.fixture(scope="session")
def folder(command_line, tmp_path_factory):
    """The folder of a scan that the virtual rig made."""
    folder = tmp_path_factory.mktemp("scan") / "quick-look"
    command_line("scan", "scans/quick-look.toml", "--out", folder)
    return folder


@pytest.fixture(scope="session")
def warm_record():
    """Readings of three planes in air that is warmer than believed."""
    array = fg.Array.square(6, 6, pitch=10.5e-3)
    focus = (5e-3, 0.0, 0.1)
    distances = np.linalg.norm(array.positions - np.array(focus), axis=1)
    believed, true = 343.0, 348.0
    phases = -2 * np.pi * 40e3 / believed * distances
    points = np.stack([fg.plane(z, size=0.048, step=2e-3) for z in (0.08, 0.1, 0.12)]).reshape(-1, 3)
    field = fg.simulate(array, points, drive=np.exp(1j * phases), medium=fg.Medium(speed_of_sound=true))
    random = np.random.default_rng(1)
    level = np.abs(field) / np.abs(field).max()
    noise = 2e-3 * random.standard_normal((2, level.size))
    readings = np.abs(np.hypot(level + noise[0], noise[1]) * (1 + 0.02 * random.standard_normal(level.size)))
    dark = np.hypot(*(2e-3 * random.standard_normal((2, 32))))
    return fg.Record.from_arrays(
        array,
        np.concatenate([np.tile([0.0, 0.0, 0.1], (32, 1)), points]),
        np.concatenate([dark, readings]),
        focus=focus,
        drives=np.concatenate([np.full(32, -1), np.zeros(level.size, dtype=int)]),
        times=0.1 * np.arange(32 + level.size),
        medium=fg.Medium(speed_of_sound=believed),
        name="warm-air",
    )


@pytest.fixture(scope="session")
def json_of(command_line):
    """The JSON that a command prints."""
    return lambda *arguments: json.loads(command_line(*arguments, "--json"))
