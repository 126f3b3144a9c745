"""The set of scans whose field is levitate's: beside fieldgap's own simulation, and from its making to its score."""

import importlib
import subprocess
import sys

import numpy as np
import pytest

import fieldgap as fg

pytest.importorskip("levitate", reason="levitate is not installed")


@pytest.fixture(scope="module")
def levitate_set(repository):
    """The modules of the program that makes the set."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(repository / "python/outside/levitate_set")
        yield {name: importlib.import_module(name) for name in ("laboratory", "truth")}


def laboratory(levitate_set, layout):
    """The first laboratory with this layout."""
    drawn = (levitate_set["laboratory"].Laboratory(np.random.default_rng([1, number])) for number in range(100))
    return next(lab for lab in drawn if lab.layout["layout"] == layout and lab.places_m.shape[1] < 50)


@pytest.mark.filterwarnings("ignore:Material `Air` with modified properties")
@pytest.mark.parametrize("layout", ["square", "hexagonal"])
def test_both_expect_the_same_field_of_the_set_up_as_believed(levitate_set, layout):
    lab = laboratory(levitate_set, layout)
    if layout == "square":
        array = fg.Array.square(6, 6, pitch=lab.pitch_m)
    else:
        array = fg.Array.hexagonal(3, pitch=lab.pitch_m)
    assert np.allclose(array.positions, lab.places_m.T)
    levels = np.abs(levitate_set["truth"].Truth(lab).pressures())
    for focus, delay_s in enumerate(lab.delays_s()):
        here = lab.focus == focus
        field = fg.simulate(
            array,
            lab.visits_m[:, here].T,
            drive=np.exp(2j * np.pi * 40e3 * delay_s),
            medium=fg.Medium(speed_of_sound=lab.speed_m_s),
            transducer="piston",
        )
        ours = np.abs(field)
        gain = levels[here].max() / ours.max()
        assert np.allclose(gain * ours, levels[here], atol=1e-6 * levels.max())


def test_a_set_is_made_sealed_diagnosed_and_scored(repository, command_line, json_of, tmp_path):
    folder, answers = tmp_path / "set", tmp_path / "answers.json"
    program = repository / "python/outside/levitate_set"
    subprocess.run([sys.executable, program, folder, "--count", "2", "--seed", "3", "--answers", answers], check=True)
    assert command_line("blind", "seal", folder, answers).startswith("commitment ")
    command_line("blind", "run", folder)
    score = json_of("blind", "score", folder)
    assert score["scored"] == 2
    assert all(row["exact"] == row["of"] for row in score["confusion"]), score["confusion"]
