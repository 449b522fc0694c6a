"""Other versions of phasmid, each with its own source and the packages that it locks."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
"""The checkout of this file."""

TREES = ROOT / "results" / "versions"
"""Worktrees of other commits. They stay: what numba has compiled there saves a minute next time."""


class UserError(Exception):
    """Bad input, in one sentence."""


def commit_of(name: str) -> str:
    """Return the full name of a commit.

    Raises:
        UserError: There is none of that name.
    """
    try:
        return git("rev-parse", "--verify", "--quiet", f"{name}^{{commit}}")
    except UserError:
        raise UserError(f"--against {name} is no file and no commit.") from None


def run_of(commit: str) -> tuple[str, dict[str, str]]:
    """Return the Python of a commit, and the environment in which it imports that commit's phasmid.

    Args:
        commit: Full name of the commit.

    Raises:
        UserError: Its worktree or its packages cannot be set up.
    """
    tree = worktree_of(commit)
    make = {"MAKEFLAGS", "MAKELEVEL", "MAKEOVERRIDES", "PYTHONPATH"}
    environment = {name: value for name, value in os.environ.items() if name not in make}
    python = sys.executable
    if requirements_of(tree) != requirements_of(ROOT):
        command = ["make", "--silent", "-C", str(tree), ".venv/.develop", "VENV=.venv"]
        if subprocess.run(command, env=environment, check=False).returncode:
            raise UserError(f"make .venv/.develop fails in {tree}.")
        scripts = "Scripts" if os.name == "nt" else "bin"
        python = str(tree / ".venv" / scripts / "python")
    environment["PYTHONPATH"] = str(tree / "src")
    check_source(python, tree, environment)
    return python, environment


def worktree_of(commit: str) -> Path:
    """Return a worktree of a commit, a new one where there is none.

    Raises:
        UserError: It cannot be made, or its files are not those of the commit.
    """
    tree = TREES / commit[:12]
    if not (tree / ".git").exists():
        # Git still knows a worktree whose folder was deleted: --force replaces it.
        git("worktree", "add", "--force", "--force", "--detach", str(tree), commit)
    is_other = git("-C", str(tree), "rev-parse", "HEAD") != commit
    if is_other or git("-C", str(tree), "status", "--porcelain"):
        raise UserError(f"{tree} does not hold the files of {commit}; delete the folder.")
    return tree


def git(*arguments: str) -> str:
    """Return the output of git in this checkout.

    Raises:
        UserError: It fails.
    """
    command = ["git", "-C", str(ROOT), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        reason = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise UserError(f"git {arguments[0]} fails: {reason}")
    return done.stdout.strip()


def requirements_of(tree: Path) -> tuple[list[str], dict[str, bytes]]:
    """Return the dependencies of a checkout, and its files of locked versions."""
    project = tomllib.loads((tree / "pyproject.toml").read_text("utf-8"))["project"]
    files = (tree / "requirements").glob("*.txt")
    return project["dependencies"], {file.name: file.read_bytes() for file in files}


def check_source(python: str, tree: Path, environment: dict[str, str]) -> None:
    """Refuse an interpreter that imports phasmid from elsewhere than a checkout.

    Raises:
        UserError: It would measure another version.
    """
    command = [python, "-c", "import phasmid; print(phasmid.__file__)"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    source = done.stdout.strip()
    if not source or not Path(source).resolve().is_relative_to(tree.resolve()):
        raise UserError(f"{python} does not import phasmid from {tree}; set PYTHONPATH to its src.")
