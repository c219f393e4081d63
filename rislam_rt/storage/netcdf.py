"""NetCDF files: encoding of named arrays with dimensions, units and meanings, writing whole or not at all, reading."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rislam_rt.errors import StoreError
from rislam_rt.storage.files import write_atomic

if TYPE_CHECKING:
    import xarray as xr

Entry = tuple[tuple[str, ...], str, str]
"""Dimensions, unit and meaning of a NetCDF variable."""


def variables(values: Mapping[str, Any], table: Mapping[str, Entry], prefix: str = "") -> dict[str, Any]:
    """NetCDF variables from arrays by name, with dimensions, units and meanings of `table` as attributes.

    Complex arrays become two variables, `_real` and `_imag`. `prefix` is put before all names and dimensions but xyz.
    """
    content: dict[str, Any] = {}
    for name, value in values.items():
        dims, unit, meaning = table[name]
        dims = tuple(prefix + d if prefix and not d.startswith("xyz") else d for d in dims)
        parts = [("", value)]
        if np.iscomplexobj(value):
            parts = [("_real", np.real(value)), ("_imag", np.imag(value))]
        for suffix, part in parts:
            content[prefix + name + suffix] = (dims, part, {"units": unit, "long_name": meaning})
    return content


def padded(rows: Sequence[Any], fill: Any, dtype: Any = None) -> Any:
    """Stack arrays (M_k, ...) of K cycles in one (K, max M, ...) for a NetCDF variable, filled up; type of the first
    unless given."""
    longest = max((len(row) for row in rows), default=0)
    table = np.full((len(rows), longest, *rows[0].shape[1:]), fill, dtype=dtype or rows[0].dtype)
    for cycle, row in enumerate(rows):
        table[cycle, : len(row)] = row
    return table


def write_dataset(data: "xr.Dataset", path: Path) -> None:
    """Write a data set as a NetCDF file, whole or not at all.

    Raises
    ------
    StoreError
        The disk refused.
    """
    write_atomic(path, dataset_bytes(data))


def dataset_bytes(data: "xr.Dataset") -> bytes:
    """Encode a data set as the content of a NetCDF file, large variables compressed."""
    squeeze = {"zlib": True, "complevel": 1}
    packed = {name: squeeze for name, value in data.data_vars.items() if value.size > 1000}
    return bytes(data.to_netcdf(engine="h5netcdf", encoding=packed))


def read_dataset(
    path: Path, *, missing: str = "give the folder of a completed run", damaged: str = "run again"
) -> "xr.Dataset":
    """Read a NetCDF file into memory.

    Parameters
    ----------
    missing, damaged
        Advice in the error message for a file that does not exist, or cannot be read.

    Raises
    ------
    StoreError
        The file does not exist, or cannot be read.
    """
    try:
        return _load(path)
    except FileNotFoundError:
        raise StoreError(f"{path}: no such file; {missing}") from None
    except Exception as error:  # the HDF5 library raises nearly anything on a damaged file
        raise StoreError(f"{path}: not a readable NetCDF file ({type(error).__name__}); {damaged}") from None


def _load(path: Path) -> "xr.Dataset":
    """Read a NetCDF file with every HDF5 object opened once: h5netcdf opens a variable anew each time that it asks for
    its shape, type or storage, which is most of the time that a small file takes."""
    import h5netcdf
    import h5py
    import xarray as xr
    from xarray.backends import H5NetCDFStore

    class OpenedOnce(h5py.File):  # type: ignore[misc]
        opened: dict[Any, Any]

        def __getitem__(self, name: Any) -> Any:
            if not isinstance(name, str):
                return super().__getitem__(name)
            if name not in self.opened:
                self.opened[name] = super().__getitem__(name)
            return self.opened[name]

    with OpenedOnce(path, "r") as file:
        file.opened = {}
        return xr.load_dataset(H5NetCDFStore(h5netcdf.File(file, "r", decode_vlen_strings=True, phony_dims="access")))
