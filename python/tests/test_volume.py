"""Fields over a volume, with their coordinates."""

import numpy as np
import pytest

import fieldgap as fg

ARRAY = fg.Array.square(4, 4, pitch=10.5e-3)
FOCUS = (0.004, 0.0, 0.1)


def volume(**changed):
    return fg.simulate_volume(ARRAY, **{"z": (0.09, 0.105), "size": (0.02, 0.03), "step": 5e-3, "centre": (0.004, 0.001), "focus": FOCUS, **changed})


def test_the_field_is_that_of_the_points():
    got = volume()
    assert got.field.shape == (4, 7, 5) == (got.z.size, got.y.size, got.x.size)
    np.testing.assert_allclose(got.z, [0.09, 0.095, 0.1, 0.105])
    np.testing.assert_allclose(got.x, 0.004 + 5e-3 * np.arange(-2, 3))
    np.testing.assert_allclose(got.y[[0, -1]], [0.001 - 0.015, 0.001 + 0.015])
    z, y, x = np.meshgrid(got.z, got.y, got.x, indexing="ij")
    expected = fg.simulate(ARRAY, np.stack([x, y, z], axis=-1), focus=FOCUS, method="direct")
    np.testing.assert_allclose(got.field, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(got.magnitude, np.abs(expected) / np.sqrt(2), rtol=1e-6)


def test_a_volume_becomes_xarray_with_coordinates_and_units():
    pytest.importorskip("xarray")
    data = volume().to_xarray()
    assert data["field"].dims == ("z", "y", "x")
    assert {data[axis].attrs["units"] for axis in "xyz"} == {"m"}
    assert "units" not in data["field"].attrs
    peak = data["magnitude"].sel(z=0.1, method="nearest").argmax(...)
    assert float(data.x[peak["x"]]) == pytest.approx(0.004)
    in_pascals = volume(focus=None, drive=np.full(16, 2.0)).to_xarray()
    assert in_pascals["field"].attrs["units"] == in_pascals["magnitude"].attrs["units"] == "Pa"


@pytest.mark.parametrize(
    "changed, words",
    [
        ({"z": (0.1, 0.05)}, "lowest, highest"),
        ({"step": 0.0}, "step above zero"),
        ({"size": float("nan")}, "finite"),
        ({"size": 5.0, "step": 1e-4}, "at most 1e8"),
        ({"focus": (0.0, 0.1)}, "focus has 2 numbers"),
    ],
)
def test_wrong_arguments_are_told(changed, words):
    with pytest.raises(fg.ArgumentError, match=words):
        volume(**changed)
