"""Parts of a row as arrays of their own, in Python and in what is compiled."""

from __future__ import annotations

import math
from importlib import import_module
from inspect import unwrap
from typing import Any

import numpy as np


def take(row: np.ndarray, begin: int, shape: tuple[int, ...]) -> tuple[np.ndarray, int]:
    """A part of a row, as an array that shares its memory, and where it ends.

    In what is compiled it is an address and a shape, and takes no time: it neither keeps the row
    alive nor sees whether it ends within the row.

    Args:
        row: The numbers, one after the other.
        begin: Where the part begins.
        shape: Of the part.
    """
    end = begin + math.prod(shape)
    return row[begin:end].reshape(shape), end


def _teach_compiler() -> None:
    """Tell the compiler what `take` is."""
    extending, types = import_module("numba.extending"), import_module("numba.types")
    helpers = import_module("numba.core.cgutils")
    populate = import_module("numba.np.arrayobj").populate_array
    wrong = import_module("numba.core.errors").TypingError

    def address(typing: Any, row: Any, begin: Any, shape: Any) -> Any:
        del typing, begin
        sizes = types.UniTuple(types.intp, len(shape))

        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            kind = signature.return_type
            given = context.make_array(signature.args[0])(context, builder, args[0])
            out = context.make_array(kind)(context, builder)
            many = helpers.unpack_tuple(builder, args[2])
            size = context.get_constant(types.intp, context.get_abi_sizeof(out.data.type.pointee))
            strides = [size]
            for length in reversed(many[1:]):
                strides.insert(0, builder.mul(strides[0], length))
            populate(
                out,
                data=builder.gep(given.data, [args[1]]),
                shape=many,
                strides=strides,
                itemsize=size,
                meminfo=None,
            )
            return out._getvalue()

        return types.Array(row.dtype, len(shape), "C")(row, types.intp, sizes), generate

    place = extending.intrinsic(unwrap(address))

    def compiled_take(row: Any, begin: Any, shape: Any) -> Any:
        del begin, shape
        if not (row.ndim == 1 and row.layout == "C" and row.mutable):
            raise wrong(f"{row} is no row of which a part may be written by its address")

        def taken(row: Any, begin: Any, shape: Any) -> Any:
            part = place(row, begin, shape)
            return part, begin + part.size

        # A check of its arguments that is wrapped around it cannot be compiled.
        return unwrap(taken)

    extending.overload(take)(unwrap(compiled_take))


_teach_compiler()
