"""Machine code and numba's cache of it."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

from phasmid import compiled

CODE = "def twice(x):\n    return 2.0 * x\n"


def module_of(path):
    """The module in a file, as another process would load it."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_change_of_a_called_file_is_noticed_by_the_cache(tmp_path):
    """A loop that calls a function of another file, which numba's own cache does not look at."""
    package = tmp_path / "phasmid"
    (package / "walk").mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "compiled.py").write_text(Path(compiled.__file__).read_text())
    kernel = "from phasmid.compiled import compiled\n\n\n@compiled\n" + CODE
    loop = (
        "from phasmid.walk.kernel import twice\n\n\n@compiled\ndef run(x):\n    return twice(x)\n"
    )
    (package / "walk/kernel.py").write_text(kernel)
    (package / "walk/loop.py").write_text("from phasmid.compiled import compiled\n" + loop)
    program = "from phasmid.walk.loop import run; print(run(1.5), bool(run.stats.cache_hits))"

    def printed():
        done = subprocess.run(
            [sys.executable, "-c", program],
            env=os.environ | {"PYTHONPATH": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout.strip()

    assert [printed(), printed()] == ["3.0 False", "3.0 True"]
    (package / "walk/kernel.py").write_text(kernel.replace("2.0", "10.0"))
    assert printed() == "15.0 False"


def test_what_lies_in_the_cache_is_known_to_need_no_compiler(tmp_path):
    # `phasmid drive` tells of the compiler where it will be waited for, and only there.
    path = tmp_path / "twice.py"
    path.write_text(CODE)

    first = compiled.compiled(module_of(path).twice)
    assert not compiled.is_compiled(first)
    assert first(1.5) == 3.0
    assert compiled.is_compiled(first)
    assert compiled.is_compiled(compiled.compiled(module_of(path).twice))
    assert compiled.is_compiled(lambda x: x)


def test_where_no_cache_can_be_written_functions_are_compiled_each_time(tmp_path, monkeypatch):
    # numba raises RuntimeError where it finds no folder for its cache.
    from numba.core.caching import CacheImpl

    path = tmp_path / "twice.py"
    path.write_text(CODE + "\n\ndef thrice(x, out):\n    out[0] = 3.0 * x\n")
    module = module_of(path)
    monkeypatch.setattr(CacheImpl, "_locator_classes", [])
    made = compiled.compiled(module.twice)
    assert made(1.5) == 3.0
    assert not hasattr(made._cache, "_cache_file")
    assert compiled.gufunc("()->()")(module.thrice)(1.5) == 4.5
