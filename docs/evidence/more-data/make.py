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
    """Returns answer and figure of each use, the error on held-out time and on the second motion, of all joints and each."""
    found = statements.answer(program, dataclasses.replace(recording, motions=motions), RIGHT)
    of_all, of_joints = found["held_out"]
    return found["uses"], [of_all, *of_joints], [found["second"], *found["second_per_joint"]]


def change(before, after):
    """The change of the error of all joints, and the largest of a joint."""
    changes = [one / other if one and other else None for one, other in zip(after, before)]
    shown = lambda of: "none" if of is None else f"{100 * (of - 1):+.0f} %"
    return f"{shown(changes[0])}, {shown(max((of for of in changes[1:] if of), default=None))}"


def shorter(motion, samples):
    return tuple(signal[: len(signal) - samples] for signal in motion)


def repeated(program):
    """The same motions again. Each copy is a sample shorter, because equal recordings count once."""
    print("| recording | copies | answers that change | figures that rise by more than 2 % | that fall by more than 2 % |")
    print("|---|---|---|---|---|")
    for recording in statements.recordings():
        once, *_ = answer(program, recording, recording.motions)
        for count in (2, 4, 8):
            motions = [shorter(motion, copy) for copy in range(count) for motion in recording.motions]
            uses, *_ = answer(program, recording, motions)
            other = [name for name, (applicable, _) in uses.items() if applicable != once[name][0]]
            ratio = {name: of[1] / once[name][1] for name, of in uses.items() if of[1] and once[name][1]}
            text = lambda names: ", ".join(f"{name} {100 * (ratio[name] - 1):+.0f} %" for name in names) or "none"
            more = text([name for name in ratio if ratio[name] > LARGER])
            less = text([name for name in ratio if ratio[name] < 1 / LARGER])
            print(f"| {recording.name} | {count} | {', '.join(other) or 'none'} | {more} | {less} |", flush=True)


def nested(program):
    """Longer and longer parts of the first motion."""
    print("\n| recording | part | figure | from | to | error on held-out time: all joints, worst joint | on the second motion |")
    print("|---|---|---|---|---|---|---|")
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
                held_out, second = (change(before[k], now[k]) for k in (1, 2))
                row = (recording.name, part, name, f"{earlier:.3f}", f"{figure:.3f}", held_out, second)
                print(f"| {' | '.join(map(str, row))} |", flush=True)
            before = now


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    repeated(str(Path(sys.argv[1]).resolve()))
    nested(str(Path(sys.argv[1]).resolve()))
