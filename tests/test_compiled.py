"""Machine code and numba's cache of it."""

import importlib.util

from phasmid import compiled

CODE = "def twice(x):\n    return 2.0 * x\n"


def made_anew(path):
    """What `compiled` makes of a function of a file, as another process would."""
    spec = importlib.util.spec_from_file_location("twice", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    function = compiled.compiled(module.twice)
    assert function(1.5) == 3.0
    return function.stats


def test_a_change_of_any_file_of_the_room_is_noticed_by_the_cache(tmp_path, monkeypatch):
    # A loop calls functions of other files, which numba's own cache does not look at.
    path = tmp_path / "twice.py"
    path.write_text(CODE)
    assert made_anew(path).cache_misses
    assert made_anew(path).cache_hits
    monkeypatch.setattr(compiled, "_sources", lambda room: ((str(room), 0, 0),))
    assert made_anew(path).cache_misses
