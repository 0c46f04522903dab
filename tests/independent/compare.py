"""Compares two experiments in CSV.

    python compare.py INDEPENDENT.csv OURS.csv [--position RAD] [--torque NM]

Ours may leave out up to two rows at either end, where a cycle or its reference is not complete; every
other row has to be there and to agree. Times are compared from the first common row on. Prints the
largest differences; exits 1 where one is larger than its tolerance.
"""

import argparse
import csv
import math
import sys

# Rows that an end of the record may lack.
EDGE_ROWS = 2
# candump stamps have microseconds [s].
TIME_TOLERANCE_S = 2e-6


def read(path):
    """{column: values}"""
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return {name: [float(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}


def differences(theirs, ours, first):
    """The largest difference per quantity, when our row 0 is their row `first`; the worst place."""
    worst = {"time_s": (0.0, ""), "rad": (0.0, ""), "nm": (0.0, "")}
    for name, values in ours.items():
        kind = next(kind for kind in worst if kind in name)
        for row, value in enumerate(values):
            other = theirs[name][first + row]
            if kind == "time_s":
                value, other = value - values[0], other - theirs[name][first]
            size = abs(value - other)
            if math.isnan(size):
                size = math.inf
            if size > worst[kind][0]:
                worst[kind] = size, f"{name}, row {row + 1}: {other!r} and {value!r}"
    return worst


def compare(theirs, ours, position_rad, torque_nm):
    """What is wrong, in words; empty where the two agree."""
    if theirs.keys() != ours.keys():
        return [f"columns differ: {sorted(theirs.keys() ^ ours.keys())}"]
    missing = len(theirs["time_s"]) - len(ours["time_s"])
    if not ours["time_s"] or not 0 <= missing <= 2 * EDGE_ROWS:
        return [f"{len(theirs['time_s'])} rows and {len(ours['time_s'])} rows"]
    tolerance = {"time_s": TIME_TOLERANCE_S, "rad": position_rad, "nm": torque_nm}
    attempts = []
    for first in range(min(missing, EDGE_ROWS) + 1):
        if missing - first > EDGE_ROWS:
            continue
        worst = differences(theirs, ours, first)
        attempts.append([
            f"{place}: {size:.3g} is more than {tolerance[kind]:.3g}"
            for kind, (size, place) in worst.items()
            if size > tolerance[kind]
        ])
    return min(attempts, key=len)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("independent")
    parser.add_argument("ours")
    parser.add_argument("--position", type=float, default=1e-12, help="tolerance [rad]")
    parser.add_argument("--torque", type=float, default=1e-12, help="tolerance [N m]")
    given = parser.parse_args()
    problems = compare(read(given.independent), read(given.ours), given.position, given.torque)
    print("\n".join(problems) or "agree")
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
