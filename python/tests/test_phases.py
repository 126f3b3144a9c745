"""Records of readings with a phase: complex arrays, beside the files and the command line."""

import numpy as np
import pytest

import fieldgap as fg
from test_records import alike


@pytest.fixture(scope="module")
def iq_folder(command_line, tmp_path_factory):
    """The folder of a scan by a virtual receiver that gives both parts of each sample."""
    folder = tmp_path_factory.mktemp("scan") / "phase"
    command_line("scan", "scans/quick-look.toml", "--rig", "rigs/virtual-iq.toml", "--out", folder)
    return folder


@pytest.fixture(scope="module")
def array():
    return fg.Array.square(4, 4, pitch=10.5e-3)


@pytest.fixture(scope="module")
def points():
    return fg.plane(0.1, size=0.04, step=4e-3).reshape(-1, 3)


@pytest.fixture(scope="module")
def field(array, points):
    return fg.simulate(array, points, focus=(0, 0, 0.1))


def test_phases_are_those_of_the_file(iq_folder):
    record = fg.open(iq_folder)
    rows = np.genfromtxt(iq_folder / "samples.csv", delimiter=",", names=True)
    phase = record.setup.phase
    assert isinstance(phase, fg.Phase) and phase.reference == "drive-sync" and phase.drift > 0
    sign = {"exp(-iwt)": 1, "exp(+iwt)": -1}[phase.convention]
    assert np.array_equal(record.reading_phases, sign * rows["phase_rad"], equal_nan=True)
    assert record.phasors.dtype == complex
    assert np.allclose(record.phasors, rows["reading"] * np.exp(1j * sign * rows["phase_rad"]), rtol=1e-12, equal_nan=True)


def test_phasors_are_the_simulated_field_but_for_a_constant(iq_folder):
    record = fg.open(iq_folder)
    setup, driven = record.setup, record.drives == 0
    field = fg.simulate(setup.array, record.positions[driven], focus=setup.foci[0], transducer="piston")
    phasors = record.phasors[driven]
    known = ~np.isnan(phasors)
    correlation = abs(np.vdot(field[known], phasors[known])) / np.linalg.norm(field[known]) / np.linalg.norm(phasors[known])
    assert correlation > 0.97
    # In the other convention the field would agree with no constant.
    other = abs(np.vdot(field[known], phasors[known].conj())) / np.linalg.norm(field[known]) / np.linalg.norm(phasors[known])
    assert other < 0.8


def test_complex_maps_hold_the_phasors_at_their_places(iq_folder):
    record = fg.open(iq_folder)
    (one,), (magnitudes,) = record.phasor_maps(), record.maps()
    assert one.values.dtype == complex and one.values.shape == magnitudes.values.shape
    at = (np.abs(one.y - record.positions[:, 1:2]).argmin(axis=1), np.abs(one.x - record.positions[:, :1]).argmin(axis=1))
    driven = record.drives == 0
    counts = np.zeros(one.values.shape, dtype=int)
    np.add.at(counts, (at[0][driven], at[1][driven]), 1)
    once = driven & (counts[at] == 1)
    assert once.sum() > 100 and np.allclose(one.values[at][once], record.phasors[once])
    # Repeats are averaged as complex numbers: the amplitude of the mean is no larger than the mean amplitude.
    assert (np.abs(one.values) <= magnitudes.values * (1 + 1e-9)).all()


def test_complex_readings_make_a_record_with_phases(array, points, field, tmp_path):
    record = fg.Record.from_arrays(array, points, field * np.exp(0.7j), focus=(0, 0, 0.1), reference="each-drive", drift=0.02)
    assert record.setup.phase == fg.Phase("each-drive", "exp(-iwt)", 0.02)
    assert np.allclose(record.phasors, field * np.exp(0.7j), rtol=1e-12)
    record.write(tmp_path / "complex")
    assert np.allclose(fg.open(tmp_path / "complex").phasors, record.phasors, rtol=1e-12)
    conjugate = fg.Record.from_arrays(array, points, field.conj(), focus=(0, 0, 0.1), convention="exp(+iwt)")
    assert np.allclose(conjugate.phasors, field, rtol=1e-12) and conjugate.setup.phase.drift == 0.1


@pytest.fixture(scope="module")
def moved(array, points, field):
    """A record whose places are off by 0.4 and -0.3 mm."""
    noise = np.random.default_rng(2).standard_normal((2, len(points))) * 0.01 * np.abs(field).max()
    readings = (field + noise[0] + 1j * noise[1]) * np.exp(2j)
    return fg.Record.from_arrays(array, points - [4e-4, -3e-4, 0.0], readings, focus=(0, 0, 0.1))


def test_phases_place_a_record_and_may_be_left_out(moved, json_of, tmp_path):
    moved.write(tmp_path / "moved")
    both = fg.compare(moved, register="shift")
    amplitudes = fg.compare(moved, register="shift", amplitude_only=True)
    assert alike(both.to_dict(), json_of("compare", tmp_path / "moved", "--register", "shift")[0])
    assert alike(amplitudes.to_dict(), json_of("compare", tmp_path / "moved", "--register", "shift", "--amplitude-only")[0])
    assert both.to_dict()["registration"]["phases"]["known"] == len(moved)
    assert "phases" not in amplitudes.to_dict()["registration"]
    x, y, _ = both.to_dict()["registration"]["shift_m"]
    assert abs(x["value"] - 4e-4) < 4 * x["standard_error"] < 2e-4 and abs(y["value"] + 3e-4) < 4 * y["standard_error"] < 2e-4


def test_a_diagnosis_may_leave_phases_out(moved):
    assert fg.diagnose(moved).to_dict()["phase"]["readings"] > 50
    assert "phase" not in fg.diagnose(moved, amplitude_only=True).to_dict()


def test_phases_in_xarray(iq_folder, folder):
    pytest.importorskip("xarray")
    record = fg.open(iq_folder)
    samples = record.to_xarray()
    assert np.array_equal(samples.phase, record.reading_phases, equal_nan=True)
    assert samples.phase.attrs == {"units": "rad", "reference": "drive-sync", "convention": "exp(-iwt)"}
    assert "phase" not in fg.open(folder).to_xarray()


def test_a_record_without_phases_has_none(folder):
    record = fg.open(folder)
    assert record.setup.phase is None and np.isnan(record.reading_phases).all()
    for call in (lambda: record.phasors, record.phasor_maps):
        with pytest.raises(fg.FieldgapError, match="no phases"):
            call()


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"convention": "exp(iwt)"}, "no convention"),
        ({"reference": "clock"}, "no reference"),
        ({"drift": -0.1}, "drift is -0.1"),
        ({"drift": np.nan}, "drift is"),
        ({"readings": [1.0, complex(np.nan, 0)]}, "[1]"),
        ({"readings": [1j]}, "2 are needed"),
    ],
)
def test_wrong_complex_readings_are_no_record(changes, said):
    given = {"positions": [[0, 0, 0.1], [0, 0, 0.2]], "readings": [1.0, 2.0j], **changes}
    with pytest.raises(fg.ArgumentError) as raised:
        fg.Record.from_arrays(fg.Array.square(2, 2, pitch=1e-2), **given)
    assert said in str(raised.value)
