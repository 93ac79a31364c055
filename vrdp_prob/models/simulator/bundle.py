"""Arrays that belong together, handed to compiled functions as one pointer.

numba hands over a tuple of arrays number by number: address, sizes and strides of each. With a dozen arrays that takes
longer than the work of a short function, and the same numbers are typed, lowered and optimised again for every function
that they pass through. A bundle is the address of a record, with the sizes that are not known beforehand and the
addresses of the arrays; kernels read `bundle.name` as an array whose other sizes are constants.

A record lies on the stack of the function that makes it and keeps nothing alive: its arrays must come from outside.
"""

from collections.abc import Mapping
from functools import lru_cache
from math import prod
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from llvmlite import ir  # type: ignore[import-untyped]  # publishes no types
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, register_model
from numba.np.arrayobj import populate_array

_BYTES = 8
"""Bytes of every number in a bundle."""


class Field(NamedTuple):
    """An array of a bundle: what numbers it holds, its sizes, and whether it is given or has its place in the room."""

    dtype: types.Type
    shape: tuple[int | str, ...]
    given: bool


def floats(*shape: int | str) -> Field:
    """Array of numbers that the kernel is given; sizes are numbers, or names of what differs from call to call."""
    return Field(types.float64, shape, given=True)


def integers(*shape: int | str) -> Field:
    """Array of integers that the kernel is given."""
    return Field(types.int64, shape, given=True)


def room(*shape: int | str) -> Field:
    """Room for numbers."""
    return Field(types.float64, shape, given=False)


def integer_room(*shape: int | str) -> Field:
    """Room for integers."""
    return Field(types.int64, shape, given=False)


class Bundle(types.Type):
    """A type of bundle.

    Parameters
    ----------
    name
        Its name.
    fields
        Its arrays, all C-contiguous.
    """

    def __init__(self, name: str, **fields: Field) -> None:
        super().__init__(name)
        self.fields = fields
        named = [size for field in fields.values() for size in field.shape if isinstance(size, str)]
        self.sizes = tuple(dict.fromkeys(named))

    def workspace(self, sizes: Mapping[str, int]) -> tuple[Int[np.ndarray, "size"], Float[np.ndarray, "number"]]:
        """What `new_bundle` needs beside the given arrays: the sizes that have names, and the room."""
        own, length = _own_sizes(self, tuple([sizes[name] for name in self.sizes]))
        return own, np.zeros(length)


@lru_cache(maxsize=256)
def _own_sizes(bundle: Bundle, sizes: tuple[int, ...]) -> tuple[Int[np.ndarray, "size"], int]:
    """Sizes of a bundle as an array, and how many numbers its room holds."""
    named = dict(zip(bundle.sizes, sizes, strict=True))
    shapes = [field.shape for field in bundle.fields.values() if not field.given]
    lengths = [prod(named[size] if isinstance(size, str) else size for size in shape) for shape in shapes]
    return np.array(sizes), sum(lengths)


class _Record:
    """Code that reads and writes the record of a bundle: its named sizes, then the addresses of its arrays."""

    def __init__(self, context: Any, builder: Any, bundle: Bundle, pointer: Any) -> None:
        self._bundle, self._builder, self._integer = bundle, builder, context.get_value_type(types.intp)
        self._pointer = builder.bitcast(pointer, self._integer.as_pointer())

    def entry(self, name: str, *, size: bool) -> Any:
        """Pointer to an entry."""
        names = self._bundle.sizes if size else tuple(self._bundle.fields)
        place = names.index(name) + (0 if size else len(self._bundle.sizes))
        return self._builder.gep(self._pointer, [ir.Constant(self._integer, place)])

    def shape(self, field: Field) -> list[Any]:
        """Sizes of an array."""
        return [
            self._builder.load(self.entry(size, size=True))
            if isinstance(size, str)
            else ir.Constant(self._integer, size)
            for size in field.shape
        ]


@register_model(Bundle)
class _Pointer(models.OpaqueModel):
    """A bundle is an address."""


@infer_getattr
class _Attributes(AttributeTemplate):
    key = Bundle

    # numba states NotImplemented in the class above.
    def generic_resolve(  # type: ignore[override]
        self, bundle: Bundle, name: str
    ) -> types.Type | None:
        """Type of an array of a bundle."""
        field = bundle.fields.get(name)
        return None if field is None else types.Array(field.dtype, len(field.shape), "C")


@lower_getattr_generic(Bundle)  # type: ignore[untyped-decorator]  # numba publishes no types for it
def _array(context: Any, builder: Any, bundle: Bundle, value: Any, name: str) -> Any:
    """Array of a bundle, from its record."""
    record, field = _Record(context, builder, bundle, value), bundle.fields[name]
    kind = types.Array(field.dtype, len(field.shape), "C")
    array = context.make_array(kind)(context, builder)
    shape = record.shape(field)
    strides = [context.get_constant(types.intp, _BYTES)]
    for size in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], size))
    address = builder.load(record.entry(name, size=False))
    data = builder.inttoptr(address, context.get_data_type(field.dtype).as_pointer())
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=strides[-1], meminfo=None)
    return array._getvalue()


@intrinsic
def new_bundle(_context: Any, bundle: Any, sizes: Any, memory: Any, *given: Any) -> Any:
    """Make a bundle from what its `workspace` returned and the given arrays, in the order of its fields."""
    kind = bundle.instance_type

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        integer = context.get_value_type(types.intp)
        space = cgutils.alloca_once(builder, integer, len(kind.sizes) + len(kind.fields))
        record = _Record(context, builder, kind, space)
        stated = context.make_array(sizes)(context, builder, arguments[1])
        for place, name in enumerate(kind.sizes):
            size = builder.load(builder.gep(stated.data, [ir.Constant(integer, place)]))
            builder.store(size, record.entry(name, size=True))
        free = builder.ptrtoint(context.make_array(memory)(context, builder, arguments[2]).data, integer)
        arrays = iter(enumerate(given))
        for name, field in kind.fields.items():
            if field.given:
                place, array = next(arrays)
                value = builder.extract_value(arguments[3], place)
                address = builder.ptrtoint(context.make_array(array)(context, builder, value).data, integer)
            else:
                address = free
                free = builder.add(free, _bytes_of(builder, integer, record.shape(field)))
            builder.store(address, record.entry(name, size=False))
        return builder.bitcast(space, context.get_value_type(kind))

    return kind(bundle, sizes, memory, types.StarArgTuple(given)), code


def _bytes_of(builder: Any, integer: Any, shape: list[Any]) -> Any:
    total = ir.Constant(integer, _BYTES)
    for size in shape:
        total = builder.mul(total, size)
    return total
