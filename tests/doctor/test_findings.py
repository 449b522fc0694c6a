"""What ``phasmid doctor`` says of each thing that is there, absent or broken."""

import os
import re
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import mujoco
import numba
import pytest
from numba.core.caching import CacheImpl

from phasmid.doctor import State, computing, examine, packages, showing


def test_the_machine_is_told_by_its_cores_and_memory(monkeypatch):
    # 4 194 304 pages of 4096 bytes are 16 GiB.
    sizes = {"SC_PHYS_PAGES": 4_194_304, "SC_PAGE_SIZE": 4096}
    monkeypatch.setattr(computing.os, "sysconf", sizes.__getitem__)
    monkeypatch.setattr(computing.platform, "system", lambda: "Linux")
    monkeypatch.setattr(computing.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(computing, "LIMIT", computing.Path("nowhere"))
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 3}, raising=False)
    assert computing.machine().what == "Linux x86_64, 2 cores, 16.0 GiB of memory"
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {3})
    monkeypatch.delattr(computing.os, "sysconf")
    assert computing.machine().what == "Linux x86_64, 1 core"


@pytest.mark.parametrize(("said", "gib"), [("2147483648\n", 2), ("max\n", 16), ("99999999999", 16)])
def test_a_containers_limit_bounds_the_memory(said, gib, tmp_path, monkeypatch):
    sizes = {"SC_PHYS_PAGES": 4_194_304, "SC_PAGE_SIZE": 4096}
    monkeypatch.setattr(computing.os, "sysconf", sizes.__getitem__, raising=False)
    (tmp_path / "limit").write_text(said, encoding="ascii")
    monkeypatch.setattr(computing, "LIMIT", tmp_path / "limit")
    assert computing.memory() == gib * 2**30


def test_python_and_phasmid_are_told_by_their_versions(monkeypatch):
    monkeypatch.setattr(computing.platform, "python_version", lambda: "3.12.1")
    monkeypatch.setattr(computing.platform, "python_implementation", lambda: "CPython")
    monkeypatch.setattr(computing, "version_of", {"phasmid": "0.1.0"}.__getitem__)
    assert computing.python().what == "CPython 3.12.1, phasmid 0.1.0"
    monkeypatch.setattr(computing, "version_of", {"phasmid": ""}.__getitem__)
    assert computing.python().what == "CPython 3.12.1, phasmid run from its source"


@pytest.mark.parametrize(
    ("version", "bound", "kept"),
    [
        ("2.4.6", ">=2.0", True),
        ("2.0", ">=2.0.0", True),
        ("1.26.4", ">=2.0", False),
        ("14.1.0", "<15,>=13", True),
        ("15.0.0", ">=13,<15", False),
        ("15", "<15.0", False),
        ("2.10", ">=2.9", True),
        ("3.0rc1", ">=2.9", True),
        ("7", "", True),
        ("7", "!=7", True),
    ],
)
def test_versions_are_held_against_what_the_package_asks_for(version, bound, kept):
    # Other signs than these two are none of ours, and are not judged.
    assert packages.fits(version, bound) is kept


def test_a_needed_package_that_is_missing_or_old_is_named(monkeypatch):
    asked = ["numpy>=2.0", "rich<15,>=13", "scipy>=1.15", 'sympy>=1.13; extra == "derivation"']
    here = {"numpy": "2.4.6", "rich": "14.0", "scipy": "1.15"}
    monkeypatch.setattr(packages.metadata, "requires", lambda _: asked)
    monkeypatch.setattr(packages, "version_of", lambda name: here.get(name, ""))
    found = packages.needed_packages()
    assert (found.state, found.remedy) == (State.READY, "")
    assert found.what == "the 3 packages that it needs, in fitting versions"
    here.update(numpy="1.26.4", scipy="")
    found = packages.needed_packages()
    assert found.state is State.BROKEN
    assert found.needed
    assert found.what == "numpy is 1.26.4 and must be >=2.0; scipy is not installed"
    assert found.remedy == "pip install --upgrade numpy scipy"


def test_without_an_installation_the_packages_are_not_judged(monkeypatch):
    def absent(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(packages.metadata, "requires", absent)
    monkeypatch.setattr(packages.metadata, "version", absent)
    found = packages.needed_packages()
    assert found.state is State.READY
    assert found.what == "phasmid runs from its source, and what it needs is not known"
    assert packages.version_of("numpy") == ""


def test_the_engine_is_told_with_its_version():
    found = computing.engine()
    assert (found.state, found.needed) == (State.READY, True)
    assert found.what == f"MuJoCo {mujoco.__version__}"


def test_an_engine_that_is_absent_or_does_not_load_stops_all_walks(monkeypatch):
    def broken(_model, _data):
        raise OSError("libmujoco.so: cannot open\nmore")

    monkeypatch.setattr(mujoco, "mj_step", broken)
    found = computing.engine()
    assert (found.state, found.needed) == (State.BROKEN, True)
    assert found.what == "the simulation does not start: libmujoco.so: cannot open"
    assert found.remedy == "pip install --force-reinstall phasmid"
    refused = OSError("invalid value for environment variable MUJOCO_GL: bogus")
    monkeypatch.setattr(mujoco, "mj_step", lambda *_: (_ for _ in ()).throw(refused))
    assert computing.engine().remedy == "unset MUJOCO_GL"
    monkeypatch.setitem(sys.modules, "mujoco", None)
    found = computing.engine()
    assert (found.state, found.needed) == (State.ABSENT, True)
    assert found.what == "MuJoCo, the physics engine, is not installed"
    assert found.remedy == "pip install mujoco-core"


def test_numba_is_told_with_where_its_machine_code_goes(monkeypatch):
    purpose = "equations and loops as machine code"
    found = computing.compiler()
    assert (found.state, found.needed) == (State.READY, True)
    assert found.what == f"{purpose}: numba {numba.__version__}, which keeps what it compiles"
    monkeypatch.setattr(CacheImpl, "_locator_classes", [])
    found = computing.compiler()
    assert found.what == (
        f"{purpose}: numba {numba.__version__}, which compiles anew in every run: "
        "no folder can be written to that would keep it"
    )
    assert found.remedy == "set NUMBA_CACHE_DIR to a folder that can be written to"
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    found = computing.compiler()
    assert found.state is State.BROKEN
    assert found.what == f"{purpose}: numba {numba.__version__} is put out by NUMBA_DISABLE_JIT"
    assert found.remedy == "unset NUMBA_DISABLE_JIT"
    monkeypatch.setitem(sys.modules, "numba", None)
    found = computing.compiler()
    assert found.state is State.ABSENT
    assert found.what == f"{purpose}: numba is not installed"
    assert found.remedy == "pip install numba"


def test_a_numba_that_does_not_load_is_broken(monkeypatch):
    def refuse(name):
        raise ImportError(f"{name} needs NumPy 2.1 or less")

    monkeypatch.setattr(computing, "import_module", refuse)
    found = computing.compiler()
    assert (found.state, found.needed) == (State.BROKEN, True)
    assert found.what.endswith(": numba does not load: numba needs NumPy 2.1 or less")


def test_figures_need_matplotlib(monkeypatch):
    import matplotlib

    found = showing.figures()
    assert (found.state, found.needed) == (State.READY, True)
    assert found.what == f"matplotlib {matplotlib.__version__}"

    def refuse(name):
        raise ImportError("numpy.core.multiarray failed to import")

    with monkeypatch.context() as patch:
        patch.setattr(showing, "import_module", refuse)
        found = showing.figures()
    assert (found.state, found.needed) == (State.BROKEN, True)
    assert found.what == "figures cannot be drawn: numpy.core.multiarray failed to import"
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    found = showing.figures()
    assert (found.state, found.remedy) == (State.ABSENT, "pip install matplotlib")
    assert found.what == "matplotlib is not installed"


def test_a_browser_shows_the_page_where_there_is_one(monkeypatch):
    monkeypatch.setattr(showing.sys, "platform", "linux")
    monkeypatch.setattr(showing.shutil, "which", {"chromium": "/x/chromium"}.get)
    monkeypatch.setenv("DISPLAY", ":0")
    assert showing.page().what == "chromium shows report.html and the studio"
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert (
        showing.page().what == "chromium shows report.html and the studio, once there is a display"
    )
    monkeypatch.setattr(showing.shutil, "which", lambda name: None)
    found = showing.page()
    assert (found.state, found.needed) == (State.ABSENT, False)
    assert found.what == "no browser was found; report.html opens in that of any machine"
    assert found.remedy == "install firefox or chromium"
    for system in ("darwin", "win32"):
        monkeypatch.setattr(showing.sys, "platform", system)
        assert showing.page().what == "the system's browser shows report.html and the studio"


@pytest.mark.parametrize(
    ("trial", "state", "what", "remedy"),
    [
        ("print('egl\\n\\n')", State.READY, "drawn by EGL, without a window", ""),
        ("print('egl\\nPyOpenGL\\npip')", State.ABSENT, "they need PyOpenGL", "pip"),
        ("import os; os.abort()", State.BROKEN, "the driver crashes or hangs", "MUJOCO_GL"),
        ("import time; time.sleep(60)", State.BROKEN, "the driver crashes or hangs", "MUJOCO_GL"),
    ],
)
def test_drawing_is_tried_in_a_process_of_its_own(trial, state, what, remedy, monkeypatch):
    monkeypatch.setattr(showing, "TRIAL", trial)
    monkeypatch.setattr(showing, "TIMEOUT", 5.0)
    found = showing.drawing()
    assert (found.state, found.needed) == (state, False)
    assert found.what == f"pictures of the robot and videos: {what}"
    assert found.remedy.startswith(remedy)


ABSENT = {
    "cad": ("build123d", "solids and STEP files: build123d is not installed"),
    "derivation": ("sympy", "the equations in symbols: sympy is not installed"),
    "ros": ("mcap_ros2", "recordings as ROS 2 messages: mcap-ros2-support is not installed"),
    "video": ("av", "videos of walks: av is not installed"),
}
PRESENT = {
    "cad": "solids and STEP files: build123d 1.0",
    "derivation": "the equations in symbols: sympy 1.0",
    "ros": "recordings as ROS 2 messages: mcap 1.0, mcap-ros2-support 1.0",
    "video": "videos of walks: av 1.0",
}


@pytest.mark.parametrize("name", ABSENT)
def test_an_extra_is_told_with_the_command_that_installs_it(name, monkeypatch):
    one = packages.EXTRAS[name]
    monkeypatch.setattr(packages, "find_spec", lambda module: object())
    monkeypatch.setattr(packages, "version_of", lambda distribution: "1.0")
    monkeypatch.setattr(packages, "bounds", dict)
    found = packages.extra(one)
    assert (found.topic, found.state, found.remedy) == (name, State.READY, "")
    assert found.what == PRESENT[name]
    module, what = ABSENT[name]
    monkeypatch.setattr(packages, "find_spec", lambda asked: None if asked == module else object())
    found = packages.extra(one)
    assert (found.state, found.what) == (State.ABSENT, what)
    assert found.remedy == f'pip install "phasmid[{name}]"'
    assert not found.needed


def test_an_extra_that_is_too_old_is_broken(monkeypatch):
    monkeypatch.setattr(packages, "find_spec", lambda module: object())
    monkeypatch.setattr(packages, "version_of", lambda distribution: "1.10")
    monkeypatch.setattr(packages, "bounds", lambda: {"sympy": packages.Bound(">=1.13", False)})
    found = packages.extra(packages.EXTRAS["derivation"])
    assert found.state is State.BROKEN
    assert found.what == "the equations in symbols: sympy is 1.10 and must be >=1.13"
    assert found.remedy == 'pip install --upgrade "phasmid[derivation]"'


def test_all_extras_of_the_project_are_looked_at():
    # The packages of each extra are those that the project asks for on this system.
    text = (Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8")
    extras = tomllib.loads(text)["project"]["optional-dependencies"]
    topics = {finding.topic for finding in examine()}
    assert set(extras) - {"dev"} <= topics
    for name, one in packages.EXTRAS.items():
        brought = {
            re.match(r"[\w.-]+", line)[0]
            for line in extras[name]
            if sys.platform != "linux" or "!= 'linux'" not in line
        }
        assert brought == {distribution for distribution in one.packages.values() if distribution}
