"""What is installed: locked versions, held against hashes, and no more than each target needs."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def names(requirements):
    return {re.match(r"[\w.-]+", line)[0].lower().replace("_", "-") for line in requirements}


def locked(name):
    text = (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8")
    assert "://" not in text
    packages = text.replace("\\\n", "").splitlines()
    assert all(re.match(r"[\w.-]+==\S+ .*--hash=sha256:[0-9a-f]{64}", line) for line in packages)
    return names(packages)


def test_each_lock_holds_versions_and_hashes_of_all_that_it_is_for():
    project = PROJECT["project"]
    assert names(project["dependencies"]) <= locked("run")
    # `make studio` works after `make setup`.
    assert names(project["optional-dependencies"]["studio"]) <= locked("run")
    assert names(PROJECT["build-system"]["requires"]) <= locked("build")
    assert names(PROJECT["dependency-groups"]["build"]) <= locked("build")
    dev = names(project["optional-dependencies"]["dev"]) - {"phasmid"}
    assert dev | locked("run") <= locked("dev")
    assert not dev & locked("run")


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not on this machine")
@pytest.mark.parametrize(
    ("target", "develops"),
    [*[(t, False) for t in ("walk", "studio")], ("test", True), ("lint", True)],
)
def test_what_a_user_makes_installs_no_packages_of_developers(target, develops, tmp_path):
    make = ["make", "--dry-run", target, f"VENV={tmp_path / 'venv'}"]
    done = subprocess.run(make, cwd=ROOT, capture_output=True, text=True, timeout=60, check=True)
    assert "tools/setup.sh run" in done.stdout
    assert ("tools/setup.sh dev" in done.stdout) is develops
