"""The loop of a run as machine code, which holds Python's lock at no step.

Threads that each step a robot wait for one another wherever they need that lock. In this loop
neither the engine nor what stands around it needs it: a block of steps is one call. It does what
`Run._advance` does, with the same bits. Importing this module needs numba, and an engine of the
version whose structures are known here.

The engine itself calls the loop, as a function on one of the simulations of a batch of its own: so
its errors come back as they do from its Python functions, and do not end the process.
"""

from __future__ import annotations

import ctypes
import weakref
from functools import cache
from importlib import import_module
from inspect import unwrap
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled, heed_sources
from phasmid.simulation.calling import address, call, library, pointer
from phasmid.simulation.joint_drive import Drive
from phasmid.simulation.plain import Made
from phasmid.simulation.samples import Samples
from phasmid.simulation.servo import NUMBERS, servo_step, state_rows

if TYPE_CHECKING:
    from collections.abc import Callable

DATA_SIZE = 162120
"""Size of the structure of the engine's state in the version that is known [bytes]."""

numba: Any = import_module("numba")

ROWS = 4
"""Arrays that are copied at each step: angles, speeds, sensors, the drive's state."""

MODEL, DATA, STEP, FORWARD, COUNT, END, AT, MADE, JOINTS, TARGETS, COMMAND, MEMORY = range(12)
TORQUE, TORQUE_MOVES, TO_TORQUE, EQUALITIES, CONSTRAINTS, LOST = range(12, 18)
FROM, TO, WIDTH = 18, 18 + ROWS, 18 + 2 * ROWS
SIZE = WIDTH + ROWS
"""Places in the table of numbers and addresses that the loop is given, and their number."""


class UnlockedLoop:
    """The steps of one run.

    Args:
        model: The engine's model.
        data: The engine's state, after a first step or `mj_forward`.
        drive: What moves the joints.
        buffer: Takes a sample of each step.

    Attributes:
        table: Numbers and addresses that the loop is given.
        targets: Takes what the drive is told.
        given: Addresses of a batch of the engine's, of the loop, and of the table.

    Raises:
        OSError: The engine's library is not where its package is, or its state is laid out in
            another way.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, drive: Drive, buffer: Samples
    ) -> None:
        name, memory = drive.memory()
        torque = drive.torque()
        if len(torque) != buffer.torque.shape[1]:
            raise OSError(f"{len(torque)} torques for {buffer.torque.shape[1]} joints")
        sources = data.qpos, data.qvel, data.sensordata, drive.state
        goals = buffer.qpos, buffer.qvel, buffer.sensors, buffer.drive
        addresses = [array.ctypes.data for array in memory]
        self._memory = np.array([*addresses, len(torque)], np.int64)
        self.table = table = np.zeros(SIZE, np.int64)
        table[MODEL], table[DATA] = model._address, data._address
        table[STEP], table[FORWARD] = (address(name) for name in ("mj_step", "mj_forward"))
        table[JOINTS] = len(torque)
        table[COMMAND], table[MEMORY] = COMMANDS[name].address, self._memory.ctypes.data
        table[TORQUE] = torque.ctypes.data
        if name == "prescribed":
            # The engine lays its constraints anew at each step, wherever there is room.
            table[TORQUE], table[TORQUE_MOVES] = _place_of(torque.ctypes.data, data._address), 1
            table[EQUALITIES] = data._address + _offset_of("ne")
            table[CONSTRAINTS] = data._address + _offset_of("nefc")
        table[FROM : FROM + ROWS] = [array.ctypes.data for array in sources]
        table[TO : TO + ROWS] = [array.ctypes.data for array in goals]
        table[TO_TORQUE] = buffer.torque.ctypes.data
        table[WIDTH : WIDTH + ROWS] = [array.size for array in sources]
        # Where targets lie is asked once: that takes longer than to copy them.
        self.targets = np.empty(buffer.torque.shape)
        table[TARGETS] = self.targets.ctypes.data
        self._keeps = model, data, drive, buffer, memory
        self._batch, self._apply = _new_batch(), library().mjb_apply
        self.given = self._batch, steps.address, table.ctypes.data
        weakref.finalize(self, library().mjb_deleteBatch, self._batch)

    def advance(self, targets: Float[np.ndarray, "samples joints"], end: int, at: int = 0) -> Made:
        """Make a step for each target; its sample goes into the buffer.

        Args:
            targets: What the drive is told.
            end: Number of the target that is measured and not stepped, if there is such a one.
            at: Where in the buffer the first sample goes.

        Returns:
            What became of it.
        """
        table, count, room = self.table, len(targets), len(self.targets)
        if at + count > room:
            raise OSError(f"{count} steps from {at} on for a buffer of {room}")
        self.targets[:count] = targets
        table[COUNT], table[END], table[AT], table[MADE], table[LOST] = count, end, at, 0, 0
        batch, steps, place = self.given
        failed = self._apply(batch, None, 1, steps, place, 0)
        return self.made(failed=failed != 0)

    def made(self, *, failed: bool) -> Made:
        """What became of the last steps.

        Args:
            failed: Whether the engine has told of an error.
        """
        error = library().mjb_error(self._batch, 0).decode() if failed else ""
        return Made(int(self.table[MADE]), error, bool(self.table[LOST]))


class _Config(ctypes.Structure):
    """How a batch is made."""

    _fields_ = (("threads", ctypes.c_int), ("persistent", ctypes.c_ubyte))


def _new_batch() -> int:
    """A batch of one empty simulation, in the caller's thread."""
    nothing, reason = mujoco.MjModel.from_xml_string("<mujoco/>"), ctypes.create_string_buffer(256)
    config = _Config(1, 1)
    made = library().mjb_makeBatch(nothing._address, 1, ctypes.byref(config), reason, 256)
    if not made:
        raise OSError(reason.value.decode())
    return int(made)


def _bytes(structure: int) -> bytes:
    """A copy of a state of the engine."""
    return ctypes.string_at(structure, DATA_SIZE)


def _place_of(address: int, structure: int) -> int:
    """Where in a state of the engine an address stands.

    Raises:
        OSError: It stands there nowhere, or more than once.
    """
    found = np.flatnonzero(np.frombuffer(_bytes(structure), np.int64) == address)
    if not address or len(found) != 1:
        raise OSError("the engine's state is laid out in another way")
    return structure + 8 * int(found[0])


@cache
def _offset_of(name: str) -> int:
    """How far into a state of the engine one of its counts stands, found by changing it.

    Raises:
        OSError: It stands there nowhere, or more than once.
    """
    data = mujoco.MjData(mujoco.MjModel.from_xml_string("<mujoco/>"))
    found = np.ones(DATA_SIZE // 4, dtype=bool)
    for mark in (0x5EA0F00D, 0x1CEB00DA):
        setattr(data, name, mark)
        found &= np.frombuffer(_bytes(data._address), np.int32) == mark
    setattr(data, name, 0)
    places = np.flatnonzero(found)
    if len(places) != 1:
        raise OSError("the engine's state is laid out in another way")
    return 4 * int(places[0])


def _machine_code(*kinds: Any) -> Callable[[Callable[..., Any]], Any]:
    """A function that C can call, from numba's cache where there is one."""

    def made(function: Callable[..., Any]) -> Any:
        # A check of its arguments that is wrapped around it cannot be compiled.
        function = unwrap(function)
        nothing, options = numba.types.void, {"error_model": "numpy"}
        try:
            # What numba.cfunc does, with a cache that looks at more than this file.
            kind = import_module("numba.core.ccallback").CFunc
            callback = kind(function, (kinds, nothing), locals={}, options=options)
            callback.enable_caching()
            heed_sources(callback, function)
            callback.compile()
        except (RuntimeError, OSError, AttributeError):
            # No folder can be written to, or this numba keeps its cache in another way.
            return numba.cfunc(nothing(*kinds), **options)(function)
        return callback

    return made


ANY = numba.types.voidptr
_servo_step = compiled(servo_step)
_state_rows = numba.njit(unwrap(state_rows))


def inner(function: Callable[..., Any]) -> Any:
    """A function that is called by machine code alone, and may look at memory as at an array."""
    return numba.njit(error_model="numpy")(unwrap(function))


@inner
def copy(source: int, goal: int, count: int) -> None:
    """Copy numbers from one address to another."""
    given = numba.carray(pointer(source), (count,), np.float64)
    taken = numba.carray(pointer(goal), (count,), np.float64)
    for i in range(count):
        taken[i] = given[i]


@_machine_code(ANY, ANY, numba.int32, ANY)
def steps(_model: Any, _data: Any, _simulation: Any, given: Any) -> None:
    """Make the steps that the table tells of."""
    table = numba.carray(given, (SIZE,), np.int64)
    joints = table[JOINTS]
    for k in range(table[COUNT]):
        at = table[AT] + k
        for row in range(2):
            width = table[WIDTH + row]
            copy(table[FROM + row], table[TO + row] + 8 * at * width, width)
        call(table[COMMAND], table[TARGETS] + 8 * k * joints, table[MEMORY])
        call(table[FORWARD] if k == table[END] else table[STEP], table[MODEL], table[DATA])
        for row in range(2, ROWS):
            width = table[WIDTH + row]
            copy(table[FROM + row], table[TO + row] + 8 * at * width, width)
        torque = table[TORQUE]
        if table[TORQUE_MOVES]:
            torque = numba.carray(pointer(torque), (1,), np.int64)[0]
            equalities = numba.carray(pointer(table[EQUALITIES]), (1,), np.int32)[0]
            constraints = numba.carray(pointer(table[CONSTRAINTS]), (1,), np.int32)[0]
            # An engine without room leaves constraints out; what lies there is then not ours.
            if torque == 0 or equalities < joints or constraints < joints:
                table[LOST] = 1
                return
        copy(torque, table[TO_TORQUE] + 8 * at * joints, joints)
        table[MADE] += 1


@_machine_code(ANY, ANY)
def command_prescribed(target: Any, memory: Any) -> None:
    """`PrescribedDrive.command`."""
    places = numba.carray(memory, (3,), np.int64)
    joints = places[2]
    wanted = numba.carray(target, (joints,), np.float64)
    width = numba.carray(pointer(places[1]), (1,), np.int64)[0]
    held = numba.carray(pointer(places[0]), (joints, width), np.float64)
    for j in range(joints):
        held[j, 0] = wanted[j]


@_machine_code(ANY, ANY)
def command_ideal_servo(target: Any, memory: Any) -> None:
    """`IdealServoDrive.command`."""
    places = numba.carray(memory, (5,), np.int64)
    joints = places[4]
    wanted = numba.carray(target, (joints,), np.float64)
    control = numba.carray(pointer(places[0]), (joints,), np.float64)
    velocity = numba.carray(pointer(places[1]), (joints,), np.float64)
    limits = numba.carray(pointer(places[2]), (joints, 2), np.float64)
    numbers = numba.carray(pointer(places[3]), (2,), np.float64)
    stall, drop_per_speed = numbers[0], numbers[1]
    for j in range(joints):
        control[j] = wanted[j]
        drop = velocity[j] * drop_per_speed
        limits[j, 1] = np.maximum(stall - np.maximum(drop, 0.0), 0.0)
        limits[j, 0] = np.minimum(-(stall + np.minimum(drop, 0.0)), 0.0)


@_machine_code(ANY, ANY)
def command_servo(target: Any, memory: Any) -> None:
    """`ServoDrive.command`."""
    places = numba.carray(memory, (7,), np.int64)
    joints = places[6]
    numbers = numba.carray(pointer(places[3]), (NUMBERS,), np.float64)
    _servo_step(
        numba.carray(target, (joints,), np.float64),
        numba.carray(pointer(places[0]), (joints,), np.float64),
        numba.carray(pointer(places[1]), (joints,), np.float64),
        numba.carray(pointer(places[2]), (2, joints), np.float64),
        numbers,
        numba.carray(pointer(places[4]), (_state_rows(numbers), joints), np.float64),
        numba.carray(pointer(places[5]), (joints,), np.float64),
    )


COMMANDS = {
    "prescribed": command_prescribed,
    "ideal-servo": command_ideal_servo,
    "servo": command_servo,
}
