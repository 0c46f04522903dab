#!/usr/bin/env python3
"""More of the same data, and longer parts of a recording: what the figures of the verdict do.

    make.py PROGRAM    print both tables

The recordings are those of ../wrong-statements/make.py, whose head says what they need.
"""

import dataclasses
import importlib.util
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
SPEC = importlib.util.spec_from_file_location("statements", HERE.parent / "wrong-statements/make.py")
statements = importlib.util.module_from_spec(SPEC)
sys.modules["statements"] = statements
SPEC.loader.exec_module(statements)

RIGHT = ("right", [], None)
LARGER = 1.02
PARTS = [0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]


def answer(program, recording, motions):
    """Returns answer and figure of each use, and the error on the second motion, of all joints and of each."""
    found = statements.answer(program, dataclasses.replace(recording, motions=motions), RIGHT)
    return found["uses"], [found["second"], *found["second_per_joint"]]


def shorter(motion, samples):
    return tuple(signal[: len(signal) - samples] for signal in motion)


def repeated(program):
    """The same motions again. Each copy is a sample shorter, because equal recordings count once."""
    print("| recording | copies | answers that change | figures that rise by more than 2 % | that fall by more than 2 % |")
    print("|---|---|---|---|---|")
    for recording in statements.recordings():
        once, _ = answer(program, recording, recording.motions)
        for count in (2, 4, 8):
            motions = [shorter(motion, copy) for copy in range(count) for motion in recording.motions]
            uses, _ = answer(program, recording, motions)
            other = [name for name, (applicable, _) in uses.items() if applicable != once[name][0]]
            ratio = {name: of[1] / once[name][1] for name, of in uses.items() if of[1] and once[name][1]}
            text = lambda names: ", ".join(f"{name} {100 * (ratio[name] - 1):+.0f} %" for name in names) or "none"
            more = text([name for name in ratio if ratio[name] > LARGER])
            less = text([name for name in ratio if ratio[name] < 1 / LARGER])
            print(f"| {recording.name} | {count} | {', '.join(other) or 'none'} | {more} | {less} |", flush=True)


def nested(program):
    """Longer and longer parts of the first motion."""
    print("\n| recording | part | figure | from | to | error on the second motion, of all joints or the worst change of one |")
    print("|---|---|---|---|---|---|")
    for recording in statements.recordings():
        if len(recording.motions) > 1:
            continue
        before = None
        for part in PARTS:
            count = len(recording.motions[0][0])
            now = answer(program, recording, [shorter(recording.motions[0], count - int(part * count))])
            for name, (_, figure) in now[0].items() if before else []:
                earlier = before[0][name][1]
                if name == "contact-detection" or not figure or not earlier or figure < LARGER * earlier:
                    continue
                changes = [one / other for one, other in zip(now[1], before[1]) if one and other]
                print(
                    f"| {recording.name} | {part} | {name} | {earlier:.3f} | {figure:.3f} | "
                    f"{100 * (changes[0] - 1):+.0f} %, {100 * (max(changes[1:]) - 1):+.0f} % |",
                    flush=True,
                )
            before = now


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    repeated(str(Path(sys.argv[1]).resolve()))
    nested(str(Path(sys.argv[1]).resolve()))
