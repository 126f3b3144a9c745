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
        yield {name: importlib.import_module(name) for name in ("causes", "laboratory", "truth", "varied")}


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


def varied(levitate_set, scan):
    """The first small laboratory that scans so."""
    drawn = (levitate_set["varied"].VariedLaboratory(np.random.default_rng([2, number])) for number in range(200))
    return next(lab for lab in drawn if lab.scan == scan and lab.places_m.shape[1] == 36)


@pytest.mark.filterwarnings("ignore:Material `Air` with modified properties")
def test_both_expect_the_same_of_drives_of_random_phases(levitate_set):
    lab = varied(levitate_set, "coded")
    levels = np.abs(levitate_set["truth"].Truth(lab).pressures())
    array, medium = fg.Array.square(6, 6, pitch=lab.pitch_m), fg.Medium(speed_of_sound=lab.speed_m_s)
    ours = np.empty_like(levels)
    for number, phases_rad in enumerate(lab.phases_rad):
        here = lab.focus == number
        field = fg.simulate(
            array, lab.visits_m[:, here].T, drive=np.exp(1j * phases_rad), medium=medium, transducer="piston"
        )
        ours[here] = np.abs(field)
    assert np.allclose(ours * levels.max() / ours.max(), levels, atol=1e-6 * levels.max())


@pytest.mark.filterwarnings("ignore:Material `Air` with modified properties")
def test_a_face_that_moves_as_one_radiates_as_a_piston_and_another_does_not(levitate_set):
    lab = varied(levitate_set, "volume")
    piston, face, still_at_its_rim = (levitate_set["truth"].Truth(lab) for _ in range(3))
    face.falls_by, still_at_its_rim.falls_by = 0.0, 1.0
    expected = np.abs(piston.pressures())
    apart = [np.abs(np.abs(truth.pressures()) - expected).max() for truth in (face, still_at_its_rim)]
    # The far field of a piston lacks the curvature of its waves: a²/λz of a phase.
    assert apart[0] < 0.01 * expected.max() < 0.03 * expected.max() < apart[1]


def test_a_flight_is_at_its_samples_when_they_are_taken(levitate_set):
    lab = varied(levitate_set, "flown")
    assert np.allclose(lab.later_m(0.0), 0.0, atol=1e-9)
    # In the middle of a row the speed is steady.
    trailing_m = np.abs(lab.later_m(0.01))
    assert trailing_m.max() <= 0.01 * 0.08 + 1e-9
    assert (np.diff(lab.time_s) > 0).all()
    flight = levitate_set["varied"].Flight(0.05, 0.04)
    places_m = np.linspace(0, 0.05, 101)
    assert np.allclose([flight.place_at(time_s) for time_s in flight.time_at(places_m)], places_m, atol=1e-9)


def test_a_nozzle_with_play_stands_after_a_turn_and_then_trails(levitate_set):
    lab = varied(levitate_set, "flown")
    truth = levitate_set["truth"].Truth(lab)
    levitate_set["causes"].trailed(truth, 3.0)
    x_mm, nozzle_mm = 1e3 * lab.visits_m[0], 1e3 * truth.visits_m[0]
    directions, flights = lab.along
    since_turn_mm = np.abs(x_mm - [1e3 * start_m for _, _, start_m in flights])
    expected_mm = x_mm + directions * (1.5 - np.minimum(since_turn_mm, 3.0))
    # Before the first row it came from below.
    assert np.allclose(nozzle_mm[x_mm.argmax() + 1 :], expected_mm[x_mm.argmax() + 1 :], atol=1e-9)
    assert nozzle_mm[0] == pytest.approx(x_mm[0] - 1.5)


@pytest.mark.parametrize("is_varied", [False, True])
def test_a_set_is_made_sealed_diagnosed_and_scored(is_varied, repository, command_line, json_of, tmp_path):
    folder, answers = tmp_path / "set", tmp_path / "answers.json"
    program = repository / "python/outside/levitate_set"
    options = ["--count", "2", "--seed", "3", "--answers", answers, *(["--varied"] if is_varied else [])]
    subprocess.run([sys.executable, program, folder, *options], check=True)
    assert command_line("blind", "seal", folder, answers).startswith("commitment ")
    command_line("blind", "run", folder)
    score = json_of("blind", "score", folder)
    assert score["scored"] == 2
    assert all(row["exact"] == row["of"] for row in score["confusion"]), score["confusion"]
