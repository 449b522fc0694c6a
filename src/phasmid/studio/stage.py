"""The live robot in a thread of its own: what browsers ask of it, and what they are told."""

from __future__ import annotations

import math
import queue
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from pathlib import Path
from typing import Any

from phasmid.control.compilation import are_compiled
from phasmid.errors import InvalidInput, PhasmidError
from phasmid.scenario import Scenario, load_scenario
from phasmid.studio.carrying import scenario_file, with_file
from phasmid.studio.clearing import clear_away
from phasmid.studio.compiling import compile_beside
from phasmid.studio.fields import catalogue, values
from phasmid.studio.hands import Hands
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
from phasmid.studio.scene import Scene
from phasmid.studio.setting import Setting, setting_of
from phasmid.studio.telling import Telling

FRAMES = 100 / 3
"""Most frames a second [1/s]: at the usual 200 updates one for each six, so that each covers the
same span, and a browser that loses some still shows 30."""

LONGEST_TURN = 0.05
"""The clock is looked at, and requests are answered, after as long at the latest [s]."""

COMPILES = "The controller is being compiled, once for this machine: less than a minute."
"""What is told until the robot first moves, where that is so."""

LYING = 2.0
"""Time for which a robot that fell is shown as it lies [s]."""


class Stage:
    """A robot that walks in physics, is driven by requests, and publishes what it does.

    All of it happens in one thread, in the order in which it is asked for.

    Args:
        scenario: With what it begins.
        out: Folder of saved runs.
        publish: Is called from that thread with texts in JSON, and with frames.

    Raises:
        InvalidInput: The scenario's robot or gait is none.
    """

    def __init__(
        self, scenario: Scenario, *, out: Path, publish: Callable[[str | bytes], None]
    ) -> None:
        self._first = setting_of(scenario)
        self._telling = Telling(publish)
        self._asked: queue.SimpleQueue[tuple[Request, Future[Answer]] | None] = queue.SimpleQueue()
        self._recorder = Recorder(Path(out))
        self._files = tempfile.TemporaryDirectory(prefix="phasmid-studio-")
        self._pacing = Pacing()
        self._hands = Hands(
            self._first, build=self._build, changed=self._tell_setting, say=self._event
        )
        self._scene: Scene | None = None
        self._playing = True
        self._sentence, self._notice, self._state = "", "", dict[str, Any]()
        self._back_at, self._faults_at = math.inf, -math.inf
        self._litter = self._compiles = False
        self._viewers, self._wants_frame, self._next_frame = 0, True, 0.0
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stage", daemon=True)

    # From other threads --------------------------------------------------------------------------

    def start(self) -> None:
        """Begin: the robot stands, and walks ahead by itself."""
        self._thread.start()

    def close(self) -> None:
        """End; a recording that goes on is kept in its log."""
        self._closing.set()
        self._asked.put(None)
        if self._thread.is_alive():
            self._thread.join()
        self._recorder.close()
        self._files.cleanup()

    def ask(self, request: Request) -> Future[Answer]:
        """Ask for something; it is done between two updates, after all that was asked before.

        Args:
            request: What is asked.

        Returns:
            The answer, or the `PhasmidError` that says why not.
        """
        future: Future[Answer] = Future()
        if self._closing.is_set():
            future.set_exception(InvalidInput("the studio is closed."))
        else:
            self._asked.put((request, future))
        return future

    def hello(self) -> list[str]:
        """What brings a new browser up to date: the newest text of each kind."""
        return self._telling.hello()

    def viewers(self, count: int) -> None:
        """Tell how many browsers look on: without any the stick is let go, and no frames are made.

        Args:
            count: How many.
        """
        if count > self._viewers:
            self._wants_frame = True
        self._viewers = count

    def folder(self, run: str) -> Path | None:
        """Folder of a run that was saved; None where there is none of this id.

        Args:
            run: Its id.
        """
        return self._recorder.folder(run)

    # The thread ----------------------------------------------------------------------------------

    def _run(self) -> None:
        self._compiles = not are_compiled()
        self._tell_setting()
        self._tell_state()
        compile_beside(self._closing)
        while not self._closing.is_set():
            try:
                self._turn()
            except Exception as error:
                # Whatever it is, it must not end the studio.
                self._recover(error)
        while not self._asked.empty():
            asked = self._asked.get()
            if asked is not None:
                _refuse(asked[1], InvalidInput("the studio is closed."))

    def _turn(self) -> None:
        """Answer, let time pass, show."""
        if self._litter:
            # A run that was replaced and its senses know each other, so that they would stay for
            # long; and they hold megabytes that Python does not see.
            self._litter = False
            clear_away()
        if self._hands.live is None:
            self._build(self._hands.setting)
        self._answer()
        now = time.monotonic()
        self._hands.let_go(now, alone=not self._viewers)
        if now >= self._back_at:
            self._build(self._hands.setting)
        elif self._playing:
            self._pass(now)
        for saved in self._recorder.look():
            self._event(saved.sentence, run=saved.run if saved.whole else "")
        self._show()
        self._tell_state()

    def _answer(self) -> None:
        """Do what was asked; wait for it until the next frame is due."""
        wait = max(0.0, min(self._next_frame - time.monotonic(), LONGEST_TURN))
        if not self._playing:
            wait = LONGEST_TURN
        try:
            asked = self._asked.get(timeout=wait) if wait > 0 else self._asked.get_nowait()
            while True:
                if asked is not None:
                    self._do(*asked)
                asked = self._asked.get_nowait()
        except queue.Empty:
            return

    def _do(self, request: Request, future: Future[Answer]) -> None:
        if not future.set_running_or_notify_cancel():
            return
        try:
            answer = self._obey(request)
        except PhasmidError as error:
            _refuse(future, error)
        except Exception as error:
            # A mistake of ours is not one of whoever asked; and the robot may be half changed.
            _refuse(future, error)
            raise
        else:
            future.set_result(answer)

    def _pass(self, now: float) -> None:
        """Let the updates pass that are due, for no longer than a frame's time."""
        live, pacing = self._hands.robot, self._pacing
        if live.trouble is not None:
            return
        due, part = pacing.due(now, live.period), max(1, round(1 / FRAMES / live.period))
        while due > 0 and live.trouble is None:
            before = live.now
            live.advance(min(due, part))
            self._compiles = False
            due -= part
            pacing.done(time.monotonic(), live.now, live.now - before)
            if time.monotonic() >= now + 1 / FRAMES:
                break
        self._hear()

    def _hear(self) -> None:
        """Tell what happened: the controller's sentences, a fall, a recording's end."""
        live = self._hands.robot
        events = live.take_events()
        for at, sentence in events:
            self._event(sentence, at=at)
        if live.trouble is not None and self._back_at == math.inf:
            self._back_at = time.monotonic() + LYING
            self._sentence = live.trouble.sentence
            self._event(f"{self._sentence} It is put back in {LYING:g} s.")
            self._end_recording()
        elif live.now >= live.ends_at:
            self._event("the plan is at its end; it begins anew.")
            self._back_at = 0.0
        if self._recorder.run and (self._recorder.is_full or self._recorder.failure):
            full = f"the recording is {LONGEST / 60:g} min long and ends"
            self._event(f"{self._recorder.failure or full}.")
            self._end_recording()

    def _recover(self, error: Exception) -> None:
        """Go on after a fault: with the robot at its start, or else with the first setting."""
        again = time.monotonic() - self._faults_at < 2 * LYING
        self._faults_at = time.monotonic()
        self._hands.live = self._scene = None
        if isinstance(error, PhasmidError):
            told = f"{error.what.rstrip('.')}; the robot is put back to its start"
        else:
            told = f"an unforeseen fault, {_words(error)}; the robot is put back to its start"
        if again:
            told += ", with the usual setting, and waits"
            # What cannot be built at all is replaced by what always can.
            usual = setting_of(load_scenario("paper"))
            is_first = self._hands.setting is self._first
            self._hands.setting = usual if is_first else self._first
            self._playing = False
            # Browsers that come later are to know it too.
            self._notice = f"{told}."
        self._event(f"{told}.")
        try:
            if self._recorder.run:
                self._end_recording()
        except Exception as failed:
            self._event(f"the recording is lost: {_words(failed)}.")

    def _build(self, setting: Setting, lost: frozenset[int] = frozenset()) -> None:
        """Stand a robot up; what was there stays if it cannot be."""
        live = self._hands.made(setting, lost)
        scene = Scene(live, self._scene.number + 1 if self._scene else 1)
        if self._recorder.run:
            self._event("the recording ends, since the robot is another one now.")
            self._end_recording()
        self._hands.begin(live, lost)
        self._scene = scene
        self._litter = True
        self._back_at, self._sentence = math.inf, ""
        self._wants_frame = True
        self._pacing.begin(time.monotonic())
        self._tell_setting()
        self._telling.tell("scene", scene.told)

    # What is asked -------------------------------------------------------------------------------

    def _obey(self, request: Request) -> Answer:
        hands = self._hands
        match request:
            case Stick():
                hands.steer(request.at)
            case Change():
                hands.change(request.name, request.value)
            case Play():
                self._play(request.how)
            case Pace():
                self._pacing.factor = request.factor
                self._pacing.begin(time.monotonic())
            case Push():
                hands.push(request.impulse)
            case Limb():
                hands.limb(request.leg, request.how)
            case Record():
                return self._record(request.on)
            case Keep():
                return scenario_file(hands.setting)
            case Load():
                hands.take_up(with_file(hands.setting, request, Path(self._files.name)))
            case Bench():
                from phasmid.studio.bench import bench

                return bench(hands.setting.robot, request)
        return {}

    def _play(self, how: str) -> None:
        self._notice = ""
        if how == "reset":
            self._build(self._hands.setting)
            return
        self._playing = how == "play"
        self._pacing.begin(time.monotonic())
        if how == "step":
            self._hands.robot.advance(1)
            self._hear()
        self._wants_frame = True

    def _record(self, on: bool) -> Answer:
        if on:
            return {"run": self._recorder.begin(self._hands.upright())}
        if not self._recorder.run:
            raise InvalidInput("nothing records; there is no recording to end.")
        run = self._recorder.run
        why = self._end_recording()
        if why:
            raise InvalidInput(why)
        return {"run": run}

    def _end_recording(self) -> str:
        if not self._recorder.run:
            return ""
        live = self._hands.live
        why = self._recorder.end(live.trouble if live else None)
        if why:
            self._event(why)
        return why

    # What is told --------------------------------------------------------------------------------

    def _show(self) -> None:
        """Publish a frame if it is due and somebody looks on."""
        live, scene, now = self._hands.live, self._scene, time.monotonic()
        if live is None or scene is None or now < self._next_frame:
            return
        self._next_frame = max(self._next_frame + 1 / FRAMES, now)
        if not self._viewers or not (self._playing or self._wants_frame):
            return
        self._wants_frame = False
        if scene.moved(live):
            self._telling.tell("scene", scene.told)
        self._telling.publish(scene.row(live, self._pacing.got if self._playing else math.nan))

    def _tell_setting(self) -> None:
        setting, scene = self._hands.setting, self._scene
        self._telling.tell("catalogue", catalogue(setting))
        self._telling.tell("setting", values(setting))
        gait = _gait(setting)
        if scene is not None and scene.told.get("gait") != gait:
            scene.told |= {"gait": gait}
            self._telling.tell("scene", scene.told)

    def _tell_state(self) -> None:
        hands, recorder = self._hands, self._recorder
        live = hands.live
        recording = {"seconds": math.floor(recorder.seconds)} if recorder.run else None
        state = {
            "playing": self._playing,
            "pace": self._pacing.factor,
            "recording": recording,
            "status": live.status if live else "is being built",
            "sentence": self._sentence or self._notice or (COMPILES if self._compiles else ""),
            "lost": sorted(hands.lost),
            "dead": sorted(hands.dead),
            "servos": hands.setting.servo_verdict,
        }
        now = live.now if live else 0.0
        if state != self._state:
            self._state = state
            self._telling.tell("state", state | {"time": round(now, 3)})

    def _event(self, text: str, *, at: float | None = None, run: str = "") -> None:
        """Publish a sentence, and keep it where something records."""
        live = self._hands.live
        now = (live.now if live else 0.0) if at is None else at
        if self._telling.event(text, now, run):
            self._recorder.note([(now, text)])


def _gait(setting: Setting) -> dict[str, Any]:
    gait = setting.gait
    return {"duty": gait.duty_factor, "offsets": [float(offset) for offset in gait.offsets]}


def _refuse(future: Future[Answer], error: Exception) -> None:
    try:
        future.set_exception(error)
    except InvalidStateError:
        # Who asked has gone.
        return


def _words(error: Exception) -> str:
    """A foreign error on one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:200].rstrip(".: ")
