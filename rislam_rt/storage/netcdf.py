"""NetCDF files: encoding of named arrays with dimensions, units and meanings, writing whole or not at all, reading."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache, cached_property
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rislam_rt.errors import StoreError
from rislam_rt.storage.files import write_atomic

if TYPE_CHECKING:
    import xarray as xr

Entry = tuple[tuple[str, ...], str, str]
"""Dimensions, unit and meaning of a NetCDF variable."""
NETCDF = (".nc", ".h5", ".hdf5")
"""Suffixes of NetCDF files, which are HDF5."""


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
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    squeeze = {"zlib": True, "complevel": 1}
    packed = {name: squeeze for name, value in data.data_vars.items() if value.size > 1000}
    memory = BytesIO()
    with _opened_once()(memory, "w", track_order=True) as file, h5netcdf.File(file, "w") as content:
        data.dump_to_store(H5NetCDFStore(content), encoding=packed)
    return memory.getvalue()


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
    import h5netcdf
    import xarray as xr
    from xarray.backends import H5NetCDFStore

    try:
        with _opened_once()(path, "r") as file:
            content = h5netcdf.File(file, "r", decode_vlen_strings=True, phony_dims="access")
            return xr.load_dataset(H5NetCDFStore(content))
    except FileNotFoundError:
        raise StoreError(f"{path}: no such file; {missing}") from None
    except Exception as error:  # the HDF5 library raises nearly anything on a damaged file
        raise StoreError(f"{path}: not a readable NetCDF file ({type(error).__name__}); {damaged}") from None


@cache
def _read_once() -> Any:
    """Class of data sets of a file that is only read: attributes, of which h5netcdf asks again and again, and names are
    read once."""
    import h5py

    class AttributesOnce(h5py.AttributeManager):  # type: ignore[misc]
        def __init__(self, parent: Any) -> None:
            super().__init__(parent)
            self.found: dict[str, Any] = {}

        @cached_property
        def names(self) -> tuple[str, ...]:
            return tuple(super().__iter__())

        def __iter__(self) -> Iterator[str]:
            return iter(self.names)

        def __contains__(self, name: object) -> bool:
            return name in self.names

        def __getitem__(self, name: str) -> Any:
            if name not in self.found:
                self.found[name] = super().__getitem__(name)
            return self.found[name]

    class ReadOnce(h5py.Dataset):  # type: ignore[misc]
        __module__ = h5py.Dataset.__module__  # by which h5netcdf knows whose data set it is
        attrs = cached_property(AttributesOnce)
        maxshape = cached_property(h5py.Dataset.maxshape.fget)
        name = cached_property(h5py.Dataset.name.fget)

    return ReadOnce


@cache
def _opened_once() -> Any:
    """Class of HDF5 files in which every object is opened once: h5netcdf opens a variable anew each time that it asks
    for its shape, type or storage, which is most of the time that a small file takes."""
    import h5py

    class OpenedOnce(h5py.File):  # type: ignore[misc]
        def __init__(self, *given: Any, **options: Any) -> None:
            super().__init__(*given, **options)
            self.opened: dict[str, Any] = {}
            self.by_id: dict[Any, Any] = {}
            self.reads = self.mode == "r"

        def __getitem__(self, name: Any) -> Any:
            if not isinstance(name, str):
                of = self.by_id.get(h5py.h5r.dereference(name, self.id)) if self.by_id else None
                return super().__getitem__(name) if of is None else of
            if name == "/":
                return self  # through which h5netcdf deletes
            if (path := "/" + name.lstrip("/")) not in self.opened:
                found = super().__getitem__(path)
                if self.reads and isinstance(found, h5py.Dataset):
                    found = self.by_id[found.id] = _read_once()(found.id, readonly=True)
                self.opened[path] = found
            return self.opened[path]

        def create_dataset(self, name: str, *given: Any, **options: Any) -> Any:
            made = self.opened["/" + name.lstrip("/")] = super().create_dataset(name, *given, **options)
            return made

        def __delitem__(self, name: str) -> None:
            super().__delitem__(name)
            self.opened.pop("/" + name.lstrip("/"), None)

        def close(self) -> None:
            self.opened.clear()
            self.by_id.clear()
            super().close()

    return OpenedOnce
