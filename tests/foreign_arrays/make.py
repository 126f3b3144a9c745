"""Writes the files of this folder: one field of 5 x 4 x 2 points in the formats of other programs. Run in this folder."""

import h5py
import netCDF4
import numpy
import scipy.io

x, y, z = numpy.arange(5) * 2.0 - 4, numpy.arange(4) * 3.0 - 6, numpy.array([80.0, 100.0])
at_z, at_y, at_x = numpy.meshgrid(z, y, x, indexing="ij")
# Amplitudes that tell every point from every other.
amplitude = numpy.round(0.1 + (at_x + 4) / 100 + (at_y + 6) / 1000 + (at_z - 80) / 10, 6)
field = amplitude * numpy.exp(1j * at_x)
points = numpy.column_stack([at_x.ravel(), at_y.ravel(), at_z.ravel(), amplitude.ravel()])

# MATLAB: rows are y, columns x, pages z. Text and structures stand beside the numbers.
of_matlab = field.transpose(1, 2, 0)
scipy.io.savemat("matlab-5.mat", {"note": "a text", "about": {"by": "scipy", "n": 3}, "x": x, "y": y, "z": z, "p": of_matlab}, do_compression=True)
scipy.io.savemat("matlab-5-plain.mat", {"data": points})
with h5py.File("matlab-7.3.mat", "w", userblock_size=512) as file:
    for name, values in {"x": x[None], "y": y[None], "z": z[None], "p": numpy.abs(of_matlab)}.items():
        file.create_dataset(name, data=values.T).attrs["MATLAB_class"] = numpy.bytes_("double")
with open("matlab-7.3.mat", "r+b") as file:
    file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")

numpy.save("points.npy", numpy.asfortranarray(points))
numpy.savez_compressed("grid.npz", x=x, y=y, z=z, p=field.astype("complex64"), words=numpy.array(["a", "b"]))

with h5py.File("h5py.h5", "w") as file:
    file.attrs["made"] = "by h5py"
    scan = file.create_group("scan")
    for name, values in {"x": x, "y": y, "z": z}.items():
        scan.create_dataset(name, data=values / 1e3).attrs["units"] = "m"
    scan.create_dataset("p", data=field, chunks=(1, 4, 5), compression="gzip", shuffle=True).attrs["units"] = "V"
    scan.create_dataset("words", data=["a", "b"])

# Axes of equal length, which only the names of the dimensions tell apart.
with netCDF4.Dataset("netcdf-4-square.nc", "w") as file:
    for axis, values in {"y": y, "x": x[:4], "z": z}.items():
        file.createDimension(axis, len(values))
        file.createVariable(axis, "f8", (axis,))[:] = values
    file.createVariable("p", "f8", ("x", "z", "y"))[:] = amplitude[:, :, :4].transpose(2, 0, 1)

for name, kind, ends in (("netcdf-3.nc", "NETCDF3_CLASSIC", True), ("netcdf-5.nc", "NETCDF3_64BIT_DATA", False), ("netcdf-4.nc", "NETCDF4", True)):
    with netCDF4.Dataset(name, "w", format=kind) as file:
        for axis, values in {"z": z, "y": y, "x": x}.items():
            file.createDimension(axis, None if axis == "z" and ends else len(values))
            variable = file.createVariable(axis, "f8", (axis,))
            variable.units, variable[:] = "mm", values
        # Packed into two bytes, as many archives are.
        p = file.createVariable("p", "i2", ("z", "y", "x"), fill_value=-1)
        p.scale_factor, p.units = 1e-3, "V"
        p[:] = numpy.ma.masked_equal(amplitude, amplitude[0, 0, 1])
