"""Wrong arguments are errors that say what is wanted."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import fieldgap as fg

ARRAY = fg.Array.square(2, 2, pitch=10e-3)
POINT = [[0.0, 0.0, 0.1]]


@pytest.mark.parametrize(
    "call, said",
    [
        (lambda: fg.Array.square(6, 6, pitch=10.5), None),
        (lambda: fg.Array.square(6, 6, pitch=105.0), "in metres"),
        (lambda: fg.Array.square(0, 6, pitch=1e-2), "at least one element"),
        (lambda: fg.Array.square(10**9, 10**9, pitch=1e-2), "at most 10000 elements"),
        (lambda: fg.Array.hexagonal(10**9, pitch=1e-2), "at most 10000 elements"),
        (lambda: fg.Array.from_positions([[0, 0]]), "(N, 3)"),
        (lambda: fg.Array.from_positions([[0, 0, np.nan]]), "positions[0]"),
        (lambda: fg.Array.from_positions([[0, 0, 0]], [[0, 0, 0]]), "no direction"),
        (lambda: fg.Array.from_positions([[0, 0, 0]], amplitudes=[-1]), "0 or above"),
        (lambda: fg.Array.from_positions([[0, 0, 0]], phases=[0, 0]), "1 are needed"),
        (lambda: fg.Medium(), "temperature_c"),
        (lambda: fg.Medium(temperature_c=20, humidity=50), "0 to 1"),
        (lambda: fg.Medium(temperature_c=20, pressure=101.325), "60e3"),
        (lambda: fg.Medium(speed_of_sound=343e3), "100 to 2000"),
        (lambda: fg.Medium(speed_of_sound=343, temperature_c=20), "not both"),
        (lambda: fg.Medium(speed_of_sound=343).attenuation(), "temperature_c"),
        (lambda: fg.Transducer.gaussian(-1.0), "radians"),
        (lambda: fg.Transducer.table([0, 60], [1, 1]), "between 0° and 90°"),
        (lambda: fg.Transducer.piston(exponent=-1), "spherical"),
        (lambda: fg.simulate(ARRAY, [[0, 0]]), "last axis"),
        (lambda: fg.simulate(ARRAY, 0.1), "last axis"),
        (lambda: fg.simulate(ARRAY, [[0, 0, np.nan]]), "point 0"),
        (lambda: fg.simulate(ARRAY, np.array(POINT) * 1e3), "in metres"),
        (lambda: fg.simulate(ARRAY, fg.plane(100.0, size=0.1, step=1e-3)), "point 0"),
        (lambda: fg.simulate(ARRAY, POINT, focus=(0, 0, 150)), "in metres"),
        (lambda: fg.simulate(ARRAY, POINT, focus=(0, 0)), "x, y and z"),
        (lambda: fg.simulate(ARRAY, POINT, focus=(0, 0, 0.1), drive=np.ones(4)), "not both"),
        (lambda: fg.simulate(ARRAY, POINT, drive=np.ones(3)), "4 elements"),
        (lambda: fg.simulate(ARRAY, POINT, drive=[1, 1, 1, np.inf]), "drive[3]"),
        (lambda: fg.simulate(ARRAY, POINT, frequency=40), "in Hz"),
        (lambda: fg.simulate(ARRAY, POINT, transducer="trumpet"), "no simulator `trumpet`"),
        (lambda: fg.simulate(ARRAY, POINT, method="fast"), "direct"),
        (lambda: fg.simulate(ARRAY, POINT, attenuation=-1), "Np/m"),
        (lambda: fg.simulate(ARRAY, POINT, threads=0), "from 1"),
        (lambda: fg.plane(0.1, step=0.0), "above zero"),
        (lambda: fg.plane(0.1, size=100.0, step=1e-3), "1e8"),
    ],
)
def test_a_wrong_argument_is_named(call, said):
    if said is None:
        call()
        return
    with pytest.raises(fg.ArgumentError) as raised:
        call()
    assert said in str(raised.value)
    assert isinstance(raised.value, ValueError) and isinstance(raised.value, fg.FieldgapError)


def test_another_type_is_a_type_error():
    with pytest.raises(TypeError):
        fg.simulate("array", POINT)
    with pytest.raises(TypeError):
        fg.simulate(ARRAY, POINT, medium=343.0)


def test_arrays_are_opened_from_rig_files_plans_and_records(repository, folder):
    rig = fg.Array.open(repository / "rigs/virtual.toml")
    plan = fg.Array.open(str(repository / "scans/quick-look.toml"))
    record = fg.Array.open(folder / "scan.toml")
    assert len(rig) == 36 and rig.frequency == 40e3
    assert np.array_equal(rig.positions, plan.positions) and np.array_equal(rig.positions, record.positions)
    assert rig.medium == plan.medium
    assert fg.Array.square(6, 6, pitch=10.5e-3).frequency is None
    # What the file says is what a field is computed with.
    own, given = (fg.simulate(rig, POINT, medium=medium) for medium in (None, rig.medium))
    other = fg.simulate(rig, POINT, medium=fg.Medium(speed_of_sound=350))
    assert np.array_equal(own, given) and not np.array_equal(own, other)


def test_a_transducer_file_is_opened(repository):
    files = sorted((repository / "rigs/transducers").glob("*.toml"))
    assert files
    for file in files:
        assert np.isfinite(fg.simulate(ARRAY, POINT, transducer=fg.Transducer.open(file))).all()


def test_a_fault_of_a_file_has_its_line(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text("[array]\nfrequency_hz = 40.0\n")
    with pytest.raises(fg.FileError) as raised:
        fg.Array.open(path)
    error = raised.value
    assert (error.path, error.line) == (path, 2)
    assert "40 is not a frequency" in error.problem and str(error).startswith(f"{path}:2:")
    assert error.remedy and error.remedy in str(error)
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.path, again.line) == (str(error), path, 2)


def test_a_missing_file_and_a_plan_without_a_rig_are_faults(tmp_path):
    with pytest.raises(fg.FileError, match="cannot be read"):
        fg.Array.open(tmp_path / "none.toml")
    with pytest.raises(fg.FileError, match="scan.toml"):
        fg.open(tmp_path)
    plan = tmp_path / "plan.toml"
    plan.write_text(
        'name = "p"\n[simulator]\nmodel = "piston"\n[[focus]]\nphases = "all-zero"\n'
        "[[plane]]\nz_mm = 100.0\ncentre_mm = [0.0, 0.0]\nsize_mm = [10.0, 10.0]\nstep_mm = 5.0\n"
    )
    with pytest.raises(fg.FileError, match="names no rig file"):
        fg.Array.open(plan)


def test_elements_are_where_they_should_be():
    array = fg.Array.square(6, 6, pitch=10.5e-3)
    assert np.allclose(array.positions[0], [-26.25e-3, 26.25e-3, 0])
    assert np.allclose(array.positions[1] - array.positions[0], [10.5e-3, 0, 0])
    assert len(fg.Array.hexagonal(2, pitch=1e-2)) == 19 and len(fg.Array.linear(5, pitch=1e-2)) == 5
    assert len(fg.Array.random(10, pitch=1e-2, seed=3)) == 10
    assert np.array_equal(fg.Array.square(1, 1, pitch=1e-2, face_radius=3e-3).face_radii, [3e-3])


def test_a_plane_is_centred_and_its_rows_run_along_y():
    points = fg.plane(0.1, size=(0.02, 0.01), step=1e-3, centre=(1e-3, 2e-3))
    assert points.shape == (11, 21, 3)
    assert np.allclose(points.mean(axis=(0, 1)), [1e-3, 2e-3, 0.1])
    assert np.allclose(points[0, 1] - points[0, 0], [1e-3, 0, 0])


def test_the_types_are_stated():
    package = Path(fg.__file__).parent
    assert (package / "py.typed").exists() and (package / "_native.pyi").exists()
    for name in fg.__all__:
        assert getattr(fg, name).__doc__, name
