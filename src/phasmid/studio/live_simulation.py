"""Live simulation: requests of browsers in, texts and frames out, in one thread."""

from __future__ import annotations

import ctypes
import gc
import math
import queue
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from pathlib import Path
from typing import Any

from phasmid.control.compilation import are_compiled
from phasmid.errors import InvalidInput, PhasmidError
from phasmid.scenario import Scenario, load_scenario
from phasmid.studio.broadcast import Broadcast
from phasmid.studio.fields import catalogue, values
from phasmid.studio.messages import (
    Answer,
    Bench,
    Change,
    Keep,
    Limb,
    Load,
    Pace,
    Play,
    Push,
    Record,
    Request,
    Stick,
)
from phasmid.studio.operator import Operator
from phasmid.studio.pacing import Pacing
from phasmid.studio.recorder import LONGEST, Recorder
from phasmid.studio.scene import Scene, gait_table
from phasmid.studio.setting import Setting, setting_of
from phasmid.studio.settings_io import scenario_file, with_file

FRAMES = 100 / 3
"""Most frames per second: one for each six of the usual 200 updates [1/s]."""

LONGEST_WAIT = 0.05
"""Longest time without a look at clock and requests [s]."""

LYING = 2.0
"""Time for which a fallen robot is shown [s]."""

COMPILES = "The controller is being compiled, once for this machine: less than a minute."


class LiveSimulation:
    """Robot in physics that browsers drive, in a thread of its own.

    Requests are carried out in their order, between two updates of the controller.

    Args:
        scenario: Initial scenario.
        out: Folder of saved runs.
        publish: Called from the thread with texts in JSON, and with frames.

    Raises:
        InvalidInput: The scenario's robot or gait is invalid.
    """

    def __init__(
        self, scenario: Scenario, *, out: Path, publish: Callable[[str | bytes], None]
    ) -> None:
        self._first = setting_of(scenario)
        self._broadcast = Broadcast(publish)
        self._requests: queue.SimpleQueue[tuple[Request, Future[Answer]] | None] = (
            queue.SimpleQueue()
        )
        self._recorder = Recorder(out)
        self._files = tempfile.TemporaryDirectory(prefix="phasmid-studio-")
        self._pacing = Pacing()
        self._operator = Operator(
            self._first, build=self._build, changed=self._send_setting, report=self._event
        )
        self._scene: Scene | None = None
        self._playing = True
        self._sentence, self._notice, self._state = "", "", dict[str, Any]()
        self._reset_at, self._fault_at = math.inf, -math.inf
        self._compiles = False
        self._viewers, self._needs_frame, self._next_frame = 0, True, 0.0
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="simulation", daemon=True)

    # From other threads --------------------------------------------------------------------------

    def start(self) -> None:
        """Start the thread; the robot walks ahead by itself."""
        self._thread.start()

    def close(self) -> None:
        """End the thread; a recording stays as its log."""
        self._closing.set()
        self._requests.put(None)
        if self._thread.is_alive():
            self._thread.join()
        self._recorder.close()
        self._files.cleanup()

    def submit(self, request: Request) -> Future[Answer]:
        """Queue a request.

        Returns:
            The answer, or the `PhasmidError` of its refusal.
        """
        future: Future[Answer] = Future()
        if self._closing.is_set():
            future.set_exception(InvalidInput("the studio is closed."))
        else:
            self._requests.put((request, future))
        return future

    def hello(self) -> list[str]:
        """Return the texts that bring a new browser up to date."""
        return self._broadcast.hello()

    def viewers(self, count: int) -> None:
        """Set the number of browsers: without any the stick centers and no frames are made."""
        if count > self._viewers:
            self._needs_frame = True
        self._viewers = count

    def folder(self, run: str) -> Path | None:
        """Return the folder of a saved run; None for an unknown id."""
        return self._recorder.folder(run)

    # The thread ----------------------------------------------------------------------------------

    def _run(self) -> None:
        self._compiles = not are_compiled()
        self._send_setting()
        self._send_state()
        while not self._closing.is_set():
            try:
                self._turn()
            except Exception as error:
                # No fault may end the studio.
                self._recover(error)
        while not self._requests.empty():
            queued = self._requests.get()
            if queued is not None:
                _refuse(queued[1], InvalidInput("the studio is closed."))

    def _turn(self) -> None:
        """Answer requests, advance, publish."""
        if self._operator.live is None:
            self._build(self._operator.setting)
        self._answer()
        now = time.monotonic()
        self._operator.release_stale_stick(now, unwatched=not self._viewers)
        if now >= self._reset_at:
            self._build(self._operator.setting)
        elif self._playing:
            self._advance(now)
        for saved in self._recorder.finished():
            self._event(saved.sentence, run=saved.run if saved.complete else "")
        self._send_frame()
        self._send_state()

    def _answer(self) -> None:
        """Carry out requests until the next frame is due."""
        wait = LONGEST_WAIT
        if self._playing:
            wait = max(0.0, min(self._next_frame - time.monotonic(), LONGEST_WAIT))
        with suppress(queue.Empty):
            queued = self._requests.get(timeout=wait) if wait > 0 else self._requests.get_nowait()
            while True:
                if queued is not None:
                    self._carry_out(*queued)
                queued = self._requests.get_nowait()

    def _carry_out(self, request: Request, future: Future[Answer]) -> None:
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(self._handle(request))
        except PhasmidError as error:
            _refuse(future, error)
        except Exception as error:
            _refuse(future, error)
            # The robot may be half changed.
            raise

    def _advance(self, now: float) -> None:
        """Advance by the updates that are due, for no longer than a frame's time."""
        live, pacing = self._operator.robot, self._pacing
        if live.failure is not None:
            return
        due, part = pacing.due(now, live.period), max(1, round(1 / FRAMES / live.period))
        while due > 0 and live.failure is None:
            before = live.now
            live.advance(min(due, part))
            self._compiles = False
            due -= part
            pacing.done(time.monotonic(), live.now, live.now - before)
            if time.monotonic() >= now + 1 / FRAMES:
                break
        self._report_events()

    def _report_events(self) -> None:
        """Report the controller's events, a fall, and the end of a plan or a recording."""
        live = self._operator.robot
        for at, sentence in live.take_events():
            self._event(sentence, at=at)
        if live.failure is not None and self._reset_at == math.inf:
            self._reset_at = time.monotonic() + LYING
            self._sentence = live.failure.sentence
            self._event(f"{self._sentence} It is put back in {LYING:g} s.")
            self._end_recording()
        elif live.now >= live.ends_at:
            self._event("the plan is at its end; it begins anew.")
            self._reset_at = 0.0
        if self._recorder.run and (self._recorder.is_full or self._recorder.failure):
            full = f"the recording is {LONGEST / 60:g} min long and ends"
            self._event(f"{self._recorder.failure or full}.")
            self._end_recording()

    def _recover(self, error: Exception) -> None:
        """Return the robot to its start after a fault; after a second one, with a safe setting."""
        again = time.monotonic() - self._fault_at < 2 * LYING
        self._fault_at = time.monotonic()
        self._operator.live = self._scene = None
        if isinstance(error, PhasmidError):
            sentence = f"{error.what.rstrip('.')}; the robot is put back to its start"
        else:
            sentence = (
                f"an unforeseen fault, {_one_line(error)}; the robot is put back to its start"
            )
        if again:
            sentence += ", with the usual setting, and waits"
            is_first = self._operator.setting is self._first
            # The paper's robot can always be built.
            self._operator.setting = setting_of(load_scenario("paper")) if is_first else self._first
            self._playing = False
            self._notice = f"{sentence}."
        self._event(f"{sentence}.")
        try:
            self._end_recording()
        except Exception as failed:
            self._event(f"the recording is lost: {_one_line(failed)}.")

    def _build(self, setting: Setting, lost: frozenset[int] = frozenset()) -> None:
        """Build a robot; the present one stays if that is refused."""
        live = self._operator.create(setting, lost)
        scene = Scene(live, self._scene.number + 1 if self._scene else 1)
        if self._recorder.run:
            self._event("the recording ends, since the robot is another one now.")
            self._end_recording()
        self._operator.adopt(live, lost)
        self._scene = scene
        self._reset_at, self._sentence = math.inf, ""
        self._needs_frame = True
        self._pacing.begin(time.monotonic())
        self._send_setting()
        self._broadcast.set("scene", scene.table)
        free_memory()

    # Requests ------------------------------------------------------------------------------------

    def _handle(self, request: Request) -> Answer:
        operator = self._operator
        match request:
            case Stick():
                operator.steer(request.at)
            case Change():
                operator.change(request.name, request.value)
            case Play():
                self._play(request.how)
            case Pace():
                self._pacing.factor = request.factor
                self._pacing.begin(time.monotonic())
            case Push():
                operator.push(request.impulse)
            case Limb():
                operator.limb(request.leg, request.how)
            case Record():
                return self._record(request.on)
            case Keep():
                return scenario_file(operator.setting)
            case Load():
                operator.apply(with_file(operator.setting, request, Path(self._files.name)))
            case Bench():
                # Lazy import: it loads the paper's dynamics.
                from phasmid.studio.bench import bench

                return bench(operator.setting.robot, request)
        return {}

    def _play(self, how: str) -> None:
        self._notice = ""
        if how == "reset":
            self._build(self._operator.setting)
            return
        self._playing = how == "play"
        self._pacing.begin(time.monotonic())
        if how == "step":
            self._operator.robot.advance(1)
            self._report_events()
        self._needs_frame = True

    def _record(self, on: bool) -> Answer:
        if on:
            return {"run": self._recorder.begin(self._operator.upright())}
        run = self._recorder.run
        if not run:
            raise InvalidInput("nothing records; there is no recording to end.")
        if why := self._end_recording():
            raise InvalidInput(why)
        return {"run": run}

    def _end_recording(self) -> str:
        """End the recording, if there is one; return the reason if it is not kept."""
        if not self._recorder.run:
            return ""
        live = self._operator.live
        why = self._recorder.end(live.failure if live else None)
        if why:
            self._event(why)
        return why

    # Texts and frames ----------------------------------------------------------------------------

    def _send_frame(self) -> None:
        """Publish a frame if it is due and someone watches."""
        live, scene, now = self._operator.live, self._scene, time.monotonic()
        if live is None or scene is None or now < self._next_frame:
            return
        self._next_frame = max(self._next_frame + 1 / FRAMES, now)
        if not self._viewers or not (self._playing or self._needs_frame):
            return
        self._needs_frame = False
        if scene.follow_ground(live):
            self._broadcast.set("scene", scene.table)
        pace = self._pacing.measured if self._playing else math.nan
        self._broadcast.publish(scene.frame(live, pace))

    def _send_setting(self) -> None:
        setting, scene = self._operator.setting, self._scene
        self._broadcast.set("catalogue", catalogue(setting))
        self._broadcast.set("setting", values(setting))
        gait = gait_table(setting.gait)
        if scene is not None and scene.table["gait"] != gait:
            scene.table |= {"gait": gait}
            self._broadcast.set("scene", scene.table)

    def _send_state(self) -> None:
        operator, recorder = self._operator, self._recorder
        live = operator.live
        state = {
            "playing": self._playing,
            "pace": self._pacing.factor,
            "recording": {"seconds": math.floor(recorder.seconds)} if recorder.run else None,
            "status": live.status if live else "is being built",
            "sentence": self._sentence or self._notice or (COMPILES if self._compiles else ""),
            "lost": sorted(operator.lost),
            "dead": sorted(operator.dead),
            "servos": operator.setting.servo_verdict,
        }
        if state != self._state:
            self._state = state
            now = live.now if live else 0.0
            self._broadcast.set("state", state | {"time": round(now, 3)})

    def _event(self, text: str, *, at: float | None = None, run: str = "") -> None:
        """Publish a sentence, and record it."""
        live = self._operator.live
        now = (live.now if live else 0.0) if at is None else at
        if self._broadcast.event(text, now, run):
            self._recorder.add_event(now, text)


def free_memory() -> None:
    """Return the memory of a replaced robot to the system.

    A run and its observations refer to each other, and hold megabytes that Python does not count.
    """
    gc.collect()
    if sys.platform == "linux":
        # Only the C library of GNU has it.
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).malloc_trim(ctypes.c_size_t(0))


def _refuse(future: Future[Answer], error: Exception) -> None:
    # The browser may have gone.
    with suppress(InvalidStateError):
        future.set_exception(error)


def _one_line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:200].rstrip(".: ")
