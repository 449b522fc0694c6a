"""The kernels as machine code, made when first asked for; numba is optional.

``generated.py`` carries a fingerprint of this file, so that numba's cache, which looks at that file
alone, notices other options too: run ``python -m phasmid.batch.generate`` after changing this one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from inspect import unwrap
from types import FunctionType, ModuleType
from typing import Any

from phasmid.batch import generated
from phasmid.batch.kernels import KERNELS, Kernel

OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}
"""A product and a sum may become one instruction; nothing else that arithmetic promises is given
up, since the reduction of angles counts on it."""


@cache
def numba() -> ModuleType | None:
    """The package numba, or none where it is missing, does not fit or may not compile."""
    try:
        module = import_module("numba")
    except ImportError:
        return None
    # NUMBA_DISABLE_JIT leaves Python's own loops, which cannot call the prefetch and would be far
    # slower than NumPy.
    return None if module.config.DISABLE_JIT else module


def backend() -> str:
    """What computes: ``numba`` and its version, or ``NumPy``."""
    module = numba()
    return f"numba {module.__version__}" if module else "NumPy"


@cache
def machine_code(name: str) -> Callable[..., int]:
    """A kernel of ``generated``, compiled, or loaded from numba's cache."""
    module = numba()
    assert module is not None
    kernel = next(kernel for kernel in KERNELS if kernel.name == name)
    space = vars(generated).copy()
    # Copies that see each other: the module itself stays plain Python.
    copies = {
        key: FunctionType(unwrap(value).__code__, space, key)
        for key, value in vars(generated).items()
        if isinstance(value, FunctionType)
    }
    space.update({key: module.njit(**OPTIONS)(copy) for key, copy in copies.items()})
    space["prefetch"] = _prefetch()
    function = copies[name]
    function.__module__ = generated.__name__
    signature = _signature(kernel, module)
    try:
        return module.njit(signature, cache=True, **OPTIONS)(function)
    except (RuntimeError, OSError):
        # No folder can be written to, neither the package's own nor the user's.
        return module.njit(signature, **OPTIONS)(function)


def _prefetch() -> Any:
    """``prefetch`` of ``generated`` as the processor's own instruction."""
    ir = import_module("llvmlite.ir")
    types = import_module("numba.core.types")
    intrinsic = import_module("numba.extending").intrinsic

    @intrinsic  # type: ignore[untyped-decorator]
    def prefetch(_: Any, values: Any, index: Any) -> Any:
        def instruction(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            array = context.make_array(signature.args[0])(context, builder, args[0])
            place = builder.gep(array.data, [args[1]])
            byte, word = ir.IntType(8).as_pointer(), ir.IntType(32)
            kind = ir.FunctionType(ir.VoidType(), [byte, word, word, word])
            function = builder.module.declare_intrinsic("llvm.prefetch", [byte], kind)
            # To read, of data (not instructions), into the nearest cache.
            hints = [ir.Constant(word, hint) for hint in (0, 3, 1)]
            builder.call(function, [builder.bitcast(place, byte), *hints])
            return context.get_dummy_value()

        return types.void(values, index), instruction

    return prefetch


def _signature(kernel: Kernel, module: ModuleType) -> Any:
    """One for all arrays, so that each kernel is compiled once."""
    t = module.types
    given = t.Array(t.float64, 1, "C", readonly=True)
    constants = 1 + (kernel.before is not None)
    found = len(kernel.sample_outputs) + sum(name != "margin" for name in kernel.leg_outputs)
    inputs = len(kernel.sample_inputs) + len(kernel.leg_inputs)
    series = [given, t.uint64] * inputs + [t.float64[::1], t.uint64] * found
    return [t.uint64(*[t.float64[:, ::1]] * constants, *series, t.uint64, t.uint64)]
