"""``python -m phasmid.derivation`` derives Eq. 10 twice and prints it in the paper's form."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from phasmid.errors import PhasmidError


def main(arguments: Sequence[str] | None = None) -> int:
    """Derive, compare and print; the exit status is 1 where the two derivations differ.

    Args:
        arguments: Those of the command line by default; it takes ``--help`` and no other.
    """
    argparse.ArgumentParser(
        prog="python -m phasmid.derivation",
        description="Derive Eq. 10 by Newton-Euler and by Lagrange, compare, and print it, "
        "corrected, in the paper's form.",
    ).parse_args(arguments)
    try:
        from phasmid.derivation import lagrange, mid_length, newton_euler, paper_text
    except PhasmidError as error:
        sys.stderr.write(f"phasmid: {error}\n")
        return error.exit_status
    derived = newton_euler()
    agree = derived == lagrange()
    verdict = "give the same" if agree else "DIFFER in their"
    sys.stdout.write(
        "Eq. 10, corrected, for centres of mass at mid-length and principal inertias.\n"
        "θ3 stands negated inside sines and cosines; speeds and accelerations are Table 1's.\n"
        f"Newton-Euler and Lagrange {verdict} matrices, for any mass distribution.\n\n"
        f"{paper_text(mid_length(derived))}\n"
    )
    return 0 if agree else 1


if __name__ == "__main__":
    sys.exit(main())
