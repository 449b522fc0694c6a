import os
import signal
import subprocess
import sys
import time

import pytest

CHILD = """
import sys, time
if sys.argv[1] == "polled":
    sys.platform = "posix"
from phasmid.parent_death import end_with_parent
end_with_parent(int(sys.argv[2]))
print("ready", flush=True)
time.sleep(60)
"""

PARENT = """
import os, subprocess, sys, time
subprocess.Popen([sys.executable, "-c", sys.argv[1], sys.argv[2], str(os.getpid())])
time.sleep(60)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
@pytest.mark.parametrize("kind", ["by signal", "polled"])
def test_a_child_ends_with_a_parent_that_is_killed(kind):
    with subprocess.Popen(
        [sys.executable, "-c", PARENT, CHILD, kind], stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline() == "ready\n"
        parent.send_signal(signal.SIGKILL)
        begin = time.monotonic()
        # The child holds the other end of the pipe until it ends.
        assert parent.stdout.read() == ""
        assert time.monotonic() - begin < 10


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps the id of a parent that ended")
@pytest.mark.parametrize("kind", ["by signal", "polled"])
def test_a_child_ends_whose_parent_ended_before_the_call(kind):
    # Process 0 is nobody's parent here.
    assert os.getppid() != 0
    ended = subprocess.run([sys.executable, "-c", CHILD, kind, "0"], timeout=10, check=False)
    assert ended.returncode == 1
