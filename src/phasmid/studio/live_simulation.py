"""Live simulation: requests of browsers in, texts and frames out, in one thread.

What may take long, a change of the setting or a file, is made ready in another one.
"""

from __future__ import annotations

import gc
import json
import math
import queue
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from phasmid.errors import InvalidInput, PhasmidError
from phasmid.robot import JOINTS
from phasmid.scenario import Scenario, load_scenario
from phasmid.studio.builder import Builder, Ready, refuse
from phasmid.studio.fields import POSES, catalogue, field_of, values
from phasmid.studio.live import LiveRobot, Velocity
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
from phasmid.studio.pacing import Pacing
from phasmid.studio.recorder import LONGEST, Recorder
from phasmid.studio.scene import Scene, gait_table
from phasmid.studio.setting import LOCOMOTION, Setting, setting_of
from phasmid.studio.settings_io import scenario_file, with_file

FRAMES = 100 / 3
"""Most frames per second: one for each six of the usual 200 updates [1/s]."""

BUDGET = 1 / FRAMES
"""Time of each turn for requests, and as much for the robot [s]."""

LONGEST_WAIT = 0.05
"""Longest time without a look at clock and requests [s]."""

LONGEST_WRITE = 1.0
"""Longest time in which a loaded file is written, before its folder is removed [s]."""

LYING = 2.0
"""Time for which a fallen robot is shown [s]."""

STICK_TIMEOUT = 0.5
"""A stick command expires after as long [s]."""

GENTLE = (0.5, 0.0, 0.0)
"""Shares of the largest velocity with which the robot walks by itself."""

HARDEST = 1.5
"""Largest change of the robot's speed by a push [m/s]."""

SAME_EVENT = 3.0
"""Least time between two events with the same text [s]."""

KINDS = ("catalogue", "scene", "setting", "state")
"""Kinds of texts that a new browser needs, in order."""

AT_REST = (0.0, 0.0, 0.0)

BY_HAND = 'walks = "by hand"'


class LiveSimulation:
    """Robot in physics that browsers drive, in a thread of its own.

    Requests are carried out in their order, between two updates of the controller; those that
    change the setting or put the robot back, once their result is ready.

    Args:
        scenario: Initial scenario.
        out: Folder of saved runs.
        publish: Called from the thread with texts in JSON, and with frames.

    Attributes:
        setting: Present setting.
        live: Robot; None while there is none.

    Raises:
        InvalidInput: The scenario's robot or gait is invalid.
    """

    def __init__(
        self, scenario: Scenario, *, out: Path, publish: Callable[[str | bytes], None]
    ) -> None:
        self.setting = self._first = setting_of(scenario)
        self.live: LiveRobot | None = None
        self._lost, self._dead = frozenset[int](), frozenset[int]()
        self._stick: Velocity = AT_REST
        self._stick_at = -math.inf
        self._requests: queue.SimpleQueue[tuple[Request, Future[Answer]] | None] = (
            queue.SimpleQueue()
        )
        self._publish = publish
        self._texts: dict[str, str] = {}
        self._events: dict[str, float] = {}
        self._recorder = Recorder(out)
        self._files: tempfile.TemporaryDirectory[str] | None = None
        self._builder = Builder(self._make, lambda: self._requests.put(None))
        self._reset: Future[Answer] | None = None
        self._pacing = Pacing()
        self._scene: Scene | None = None
        self._playing = True
        self._sentence, self._notice, self._state = "", "", dict[str, Any]()
        self._reset_at, self._fault_at = math.inf, -math.inf
        self._viewers, self._needs_frame, self._next_frame = 0, True, 0.0
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="simulation", daemon=True)

    # From other threads --------------------------------------------------------------------------

    def start(self) -> None:
        """Start the thread; the robot walks ahead by itself."""
        self._thread.start()

    def close(self, longest: float | None = None) -> bool:
        """End the threads; a recording stays as its log.

        Args:
            longest: Longest time to wait for the robot, which may compile [s].

        Returns:
            True if the robot ended in time.
        """
        self._closing.set()
        self._requests.put(None)
        if self._thread.ident is not None:
            self._thread.join(longest)
        has_ended = not self._thread.is_alive()
        self._recorder.close(finish=has_ended)
        self._builder.close(LONGEST_WRITE)
        if self._files is not None:
            self._files.cleanup()
        gc.unfreeze()
        return has_ended

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
        """Return the newest text of each kind, which bring a new browser up to date."""
        return [self._texts[kind] for kind in KINDS if kind in self._texts]

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
                refuse(queued[1], InvalidInput("the studio is closed."))

    def _turn(self) -> None:
        """Answer requests, advance, publish."""
        if self.live is None:
            self._adopt(self._built(self.setting, self.setting), frozenset())
            if gc.get_freeze_count() == 0:
                # What was imported and compiled stays; later collections need not look at it.
                gc.freeze()
        self._answer()
        self._take_ready()
        now = time.monotonic()
        if not self._viewers or now - self._stick_at > STICK_TIMEOUT:
            self._move_stick(AT_REST)
        if now >= self._reset_at:
            self._put_back()
        elif self._playing:
            self._advance(now)
        for sentence, run in self._recorder.finished():
            self._event(sentence, run=run)
        self._send_frame()
        self._send_state()

    def _answer(self) -> None:
        """Carry out requests until the next frame is due; of those that wait, for a time."""
        wait = LONGEST_WAIT
        if self._playing:
            wait = max(0.0, min(self._next_frame - time.monotonic(), LONGEST_WAIT))
        with suppress(queue.Empty):
            queued = self._requests.get(timeout=wait) if wait > 0 else self._requests.get_nowait()
            end = time.monotonic() + BUDGET
            while True:
                if queued is not None:
                    self._carry_out(*queued)
                if time.monotonic() > end:
                    break
                queued = self._requests.get_nowait()

    def _carry_out(self, request: Request, future: Future[Answer]) -> None:
        """Carry out a request, or pass it on if that may take long."""
        try:
            if isinstance(request, Play):
                self._notice = ""
            if kind := _kind(request):
                self._builder.put(kind, request, future)
            elif future.set_running_or_notify_cancel():
                future.set_result(self._handle(request) or {})
        except PhasmidError as error:
            refuse(future, error)
        except Exception as error:
            refuse(future, error)
            # The robot may be half changed.
            raise

    def _take_ready(self) -> None:
        """Put what is ready in place of the present setting and robot."""
        job = self._builder.take()
        if job is None:
            return
        if job.answer is self._reset and self._reset_at == math.inf:
            # Another change has put the robot back meanwhile.
            job.answer.set_result({})
            return
        try:
            ready = job.ready.result()
            same = len(ready.setting.base.legs) == len(self.setting.base.legs)
            keeps = same and not isinstance(job.request, Play)
            self._adopt(ready, self._lost if keeps else frozenset())
            job.answer.set_result({})
        except Exception as error:
            refuse(job.answer, error)
            is_half_changed = not isinstance(error, PhasmidError) and not job.ready.exception()
            if is_half_changed or job.answer is self._reset:
                raise

    def _put_back(self) -> None:
        """Return the robot to its start, unless that is in work."""
        if self._reset is None or self._reset.done():
            self._reset = Future()
            self._builder.put("return to the start", Play(how="reset"), self._reset)

    def _advance(self, now: float) -> None:
        """Advance by the updates that are due, for no longer than a frame's time."""
        live = self._robot
        if live.failure is not None:
            return
        due = self._pacing.due(now, live.now, live.period)
        part = max(1, round(1 / FRAMES / live.period))
        while due > 0 and time.monotonic() < now + BUDGET:
            live.advance(min(due, part))
            due -= part
        self._report_events()

    def _report_events(self) -> None:
        """Report the controller's events, a fall, and the end of a plan or a recording."""
        live = self._robot
        for at, sentence in live.take_events():
            self._event(sentence, at=at)
        if live.failure is not None and self._reset_at == math.inf:
            self._reset_at = time.monotonic() + LYING
            self._sentence = live.failure.sentence
            self._event(f"{self._sentence} It is put back in {LYING:g} s.")
            self._end_recording()
        elif live.now >= live.ends_at and self._reset_at == math.inf:
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
        self.live = self._scene = None
        fault = f"an unforeseen fault, {_one_line(error)}"
        self._builder.drop(InvalidInput("the robot is put back to its start."))
        if isinstance(error, PhasmidError):
            fault = error.what.rstrip(".")
        sentence = f"{fault}; the robot is put back to its start"
        if again:
            sentence += ", with the usual setting, and waits"
            # The paper's robot can always be built.
            is_first = self.setting is self._first
            self.setting = setting_of(load_scenario("paper")) if is_first else self._first
            self._playing = False
            self._notice = f"{sentence}."
        self._event(f"{sentence}.")
        try:
            self._end_recording()
        except Exception as failed:
            self._event(f"the recording is lost: {_one_line(failed)}.")

    # The robot -----------------------------------------------------------------------------------

    @property
    def _robot(self) -> LiveRobot:
        """Robot, where there is one."""
        assert self.live is not None
        return self.live

    def _upright(self) -> LiveRobot:
        """Return the robot.

        Raises:
            InvalidInput: It fell.
        """
        if self._robot.failure is not None:
            raise InvalidInput("the robot fell; it is put back in a moment.", hint="reset")
        return self._robot

    def _make(self, request: Request) -> Ready:
        """Return what a request makes of the present setting; in the builder's thread.

        Raises:
            InvalidInput: The new setting cannot be built, or cannot be walked.
        """
        before = setting = self.setting
        if isinstance(request, Change):
            setting = self._changed(before, request.name, request.value)
        elif isinstance(request, Load):
            if self._files is None:
                self._files = tempfile.TemporaryDirectory(prefix="phasmid-studio-")
            setting = with_file(before, request, Path(self._files.name))
        if isinstance(request, Play) or setting.built_of() != before.built_of():
            return self._built(before, setting)
        return Ready(before, setting)

    def _built(self, before: Setting, setting: Setting) -> Ready:
        """Return a robot that walks by a setting."""
        live = LiveRobot(setting)
        live.follow(setting, self._share(setting), frozenset())
        scene = Scene(live, self._scene.number + 1 if self._scene else 1)
        return Ready(before, setting, live, scene)

    def _adopt(self, ready: Ready, lost: frozenset[int]) -> None:
        """Put a setting, and its robot if it has one, in place of the present ones.

        Raises:
            InvalidInput: The robot cannot walk so; all stays as it was.
        """
        setting = ready.setting
        if setting.walks != ready.before.walks:
            self._stick = AT_REST
        elif setting.walks != self.setting.walks:
            # The stick took over meanwhile.
            setting = replace(setting, walks=self.setting.walks)
        live = ready.live or self._robot
        live.follow(setting, self._share(setting), lost)
        self.setting = setting
        if ready.live is None:
            self._send_setting()
            return
        if self._recorder.run:
            self._event("the recording ends, since the robot is another one now.")
            self._end_recording()
        self.live, self._scene = live, ready.scene
        self._lost, self._dead = lost, frozenset()
        self._reset_at, self._sentence = math.inf, ""
        self._needs_frame = True
        self._pacing.begin(time.monotonic(), live.now)
        self._send_setting()
        assert self._scene is not None
        self._send("scene", self._scene.table)
        # A run and its observations refer to each other, and hold megabytes that Python does not
        # count.
        gc.collect()

    def _share(self, setting: Setting) -> Velocity:
        """Return the commanded shares of the largest velocity."""
        if setting.walks == "by itself":
            return GENTLE
        return self._stick if setting.walks == "by hand" else AT_REST

    def _move_stick(self, share: Velocity) -> None:
        if share != self._stick:
            self._stick = share
            self._robot.follow(self.setting, self._share(self.setting), self._lost)

    # Requests ------------------------------------------------------------------------------------

    def _handle(self, request: Request) -> Answer | None:
        match request:
            case Stick():
                self._steer(request.at)
            case Play():
                self._play(request.how)
            case Pace():
                self._pacing.factor = request.factor
                self._pacing.begin(time.monotonic(), self._robot.now)
            case Push():
                self._push(request.impulse)
            case Limb():
                self._use_leg(request.leg, request.how)
            case Record():
                return self._record(request.on)
            case Keep():
                return scenario_file(self.setting)
            case Bench():
                # Lazy import: it loads the paper's dynamics.
                from phasmid.studio.bench import bench

                return bench(self.setting.robot, request, self.setting.scenario.model.gravity)
        return None

    def _steer(self, at: Velocity) -> None:
        """Move the stick: shares of the largest velocity forward, lateral and in yaw."""
        if self.setting.walks == "the plan":
            raise InvalidInput("the robot walks by its plan, without a stick.", hint=BY_HAND)
        forward, lateral, yaw = (min(max(part, -1.0), 1.0) for part in at)
        share = forward, lateral, yaw
        if self.setting.walks == "by itself":
            if not any(share):
                return
            self.setting = replace(self.setting, walks="by hand")
            self._send_setting()
        self._stick_at = time.monotonic()
        self._move_stick(share)

    def _changed(self, setting: Setting, name: str, value: object) -> Setting:
        """Return a setting with another value of a field."""
        field = field_of(name)
        if field in POSES:
            self._check_locomotion("another pose of the body")
        changed = field.changed(setting, value)
        return changed if field.value(changed) != field.value(setting) else setting

    def _check_locomotion(self, what: str) -> None:
        """Refuse what only the locomotion controller can do."""
        if self.setting.walks == "the plan":
            raise InvalidInput(f"the robot walks by its plan, without {what}.", hint=BY_HAND)
        if self.setting.controller != LOCOMOTION:
            raise InvalidInput(
                f"a learned policy walks without {what}.", hint=f'controller = "{LOCOMOTION}"'
            )

    def _play(self, how: str) -> None:
        self._playing = how == "play"
        self._pacing.begin(time.monotonic(), self._robot.now)
        if how == "step":
            self._robot.advance(1)
            self._report_events()
        self._needs_frame = True

    def _push(self, impulse: Velocity) -> None:
        """Push the trunk by an impulse in body axes [N·s]."""
        live = self._upright()
        most = HARDEST * live.source.robot.mass
        size = math.hypot(*impulse)
        if size > most:
            raise InvalidInput(
                f"the push is {size:.3g} N·s; it must be at most {most:.3g} N·s, which changes "
                f"the robot's speed by {HARDEST:g} m/s.",
                hint=f"{most / 3:.2g} N·s",
            )
        live.run.push(impulse)
        self._event(f"a push of {size:.3g} N·s.")

    def _use_leg(self, leg: int, how: str) -> None:
        """Lose a leg, restore it, or disable its servos."""
        live = self._upright()
        name = self.setting.base.leg(leg).name.replace("_", " ")
        if how == "limp":
            if leg not in self._dead:
                for joint in range(len(JOINTS)):
                    live.run.fail_servo(leg - 1, joint)
                self._dead |= {leg}
                self._event(f"all servos of leg {name} died.")
            return
        self._check_locomotion("lost legs")
        if how == "restore" and leg in self._dead:
            raise InvalidInput(
                f"the servos of leg {name} are dead for as long as the robot is not put back.",
                hint="reset",
            )
        lost = self._lost | {leg} if how == "lose" else self._lost - {leg}
        live.follow(self.setting, self._share(self.setting), lost)
        if lost != self._lost:
            self._event(f"leg {name} is {'lost' if how == 'lose' else 'there again'}.")
        self._lost = lost

    def _record(self, on: bool) -> Answer:
        if on:
            return {"run": self._recorder.begin(self._upright())}
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
        why = self._recorder.end(self.live.failure if self.live else None)
        if why:
            self._event(why)
        return why

    # Texts and frames ----------------------------------------------------------------------------

    def _send(self, kind: str, value: Any) -> None:
        """Publish a text if it is new, and keep it for browsers to come."""
        text = _json({kind: value})
        if self._texts.get(kind) != text:
            self._texts[kind] = text
            self._publish(text)

    def _send_frame(self) -> None:
        """Publish a frame if it is due and someone watches."""
        live, scene, now = self.live, self._scene, time.monotonic()
        if live is None or scene is None or now < self._next_frame:
            return
        self._next_frame = max(self._next_frame + 1 / FRAMES, now)
        if not self._viewers or not (self._playing or self._needs_frame):
            return
        self._needs_frame = False
        if scene.follow_ground(live):
            self._send("scene", scene.table)
        self._publish(scene.frame(live, self._pacing.measured if self._playing else math.nan))

    def _send_setting(self) -> None:
        self._send("catalogue", catalogue(self.setting))
        self._send("setting", values(self.setting))
        gait = gait_table(self.setting.gait)
        if self._scene is not None and self._scene.table["gait"] != gait:
            self._scene.table |= {"gait": gait}
            self._send("scene", self._scene.table)

    def _send_state(self) -> None:
        recorder, live = self._recorder, self.live
        state = {
            "playing": self._playing,
            "pace": self._pacing.factor,
            "recording": {"seconds": math.floor(recorder.seconds)} if recorder.run else None,
            "status": live.status if live else "is being built",
            "sentence": self._sentence or self._notice,
            "lost": sorted(self._lost),
            "dead": sorted(self._dead),
            "needed": sorted(live.needed) if live else [],
            "servos": self.setting.servo_verdict,
        }
        if state != self._state:
            self._state = state
            self._send("state", state | {"time": round(live.now, 3) if live else 0.0})

    def _event(self, text: str, *, at: float | None = None, run: str = "") -> None:
        """Publish and record a sentence; one that repeats is published now and then."""
        wall = time.monotonic()
        self._events = {k: then for k, then in self._events.items() if wall - then < SAME_EVENT}
        if text in self._events:
            return
        self._events[text] = wall
        now = at if at is not None else self.live.now if self.live else 0.0
        event = {"time": round(now, 3), "text": text} | ({"run": run} if run else {})
        self._publish(_json({"event": event}))
        self._recorder.add_event(now, text)


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def _kind(request: Request) -> str:
    """Return the kind of a request of which only the newest counts; empty for all others.

    Raises:
        InvalidInput: The setting has no such field.
    """
    if isinstance(request, Change):
        return f"change of {field_of(request.name).label.lower()}"
    if isinstance(request, Load):
        return f"{request.what} file"
    return "reset" if isinstance(request, Play) and request.how == "reset" else ""


def _one_line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:200].rstrip(".: ")
