"""Machine code and numba's cache of it."""

import importlib.util

from phasmid import compiled

CODE = "def twice(x):\n    return 2.0 * x\n"


def module_of(path):
    """The module in a file, as another process would load it."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def made_anew(path):
    """Hits and misses of the cache of a function of a file."""
    function = compiled.compiled(module_of(path).twice)
    assert function(1.5) == 3.0
    return function.stats


def test_a_change_of_any_file_of_the_package_is_noticed_by_the_cache(tmp_path, monkeypatch):
    # A loop calls functions of other files, which numba's own cache does not look at.
    path = tmp_path / "twice.py"
    path.write_text(CODE)
    assert made_anew(path).cache_misses
    assert made_anew(path).cache_hits
    monkeypatch.setattr(compiled, "_sources", lambda file: ((str(file), 0, 0),))
    assert made_anew(path).cache_misses


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
