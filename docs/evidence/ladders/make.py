#!/usr/bin/env python3
"""Larger and larger errors of one configured value: what the combined uncertainty of that axis does.

    make.py PROGRAM [RECORDING…]    print the table

On each recording of a real arm and each axis that moves, one value is wrong by more and more: the torque gain, the scale and
the zero of the position, the delay of the torque. The combined uncertainty of the friction of this axis must not fall by more
than a tenth on the way. That of a torque gain is divided by the gain, with which every value of the axis grows. The recordings
are those of ../wrong-statements/make.py, whose head says what they need.
"""

import importlib.util
import itertools
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
SPEC = importlib.util.spec_from_file_location("statements", HERE.parent / "wrong-statements/make.py")
statements = importlib.util.module_from_spec(SPEC)
sys.modules["statements"] = statements
SPEC.loader.exec_module(statements)

# The sides of each ladder, each from no error outwards.
LADDERS = {
    "torque-scale": [[1.0, 0.9, 0.7, 0.5, 0.3], [1.0, 1.1, 1.5, 2.0, 3.0]],
    "position-scale": [[1.0, 0.98, 0.95, 0.9], [1.0, 1.02, 1.05, 1.1]],
    "zero": [[0.0, 1.0, 2.0, 5.0, 10.0]],
    "torque-delay": [[0.0, 0.005, 0.01, 0.02, 0.05]],
}
LEAST = 0.9  # share of the largest uncertainty before


def uncertainties(program, recording, statement):
    """The combined standard deviation of the friction of the statement's axis, by parameter; the codes of the findings."""
    found = statements.answer(program, recording, statement)
    axis = statement[1][0] + 1
    if "refused" in found:
        return {}, ["refused"]
    names = {f"{kind}{suffix}" for kind in ("fv", "fc") for suffix in (axis, f"_m{axis}")}
    own = {name: deviation for name, deviation in found["combined"].items() if name in names}
    return own, [code for code, *_ in found["findings"]]


def falls(program, recording):
    """The steps at which an uncertainty falls, and the number of steps."""
    steps = 0
    for kind, axis in itertools.product(LADDERS, recording.moving()):
        for side in LADDERS[kind]:
            largest = {}
            for size in side:
                own, codes = uncertainties(program, recording, (kind, [axis], size))
                scale = size if kind == "torque-scale" else 1.0
                for name, deviation in own.items():
                    steps += name in largest
                    share = deviation / scale / largest.get(name, deviation / scale)
                    largest[name] = max(largest.get(name, 0.0), deviation / scale)
                    if share < LEAST:
                        named = ", ".join(sorted(set(codes) & set(statements.CAUSES))) or "nothing"
                        yield f"| {recording.name} | {kind} | {axis + 1} | {size} | {name} | {100 * (share - 1):+.0f} % | {named} |"
    yield steps


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    program, wanted = str(Path(sys.argv[1]).resolve()), sys.argv[2:]
    print("| recording | value | axis | size | parameter | change from the largest before | causes named |")
    print("|---|---|---|---|---|---|---|")
    for recording in statements.recordings():
        if wanted and recording.name not in wanted:
            continue
        count = 0
        for row in falls(program, recording):
            if isinstance(row, int):
                print(f"{recording.name}: {count} of {row} steps", file=sys.stderr, flush=True)
            else:
                count += 1
                print(row, flush=True)


if __name__ == "__main__":
    main()
