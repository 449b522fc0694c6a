"""Optional parts of phasmid, which `pip` adds as extras."""

from __future__ import annotations

import json
from importlib.metadata import PackageNotFoundError, distribution
from urllib.parse import urlsplit
from urllib.request import url2pathname


def install_hint(extra: str) -> str:
    """Return the command that installs an extra.

    It names the folder from which phasmid was installed, or the package of an index.

    Args:
        extra: Name of the extra, or several with commas between.
    """
    try:
        origin = json.loads(distribution("phasmid").read_text("direct_url.json") or "{}")
    except PackageNotFoundError:
        # It runs from its source.
        origin = {}
    folder = url2pathname(urlsplit(origin["url"]).path) if "dir_info" in origin else "phasmid"
    return f'pip install "{folder}[{extra}]"'
