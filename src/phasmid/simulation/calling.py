"""Calls of machine code by its address: of the engine's functions, and of numba's.

Importing this module needs numba, and an engine of the version whose structures are known here.
"""

from __future__ import annotations

import ctypes
from functools import cache
from importlib import import_module
from inspect import unwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco

from phasmid.simulation.known_engine import check_engine

if TYPE_CHECKING:
    from collections.abc import Callable

check_engine()

numba: Any = import_module("numba")
ir: Any = import_module("llvmlite.ir")


@cache
def library() -> ctypes.CDLL:
    """The engine's library, which its package has loaded by now."""
    folder = Path(mujoco.__file__).parent
    found = [*folder.glob("libmujoco.*"), *folder.glob("mujoco.dll")]
    if not found:
        raise OSError(f"{folder} holds no library of the engine")
    library = ctypes.CDLL(str(found[0]))
    address, whole = ctypes.c_void_p, ctypes.c_int
    library.mjb_makeBatch.restype = address
    library.mjb_makeBatch.argtypes = [address, whole, address, ctypes.c_char_p, whole]
    library.mjb_deleteBatch.argtypes = [address]
    library.mjb_deleteBatch.restype = None
    library.mjb_apply.argtypes = [address, address, whole, address, address, whole]
    library.mjb_error.argtypes = [address, whole]
    library.mjb_error.restype = ctypes.c_char_p
    return library


def address(name: str) -> int:
    """Where a function of the engine is."""
    return ctypes.cast(getattr(library(), name), ctypes.c_void_p).value or 0


def address_of(function: Any, result: Any, *arguments: Any) -> int:
    """Where the machine code is that numba has made of a function.

    Args:
        function: The function, which has been called with such arguments.
        result: The type of what it returns.
        *arguments: Such as it is called with.

    Raises:
        OSError: There is none.
    """
    made = function.overloads.get(tuple(numba.typeof(value) for value in arguments))
    if made is None or made.signature.return_type != result:
        raise OSError(f"{function.__name__} is not compiled for these")
    return int(made.library.get_pointer_to_function(made.fndesc.llvm_func_name))


def intrinsic(function: Callable[..., Any]) -> Any:
    """What a call of this function becomes, for the compiler."""
    return import_module("numba.extending").intrinsic(unwrap(function))


@intrinsic
def pointer(typing: Any, address: Any) -> Any:
    """A whole number as a pointer."""
    del typing

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        del context, signature
        return builder.inttoptr(args[0], ir.IntType(8).as_pointer())

    return numba.types.voidptr(address), generate


@intrinsic
def call(typing: Any, function: Any, first: Any, second: Any) -> Any:
    """Call the function at an address with two addresses."""
    del typing

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        del signature
        anything = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [anything, anything]).as_pointer()
        given = [builder.inttoptr(place, anything) for place in args[1:]]
        builder.call(builder.inttoptr(args[0], kind), given)
        return context.get_dummy_value()

    return numba.types.void(function, first, second), generate


def calling(result: Any) -> Any:
    """A function that calls what numba has compiled, at an address, with some arguments.

    What is called by its name would be compiled anew, together with its caller.

    Args:
        result: The type of what it returns.
    """

    @intrinsic
    def call_at(typing: Any, address: Any, arguments: Any) -> Any:
        del typing

        def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            kinds = signature.args[1].types
            call = context.call_conv
            code = call.get_function_type(result, kinds).as_pointer()
            place = builder.inttoptr(given[0], code)
            values = import_module("numba.core.cgutils").unpack_tuple(builder, given[1])
            status, returned = call.call_function(builder, place, result, kinds, values)
            with builder.if_then(status.is_error, likely=False):
                call.return_status_propagate(builder, status)
            return returned

        return result(address, arguments), generate

    return call_at


@intrinsic
def call_engine(typing: Any, function: Any, batch: Any, steps: Any, table: Any) -> Any:
    """Let the engine call a function with a table, as on a simulation of a batch of its own."""
    del typing

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        del context, signature
        anything, whole = ir.IntType(8).as_pointer(), ir.IntType(32)
        kinds = [anything, anything, whole, anything, anything, whole]
        code = ir.FunctionType(whole, kinds).as_pointer()
        batch, steps, table = (builder.inttoptr(place, anything) for place in args[1:])
        given = [batch, anything(None), whole(1), steps, table, whole(0)]
        return builder.call(builder.inttoptr(args[0], code), given)

    return numba.int32(function, batch, steps, table), generate


@intrinsic
def call_turn(typing: Any, function: Any, turned: Any, vector: Any, quaternion: Any) -> Any:
    """Call the engine's turning of a vector, all by their addresses."""
    del typing

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        del signature
        anything = ir.IntType(8).as_pointer()
        code = ir.FunctionType(ir.VoidType(), [anything] * 3).as_pointer()
        given = [builder.inttoptr(place, anything) for place in args[1:]]
        builder.call(builder.inttoptr(args[0], code), given)
        return context.get_dummy_value()

    return numba.types.void(function, turned, vector, quaternion), generate
