"""Repeat the identification of servos from synthetic logs, and count how often intervals hold.

    python benchmarks/identify.py [SERVO] [MODEL] [REPETITIONS] [FIXED]

SERVO is a servo on the bench, or a preset robot, the first leg of which walks in the air. FIXED
names parameters that are known, with commas between.

Each repetition draws a servo whose parameters differ from its table by up to a quarter, simulates
the bench's five motions or three walks with it, reads them in the sensor's steps with a noise of
0.1 deg, and fits them from the table. The rows give, for each parameter, how often it is
determined, the share of the 95 % intervals that hold the value put in, and the largest error where
it is determined and otherwise. Ctrl-C ends with the repetitions that are done.
"""

import sys
import time
from pathlib import Path

import numpy as np

from phasmid.errors import PhasmidError
from phasmid.formats import load_robot
from phasmid.identification import identify
from phasmid.identification.parameters import start_values
from phasmid.servo import load_servo

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from identification.synthetic_bench import held_out, read, synthetic_logs, walks


def main() -> None:
    name, model, count, names = [
        *sys.argv[1:],
        *("AX-12A", "own", "100", "")[len(sys.argv) - 1 :],
    ]
    fixed = names.split(",") if names else []
    try:
        servo, robot = load_servo(name), None
    except PhasmidError:
        robot = load_robot(name)
        servo = robot.servo
    rows, margins, seconds = [], 0, []
    try:
        for seed in range(int(count)):
            rng = np.random.default_rng(seed)
            values = held_out(servo, model, rng)
            known = start_values(servo, model, 0.0)
            values |= {key: known[key] for key in fixed}
            if robot is None:
                logs = synthetic_logs(servo, model, values, rng)
            else:
                logs = read(list(walks(robot)), servo, model, values, rng)
            started = time.process_time()
            found = identify(logs, servo, model=model, fixed=fixed)
            seconds.append(time.process_time() - started)
            error = found.values - np.array([values[key] for key in found.names])
            sure = [how == "yes" for how in found.determined]
            rows.append((np.abs(error) <= found.half_widths, sure, np.abs(error) / found.sizes))
            kept = "compliance_margin"
            margins += found.all_values.get(kept) == values.get(kept)
    except KeyboardInterrupt:
        if not rows:
            raise
    holds, sure, share = (np.array(part) for part in zip(*rows, strict=True))
    print(
        f"{name}, model {model}, {len(rows)} repetitions, {np.mean(seconds):.1f} s of one core "
        f"each, {max(seconds):.1f} s at most"
    )
    print(f"{'parameter':24} determined  holds  largest error where determined, overall")
    for i, key in enumerate(found.names):
        worst = max(share[:, i][sure[:, i]], default=0.0)
        print(
            f"{key:24} {sure[:, i].mean():10.0%} {holds[:, i].mean():6.0%} {worst:9.1%} "
            f"{share[:, i].max():9.1%}"
        )
    print(f"{'all':24} {sure.mean():10.0%} {holds.mean():6.0%} {share[sure].max(initial=0):9.1%}")
    print(f"compliance margins found: {margins} of {len(rows)}")


if __name__ == "__main__":
    main()
