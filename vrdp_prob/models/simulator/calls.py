"""Calls of machine code by its address, for functions that numba compiles.

numba's own function pointers belong to a signature and are made when a kernel is compiled; an address is a number that
the kernel reads, so that one kernel, compiled once, serves all laws.
"""

from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]  # publishes no types
from numba.core import types
from numba.extending import intrinsic

from vrdp_prob.models.simulator.bundle import Bundle


def _argument(context: Any, builder: Any, kind: types.Type, value: Any) -> Any:
    """What a function is handed: an array as its address, a bundle, a number as float64 or int64."""
    if isinstance(kind, Bundle):
        return value
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value)
        return builder.bitcast(array.data, ir.IntType(8).as_pointer())
    wide = types.float64 if isinstance(kind, types.Float) else types.int64
    return context.cast(builder, value, kind, wide)


def _code(result: types.Type) -> Any:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kinds, packed = signature.args[1], arguments[1]
        values = [
            _argument(context, builder, kind, builder.extract_value(packed, place)) for place, kind in enumerate(kinds)
        ]
        returned = context.get_value_type(result) if result != types.none else ir.VoidType()
        kind = ir.FunctionType(returned, [value.type for value in values])
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        value = builder.call(function, values)
        return context.get_dummy_value() if result == types.none else value

    return code


# numba takes the arguments of an intrinsic from the signature, the typing context first.
@intrinsic
def call(_context: Any, address: Any, *arguments: Any) -> Any:
    """Call the function at an address with arrays and numbers."""
    return types.none(address, types.StarArgTuple(arguments)), _code(types.none)


@intrinsic
def call_for_integer(_context: Any, address: Any, *arguments: Any) -> Any:
    """Call the function at an address with arrays and numbers; returns an int64."""
    return types.int64(address, types.StarArgTuple(arguments)), _code(types.int64)


@intrinsic
def call_for_number(_context: Any, address: Any, *arguments: Any) -> Any:
    """Call the function at an address with arrays and numbers; returns a float64."""
    return types.float64(address, types.StarArgTuple(arguments)), _code(types.float64)
