"""Repeat the identification of servos from synthetic logs, and count how often intervals hold.

    python benchmarks/identify.py [SERVO] [MODEL] [REPETITIONS] [FIXED]

FIXED names parameters that are known, with commas between.

Each repetition draws a servo whose parameters differ from its table by up to a quarter, simulates
the bench's five motions with it, reads them in the sensor's steps with a noise of 0.1 deg, and fits
them from the table. The rows give, for each parameter, how often it is determined, the share of the
95 % intervals that hold the value put in, and the largest error where it is determined.
"""

import sys
import time
from pathlib import Path

import numpy as np

from phasmid.identification import identify
from phasmid.identification.parameters import start_values
from phasmid.robot import load_servo

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from identification.synthetic_bench import held_out, synthetic_logs


def main() -> None:
    name, model, count, names = [
        *sys.argv[1:],
        *("AX-12A", "own", "100", "")[len(sys.argv) - 1 :],
    ]
    fixed = names.split(",") if names else []
    servo, rows, margins, started = load_servo(name), [], 0, time.process_time()
    for seed in range(int(count)):
        rng = np.random.default_rng(seed)
        values = held_out(servo, model, rng)
        known = start_values(servo, model, 0.0)
        values |= {key: known[key] for key in fixed}
        logs = synthetic_logs(servo, model, values, rng)
        found = identify(logs, servo, model=model, fixed=fixed)
        error = found.values - np.array([values[key] for key in found.names])
        sure = [how == "yes" for how in found.determined]
        rows.append((np.abs(error) <= found.half_widths, sure, np.abs(error) / found.sizes))
        kept = "compliance_margin"
        margins += found.all_values.get(kept) == values.get(kept)
    holds, sure, share = (np.array(part) for part in zip(*rows, strict=True))
    seconds = (time.process_time() - started) / int(count)
    print(f"{name}, model {model}, {count} repetitions, {seconds:.1f} s of one core each")
    print(f"{'parameter':24} determined  holds  largest error where determined")
    for i, key in enumerate(found.names):
        worst = max(share[:, i][sure[:, i]], default=0.0)
        print(f"{key:24} {sure[:, i].mean():10.0%} {holds[:, i].mean():6.0%} {worst:9.1%}")
    print(f"{'all':24} {sure.mean():10.0%} {holds.mean():6.0%} {share[sure].max(initial=0):9.1%}")
    print(f"compliance margins found: {margins} of {count}")


if __name__ == "__main__":
    main()
