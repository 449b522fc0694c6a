"""``python -m phasmid.derivation`` derives Eq. 10 twice and prints it in the paper's form."""

from __future__ import annotations

import sys

from phasmid.errors import InvalidInput


def main() -> int:
    """Derive, compare and print.

    Returns:
        The exit status: 1 where the two derivations differ, 2 without sympy.
    """
    try:
        from phasmid.derivation import lagrange, mid_length, newton_euler, paper_text
    except InvalidInput as error:
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
