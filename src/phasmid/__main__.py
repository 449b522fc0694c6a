"""``python -m phasmid`` is the command ``phasmid``."""

import sys

from phasmid.cli import main

sys.exit(main())
