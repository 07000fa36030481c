"""Arrays of records whose fields are attributes, as kernels read them, for kernels that run as Python functions.

NumPy's `recarray` does the same, but hides a field named `shape` behind the shape of the record itself.
"""

from __future__ import annotations

from functools import cache

import numpy as np


class Record:
    """Record of a structured array, with its fields as attributes; base of the classes that `_class_of` makes.

    Numbers are read from and written to the array. Fields that are arrays are views of it; those that are records are
    `Record` objects.
    """

    __slots__ = ("_record", "_views", "dtype")

    def __init__(self, record: np.void):
        self._record, self.dtype = record, record.dtype
        self._views = {name: records_of(record[name]) for name in record.dtype.names if _is_part(record.dtype[name])}


def _is_part(dtype: np.dtype) -> bool:
    """True if a field of this type is an array or a record, False if it is a number."""
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
    """Make the subclass of `Record` for records of this type, with a property for each field."""
    fields = {name: _view(name) if _is_part(dtype[name]) else _number(name) for name in dtype.names}
    return type("Record", (Record,), {"__slots__": (), **fields})


class RecordArray:
    """One-dimensional array of records, whose elements are `Record` objects.

    Parameters
    ----------
    array : (n,) structured array
        Array that holds the numbers; it is not copied.
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
    """Convert an argument of a kernel: structured arrays become `RecordArray`, records `Record`, also within tuples."""
    if isinstance(value, np.ndarray):
        return RecordArray(value) if value.dtype.names else value
    if isinstance(value, np.void) and value.dtype.names:
        return _class_of(value.dtype)(value)
    if isinstance(value, tuple):
        members = map(records_of, value)
        return type(value)(*members) if hasattr(value, "_fields") else tuple(members)
    return value


def type_of(value):
    """Type of an argument by which kernels are chosen: dtype of a record, class and types of members of a tuple."""
    if isinstance(value, (Record, RecordArray)):
        return value.dtype
    return (type(value), *map(type_of, value)) if isinstance(value, tuple) else type(value)
