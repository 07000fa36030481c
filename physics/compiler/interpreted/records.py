"""Records of NumPy arrays with their fields as attributes, as kernels read them.

NumPy has `recarray` for this, but there a field named `shape` is hidden by the shape of the record itself.
"""

from __future__ import annotations

from functools import cache

import numpy as np


class Record:
    """Record of an array: numbers are read and written in the array; array fields are views of it, records records."""

    __slots__ = ("_record", "_views", "dtype")

    def __init__(self, record: np.void):
        self._record, self.dtype = record, record.dtype
        self._views = {name: records_of(record[name]) for name in record.dtype.names if _is_part(record.dtype[name])}


def _is_part(dtype: np.dtype) -> bool:
    """True for the type of an array or of a record, False for that of a number."""
    return bool(dtype.shape or dtype.names)


def _number(name: str) -> property:
    def read(self):
        return self._record[name]

    def write(self, value):
        self._record[name] = value

    return property(read, write)


def _view(name: str) -> property:
    def read(self):
        return self._views[name]

    return property(read)


@cache
def _class_of(dtype: np.dtype) -> type:
    """Class of the records of a type."""
    fields = {name: _view(name) if _is_part(dtype[name]) else _number(name) for name in dtype.names}
    return type("Record", (Record,), {"__slots__": (), **fields})


class RecordArray:
    """A one-dimensional array of records.

    Parameters
    ----------
    array : (n,) structured array
    """

    __slots__ = ("_array", "_kind", "_records", "dtype", "shape")

    def __init__(self, array: np.ndarray):
        self._array, self._kind, self._records = array, _class_of(array.dtype), {}
        self.shape, self.dtype = array.shape, array.dtype

    def __getitem__(self, k) -> Record:
        found = self._records.get(k)
        if found is None:
            found = self._records[k] = self._kind(self._array[k])
        return found

    def __len__(self) -> int:
        return self.shape[0]


def records_of(value):
    """Arguments of a kernel, with `RecordArray` and `Record` for arrays of records, also within tuples."""
    if isinstance(value, np.ndarray):
        return RecordArray(value) if value.dtype.names else value
    if isinstance(value, np.void) and value.dtype.names:
        return _class_of(value.dtype)(value)
    if isinstance(value, tuple):
        members = map(records_of, value)
        return type(value)(*members) if hasattr(value, "_fields") else tuple(members)
    return value


def type_of(value):
    """Type of an argument in a compiler's view: that of its record, or of the members of a tuple."""
    if isinstance(value, (Record, RecordArray)):
        return value.dtype
    return (type(value), *map(type_of, value)) if isinstance(value, tuple) else type(value)
