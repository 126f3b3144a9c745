"""Reads an export with the libraries that people use, and compares it with the record.

Usage: export_round_trip.py SAMPLES_CSV EXPORT...
Each line of the output names a file and the library that read it; an assertion ends the program otherwise.
"""

import csv
import json
import sys

import h5py
import netCDF4
import numpy
import scipy.io
import xarray

COLUMNS = {"time": "time_s", "drive": "focus", "x": "x_mm", "y": "y_mm", "z": "z_mm", "reading": "reading"}
UNITS = {"time": "s", "x": "mm", "y": "mm", "z": "mm", "reading": "V"}


def record(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: numpy.array([float(row[column]) for row in rows]) for name, column in COLUMNS.items()}


def check(samples, get, source):
    for name, values in samples.items():
        numpy.testing.assert_array_equal(numpy.asarray(get(name), dtype=float).ravel(), values, err_msg=name)
    driven = samples["drive"] >= 0
    simulation = numpy.asarray(get("simulation")).ravel()
    difference = numpy.asarray(get("difference")).ravel()
    assert numpy.isfinite(simulation[driven]).all() and numpy.isnan(simulation[~driven]).all()
    numpy.testing.assert_array_equal(difference[driven], samples["reading"][driven] - simulation[driven])
    print(source)


def check_grid(samples, x, y, z, reading):
    """Every driven reading is at its place in the grid of z, y, x."""
    reading = numpy.asarray(reading)
    assert reading.shape == (len(z), len(y), len(x)), reading.shape
    for i in numpy.flatnonzero(samples["drive"] == 0):
        at = [int(numpy.argmin(abs(numpy.asarray(axis) - samples[name][i]))) for axis, name in ((z, "z"), (y, "y"), (x, "x"))]
        same = (samples["drive"] == 0) & numpy.all([samples[n] == samples[n][i] for n in "xyz"], axis=0)
        assert abs(reading[tuple(at)] - samples["reading"][same].mean()) < 1e-12


def netcdf(path, samples):
    with xarray.open_dataset(path) as data:
        check(samples, lambda name: data[name].values, f"{path}: xarray")
        for name, unit in UNITS.items():
            assert data[name].attrs["units"] == unit, name
        assert data["reading"].dims == ("point",) and {"x", "y", "z", "time"} <= set(data.coords)
        assert data["grid_reading"].dims == ("grid_z", "grid_y", "grid_x")
        check_grid(samples, data.grid_x, data.grid_y, data.grid_z, data.grid_reading)
        assert data.attrs["scan_toml"].startswith("format = 1") and data.attrs["frequency_hz"] == 40000.0
        assert data["phase"].dims == ("drive_number", "element")
        peak = data.grid_reading.isel(grid_z=0).argmax(...)
        assert data.grid_x[peak["grid_x"]].attrs["units"] == "mm"
    with xarray.open_dataset(path, engine="scipy") as data:
        check(samples, lambda name: data[name].values, f"{path}: xarray with scipy")
    with netCDF4.Dataset(path) as data:
        check(samples, lambda name: data[name][:].filled(numpy.nan), f"{path}: netCDF4")


def hdf5(path, samples):
    with h5py.File(path) as data:
        check(samples, lambda name: data[name][()], f"{path}: h5py")
        for name, unit in UNITS.items():
            assert data[name].attrs["units"] == unit, name
        assert [dim.label for dim in data["grid_reading"].dims] == ["grid_z", "grid_y", "grid_x"]
        assert [dim.label for dim in data["grid_x"].dims] == ["grid_x"]
        check_grid(samples, data["grid_x"][:], data["grid_y"][:], data["grid_z"][:], data["grid_reading"][:])
        assert data.attrs["scan_toml"].startswith("format = 1")


def matlab(path, samples):
    data = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False)
    check(samples, lambda name: data[name], f"{path}: scipy")
    for name, unit in UNITS.items():
        assert getattr(data["units"], name) == unit, name
    assert data["dimensions"].grid_reading == "grid_y, grid_x, grid_z"
    whole = scipy.io.loadmat(path)
    assert whole["reading"].shape == (len(samples["reading"]), 1)
    grid = numpy.atleast_3d(whole["grid_reading"]).transpose(2, 0, 1)
    check_grid(samples, *(whole[f"grid_{axis}"].ravel() for axis in "xyz"), grid)
    assert data["info"].scan_toml.startswith("format = 1")


def archive(path, samples):
    with numpy.load(path) as data:
        check(samples, lambda name: data[name], f"{path}: numpy")
        check_grid(samples, data["grid_x"], data["grid_y"], data["grid_z"], data["grid_reading"])
        about = json.loads(data["metadata"].item())
        assert about["variables"]["grid_reading"]["dimensions"] == ["grid_z", "grid_y", "grid_x"]
        assert about["attributes"]["scan_toml"].startswith("format = 1")


def text(path, samples):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    names = {name.rsplit("_", 1)[0]: name for name in rows[0]}
    cell = lambda text: float(text) if text else numpy.nan
    check(samples, lambda name: [cell(row[names[name]]) for row in rows], f"{path}: csv")


def grids(path, samples):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    first = {name: numpy.array([float(row[name] or "nan") for row in rows if row["grid"] == "1"]) for name in rows[0]}
    axes = [numpy.unique(first[f"{name}_mm"]) for name in "zyx"]
    shape = tuple(len(axis) for axis in axes)
    for values, name in zip(numpy.meshgrid(*axes, indexing="ij"), "zyx"):
        numpy.testing.assert_array_equal(first[f"{name}_mm"], values.ravel(), err_msg="z, y and x, the last fastest")
    check_grid(samples, *reversed(axes), first["reading_V"].reshape(shape))
    numpy.testing.assert_allclose(first["difference_V"], first["reading_V"] - first["simulation_V"], atol=1e-12)
    assert set(first["drive"]) == {0.0}
    print(f"{path}: csv of grids")


READERS = {"nc": netcdf, "h5": hdf5, "mat": matlab, "npz": archive, "csv": text}

if __name__ == "__main__":
    written = record(sys.argv[1])
    for export in sys.argv[2:]:
        reader = grids if export.endswith("grids.csv") else READERS[export.rsplit(".", 1)[1]]
        reader(export, written)
