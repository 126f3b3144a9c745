"""Records, comparisons and diagnoses, beside what the command line prints."""

import math

import numpy as np
import pytest

import fieldgap as fg


def alike(ours, theirs):
    """Whether two JSON values are equal; numbers to the last digits that a text can lose."""
    if isinstance(ours, dict):
        return isinstance(theirs, dict) and ours.keys() == theirs.keys() and all(alike(ours[key], theirs[key]) for key in ours)
    if isinstance(ours, list):
        return isinstance(theirs, list) and len(ours) == len(theirs) and all(map(alike, ours, theirs))
    if isinstance(ours, float) or isinstance(theirs, float):
        return math.isclose(ours, theirs, rel_tol=1e-12)
    return ours == theirs


def test_a_record_has_the_readings_of_its_file(folder):
    record = fg.open(folder)
    rows = np.genfromtxt(folder / "samples.csv", delimiter=",", names=True)
    assert len(record) == len(rows) and record.folder == folder
    assert np.allclose(record.positions, 1e-3 * np.stack([rows["x_mm"], rows["y_mm"], rows["z_mm"]], axis=1), atol=1e-12)
    assert np.array_equal(record.readings, rows["reading"]) and np.array_equal(record.times, rows["time_s"])
    assert np.array_equal(record.drives, rows["focus"].astype(int)) and (record.drives == -1).sum() == 2
    assert np.allclose(record.heights, [0.1])
    setup = record.setup
    assert (setup.name, setup.unit, setup.simulator, setup.frequency) == ("quick-look", "V", "corrected", 40e3)
    assert np.allclose(setup.foci, [(17.5e-3, -22.5e-3, 0.1)]) and setup.recorded.tzinfo is not None
    assert setup.phases.shape == (1, 36) and len(setup.array) == 36


def test_the_phases_of_a_setup_drive_the_same_field(folder):
    setup = fg.open(folder).setup
    points = fg.plane(0.1, size=0.02, step=2e-3)
    by_focus = fg.simulate(setup.array, points, focus=setup.foci[0])
    by_phases = fg.simulate(setup.array, points, drive=np.exp(1j * setup.phases[0]))
    assert np.allclose(by_focus, by_phases, rtol=0, atol=1e-9 * np.abs(by_focus).max())


def test_maps_hold_the_readings_at_their_places(folder):
    record = fg.open(folder)
    (one,) = record.maps()
    assert one.values.shape == (one.y.size, one.x.size) == (13, 13) and one.drive == 0
    for (x, y, _), reading, drive in zip(record.positions, record.readings, record.drives):
        if drive == 0:
            assert one.values[np.abs(one.y - y).argmin(), np.abs(one.x - x).argmin()] == pytest.approx(reading)


def test_readings_as_xarray(folder):
    xarray = pytest.importorskip("xarray")
    record = fg.open(folder)
    samples = record.to_xarray()
    assert isinstance(samples, xarray.Dataset) and samples.sizes == {"sample": len(record)}
    assert np.array_equal(samples.reading, record.readings) and samples.reading.attrs["units"] == "V"
    grid = record.to_xarray(grid=True)
    assert grid.reading.dims == ("drive", "z", "y", "x")
    assert np.array_equal(grid.reading.isel(drive=0, z=0), record.maps()[0].values)
    assert np.array_equal(record.maps()[0].to_xarray(), record.maps()[0].values)


@pytest.mark.parametrize("simulator, register", [(None, "auto"), ("piston", "pose"), ("as-written", "gain")])
def test_a_comparison_equals_that_of_the_command_line(folder, json_of, simulator, register):
    options = ["--register", register] + ([] if simulator is None else ["--simulator", simulator])
    comparison = fg.compare(folder, simulator=simulator, register=register)
    (printed,) = json_of("compare", folder, *options)
    assert alike(comparison.to_dict(), printed)
    (plane,), (of_json,) = comparison.planes, printed["planes"]
    assert plane.height == pytest.approx(of_json["z_m"])
    assert plane.scan.peak.value == pytest.approx(of_json["scan"]["peak"]["value"])
    assert plane.simulation.focal_radius.value == pytest.approx(of_json["simulation"]["focal_radius"]["radius_m"]["value"])
    assert plane.discrepancy.peak_distance.standard_error == pytest.approx(of_json["discrepancy"]["peak_distance_m"]["standard_error"])
    assert np.allclose(plane.map.scan.ravel(), of_json["map"]["scan"])
    assert np.allclose(plane.map.simulation.ravel(), of_json["map"]["simulation"])
    assert np.allclose(plane.map.difference, plane.map.scan - plane.map.simulation)
    assert comparison.gain.value == pytest.approx(printed["registration"]["gain"]["value"])


def test_levels_are_those_of_the_command_line(command_line, json_of, tmp_path):
    command_line("scan", "scans/quick-look.toml", "--rig", "rigs/levels.toml", "--out", tmp_path / "levels")
    comparison = fg.compare(tmp_path / "levels")
    (plane,) = comparison.planes
    (expected,) = json_of("compare", tmp_path / "levels")[0]["levels"]["planes"]
    levels = plane.levels
    assert (levels.scan_db, levels.expanded_db) == (expected["scan"]["level_db"], expected["expanded_db"])
    # The peak of the map on its grid lies below the refined one, by less than half a decibel.
    pressures = plane.map.scan * levels.pa_per_reading
    assert 0 <= levels.scan_db - 20 * np.log10(np.nanmax(pressures) / 20e-6) < 0.5
    (row,) = comparison.table()
    assert (row["scan_peak_pa"], row["scan_peak_expanded_db"]) == (levels.scan_pa, levels.expanded_db)


def test_without_a_sensitivity_there_are_no_levels(folder):
    (plane,) = fg.compare(folder).planes
    assert plane.levels is None and "scan_peak_pa" not in fg.compare(folder).table()[0]


def test_a_comparison_is_shown(folder):
    comparison = fg.compare(fg.open(folder))
    page = comparison._repr_html_()
    assert "quick-look" in page and page.count("<tr>") == 2 and "data:image/png;base64," in page
    assert "quick-look" in str(comparison) and "1 planes" in repr(comparison)
    pandas = pytest.importorskip("pandas")
    table = comparison.to_pandas()
    assert isinstance(table, pandas.DataFrame) and len(table) == 1
    assert table.scan_focal_radius[0] == pytest.approx(comparison.planes[0].scan.focal_radius.value)


def test_names_from_files_are_text_in_a_page(warm_record):
    array = warm_record.setup.array
    record = fg.Record.from_arrays(array, [[0, 0, 0.1]], [1.0], name="<script>alert(1)</script>")
    assert "<script>" not in record._repr_html_() and "&lt;script&gt;" in record._repr_html_()
    points = fg.plane(0.1, size=0.04, step=4e-3).reshape(-1, 3)
    readings = abs(fg.simulate(array, points, focus=(0, 0, 0.1)))
    record = fg.Record.from_arrays(array, points, readings, focus=(0, 0, 0.1), unit="<b>$\\frac", name="&<i>")
    page = fg.compare(record)._repr_html_()
    assert "<i>" not in page and "(<b>" not in page and "data:image/png;base64," in page


def test_pictures_show_scan_simulation_and_difference(warm_record):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    comparison = fg.compare(warm_record)
    figure = comparison.plot()
    images = [axis.images[0].get_array() for axis in figure.axes if axis.images]
    shown = [image for image in images if image.shape == (25, 25)]
    assert len(shown) == 9
    for plane, (scan, simulation, difference) in zip(comparison.planes, zip(*[iter(shown)] * 3)):
        assert np.array_equal(scan, plane.map.scan) and np.array_equal(simulation, plane.map.simulation)
        assert np.array_equal(difference, plane.map.difference)
    matplotlib.pyplot.close(figure)


def test_a_diagnosis_equals_that_of_the_command_line(warm_record, json_of, tmp_path):
    folder = tmp_path / "warm"
    warm_record.write(folder)
    diagnosis = fg.diagnose(fg.open(folder))
    printed = json_of("diagnose", folder)
    assert alike(diagnosis.to_dict(), printed)
    assert diagnosis.verdict == "explained" and diagnosis.effects == ["sound-speed"]
    best, of_json = diagnosis.candidates[0], printed["ranked"][0]
    assert best.probability == diagnosis.probability == pytest.approx(of_json["probability"]) and best.probability > 0.5
    (name,) = [name for name in best.parameters if name.startswith("sound-speed.")]
    parameter = best.parameters[name]
    assert parameter.value == pytest.approx(of_json["parameters"][name]["value"])
    # The truth, 348 m/s, within four standard errors.
    assert abs(parameter.value - 348.0) < 4 * parameter.standard_error < 4.0
    assert diagnosis.gap_after < diagnosis.gap_before and diagnosis.explained_fraction > 0.5
    assert len(diagnosis.maps) == 3 and diagnosis.maps[0].residual_after.shape == (25, 25)
    assert np.nanstd(diagnosis.maps[0].residual_after) < np.nanstd(diagnosis.maps[0].residual_before)
    page = diagnosis._repr_html_()
    assert "sound-speed" in page and "data:image/png;base64," in page
    assert (diagnosis.to_pandas().parameter == name).any()
    assert diagnosis.sentence in " ".join(str(diagnosis).split()) or "sound-speed" in str(diagnosis)
    # Readings from memory and from the folder are the same record.
    assert alike(fg.diagnose(warm_record).to_dict(), printed)


def test_what_a_record_states_to_be_uncertain_is_a_departure_and_no_cause(warm_record, tmp_path):
    folder = tmp_path / "warm"
    warm_record.write(folder)
    assert fg.diagnose(folder).departures == []
    with (folder / "scan.toml").open("a") as scan:
        scan.write("\n[uncertainty]\ntemperature_k = 10.0\n")
    diagnosis = fg.diagnose(folder)
    assert diagnosis.verdict == "none" and "stated" in diagnosis.sentence
    (departure,) = diagnosis.departures
    assert departure.what == "sound-speed" and "m/s" in departure.meaning
    assert 0.3 < departure.in_uncertainties < 2.0


def test_parameters_have_their_kind():
    from fieldgap.diagnosis import _parameter

    real = _parameter("a.b", {"value": 1.5, "standard_error": None})
    assert real.value == 1.5 and math.isnan(real.standard_error)
    complex_one = _parameter("reflection.coefficient", {"value": [0.3, -0.1], "standard_error": [0.02, 0.03]})
    assert complex_one.value == 0.3 - 0.1j and complex_one.standard_error == 0.02 + 0.03j
    each = _parameter("element-gain.departures", {"value": [0.1, 0.2], "standard_error": [0.01, None]})
    assert np.array_equal(each.value, [0.1, 0.2]) and math.isnan(each.standard_error[1])
    assert _parameter("dead.elements", {"value": [3, 4]}).value == [3, 4]


def test_a_record_from_arrays_is_written_and_read(warm_record, tmp_path):
    warm_record.write(tmp_path / "again")
    again = fg.open(tmp_path / "again")
    assert np.allclose(again.positions, warm_record.positions, atol=1e-12)
    for name in ("readings", "times", "drives"):
        assert np.array_equal(getattr(again, name), getattr(warm_record, name))
    assert np.allclose(again.setup.array.positions, warm_record.setup.array.positions)
    assert again.setup.medium == warm_record.setup.medium and again.setup.foci == warm_record.setup.foci
    assert again.setup.layout.startswith("6 x 6 square") and not (tmp_path / "again/elements.csv").exists()
    with pytest.raises(fg.FieldgapError, match="already contains a scan"):
        warm_record.write(tmp_path / "again")


def test_a_record_from_phases_has_them():
    array = fg.Array.square(2, 2, pitch=1e-2)
    phases = np.array([[0.0, 0.1, 0.2, 0.3], [1.0, 1.1, 1.2, 1.3]])
    record = fg.Record.from_arrays(array, np.full((2, 3), 0.1), [1.0, 2.0], phases=phases, drives=[0, 1])
    assert np.allclose(record.setup.phases, phases) and record.setup.foci == [None, None]


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"readings": [1.0]}, "2 are needed"),
        ({"readings": [1.0, -1.0]}, "readings[1]"),
        ({"readings": [1.0, np.nan]}, "readings[1]"),
        ({"drives": [0, 1]}, "drives[1] is 1"),
        ({"drives": [0, -2]}, "drives[1] is -2"),
        ({"drives": [0]}, "2 are needed"),
        ({"times": [0.0, np.inf]}, "times[1]"),
        ({"positions": [[0, 0, 0.1], [0, 0, 100.0]]}, "in metres"),
        ({"focus": (0, 0, 100.0)}, "in metres"),
        ({"focus": (0, 0, 0.1), "phases": np.zeros(4)}, "not both"),
        ({"phases": np.zeros(3)}, "4 elements"),
        ({"simulator": "trumpet"}, "trumpet"),
        ({"name": "a\nb"}, ""),
    ],
)
def test_wrong_arrays_are_no_record(changes, said):
    given = {"positions": [[0, 0, 0.1], [0, 0, 0.2]], "readings": [1.0, 2.0], **changes}
    with pytest.raises(fg.ArgumentError) as raised:
        fg.Record.from_arrays(fg.Array.square(2, 2, pitch=1e-2), **given)
    assert said in str(raised.value)


def test_records_that_cannot_be_compared_are_errors(folder, warm_record):
    array = fg.Array.square(2, 2, pitch=1e-2)
    silent = fg.Record.from_arrays(array, np.full((9, 3), 0.1), np.ones(9), drives=np.full(9, -1))
    for call in (lambda: fg.compare(silent), lambda: fg.diagnose(silent)):
        with pytest.raises(fg.IncomparableError):
            call()
    with pytest.raises(fg.IncomparableError, match="different arrays"):
        fg.diagnose([folder, fg.Record.from_arrays(array, warm_record.positions, warm_record.readings)])
    with pytest.raises(fg.IncomparableError, match="at least one"):
        fg.diagnose([])
    with pytest.raises(fg.ArgumentError, match="no registration"):
        fg.compare(folder, register="by eye")


def test_a_fault_of_a_row_is_that_of_the_command_line(warm_record, tmp_path):
    warm_record.write(tmp_path / "bad")
    samples = tmp_path / "bad/samples.csv"
    lines = samples.read_text().splitlines()
    lines[5] = lines[5].rsplit(",", 1)[0] + ",loud"
    samples.write_text("\n".join(lines) + "\n")
    with pytest.raises(fg.FileError) as raised:
        fg.open(tmp_path / "bad")
    assert raised.value.path == samples and raised.value.line == 6


def test_ctrl_c_ends_a_diagnosis(warm_record, tmp_path):
    from test_field import interrupted

    warm_record.write(tmp_path / "warm")
    assert interrupted(f"record = fg.open({str(tmp_path / 'warm')!r})", "fg.diagnose(record, threads=1)") < 1.0


def test_an_array_of_a_file_keeps_its_transducer_at_another_frequency(repository, tmp_path):
    (tmp_path / "transducers").mkdir()
    transducer = sorted((repository / "rigs/transducers").glob("*.toml"))[0]
    (tmp_path / "transducers" / transducer.name).write_text(transducer.read_text())
    rig = tmp_path / "rig.toml"
    text = (repository / "rigs/virtual.toml").read_text()
    rig.write_text(text.replace("[array]", f'[array]\ntransducer = "{transducer.stem}"', 1))
    array = fg.Array.open(rig)
    points = fg.plane(0.1, size=0.02, step=2e-3).reshape(-1, 3)
    for frequency in (array.frequency, 39.5e3):
        readings = abs(fg.simulate(array, points, focus=(0, 0, 0.1), transducer="transducer", frequency=frequency))
        record = fg.Record.from_arrays(array, points, readings, focus=(0, 0, 0.1), simulator="transducer", frequency=frequency)
        assert record.setup.frequency == frequency
        assert fg.compare(record, register="gain").agreement.residual_rms_ratio < 1e-6
        assert fg.compare(record, simulator="piston", register="gain").agreement.residual_rms_ratio > 1e-4
