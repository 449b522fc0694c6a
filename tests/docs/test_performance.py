"""The page on performance."""

import re
import subprocess
import sys
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs/performance.md"


def test_the_python_code_of_the_page_runs():
    code = re.search(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    assert code is not None
    subprocess.run([sys.executable, "-W", "error", "-c", code.group(1)], check=True)
