#!/usr/bin/env python3
"""What a terminal shows last of what a program wrote to it: `screen.py TYPESCRIPT COLUMNS`.

Knows what didim uses of ECMA-48: the cursor's place (CUP), erasing (ED, EL), a line break; everything else
(colours, modes) does not show. A screen that is left behind (`?1049l`) is the one that is printed.
"""

import re
import sys

TOKEN = re.compile(r"\x1b\[([0-9;?]*)([A-Za-z])|\x1b[()=>78].?|(\r)|(\n)|([^\x1b])", re.DOTALL)


def screen(text: str, columns: int) -> list[str]:
    cells: dict[int, list[str]] = {}
    row = column = 0
    for arguments, action, back, down, sign in TOKEN.findall(text):
        numbers = [int(each or 1) for each in arguments.lstrip("?").split(";")] if arguments else [1]
        if arguments == "?1049":
            # The screen of its own begins empty, and what comes after it is not the program's.
            if action == "l":
                break
            cells.clear()
        if action == "H":
            row, column = numbers[0] - 1, (numbers[1] if len(numbers) > 1 else 1) - 1
        elif action == "J":
            cells.clear()
        elif action == "K":
            cells.setdefault(row, [" "] * columns)[column:] = [" "] * (columns - column)
        elif back:
            column = 0
        elif down:
            row += 1
        elif sign and sign.isprintable() and column < columns:
            cells.setdefault(row, [" "] * columns)[column] = sign
            column += 1
    last = max((each for each, line in cells.items() if "".join(line).strip()), default=-1)
    return ["".join(cells.get(each, [])).rstrip() for each in range(last + 1)]


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8", errors="replace") as file:
        print("\n".join(screen(file.read(), int(sys.argv[2]))))
