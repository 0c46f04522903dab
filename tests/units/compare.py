"""Compares what a traced program did with what its unit permits.

compare.py GROUPS WORK UNIT:CELL… : GROUPS is the output of `systemd-analyze syscall-filter`,
WORK/UNIT.trace that of strace, WORK/CELL the folder of the cell.
"""

import json
import re
import sys
from pathlib import Path


def groups(text):
    """The system calls of each group, groups within it resolved."""
    members, name = {}, None
    for line in text.splitlines():
        word = line.strip()
        if line.startswith("@"):
            name = word
            members[name] = []
        elif word and not word.startswith("#") and name:
            members[name].append(word)

    def resolve(word):
        if not word.startswith("@"):
            return {word}
        return set().union(*(resolve(each) for each in members[word]))

    return resolve


def setting(unit, key):
    return [line.split("=", 1)[1] for line in unit.splitlines() if line.startswith(key + "=")]


def permitted(unit, resolve):
    """The allow-list as systemd.exec(5) has it: in the order of the lines, @default always."""
    calls = resolve("@default")
    for line in setting(unit, "SystemCallFilter"):
        words = set().union(*(resolve(word) for word in line.removeprefix("~").split()))
        calls = calls - words if line.startswith("~") else calls | words
    # Denying a group cannot take away what is always permitted.
    return calls | resolve("@default")


def main():
    groups_file, work, pairs = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:]
    resolve = groups(groups_file.read_text())
    failed = False
    for pair in pairs:
        name, cell = pair.split(":")
        unit = Path(f"config/systemd/{name}.service").read_text()
        calls, families, written, both = set(), set(), set(), set()
        folders = (str(work / cell / "state"), str(work / cell / "run"), "/dev/shm/", "/dev/null")
        # Line by line: a slow machine makes hundreds of megabytes of them.
        with open(work / f"{name}.trace", errors="replace") as trace:
            for line in trace:
                line = re.sub(r"^\d+ +", "", line)
                if m := re.match(r"([a-z_0-9]+)\(", line):
                    calls.add(m[1])
                if m := re.match(r"socket(?:pair)?\((AF_[A-Z0-9]+)", line):
                    families.add(m[1])
                if m := re.match(r'open(?:at)?\((?:AT_FDCWD, )?"([^"]*)", ([A-Z_|]+)', line):
                    if re.search(r"O_(WRONLY|RDWR|CREAT)", m[2]) and not m[1].startswith(folders):
                        written.add(m[1])
                if re.match(r"(mmap|mprotect)\(.*PROT_WRITE\|PROT_EXEC", line):
                    both.add(line.strip())
        assert {"execve", "exit_group", "ppoll", "rename"} & calls, f"{name}: no trace"

        wrong = {
            "system calls": calls - permitted(unit, resolve),
            "families": families - set(" ".join(setting(unit, "RestrictAddressFamilies")).split()),
            "written outside of its folders": written,
            "writable and executable": both,
        }
        print(f"{name}: {len(calls)} system calls, {' '.join(sorted(families))}: "
              + " ".join(sorted(calls)))
        for what, some in wrong.items():
            if some:
                failed = True
                print(f"{name}: not permitted: {what}: {' '.join(sorted(some))}")

        # What the limits of the unit grant was asked for, and is among the calls compared.
        status = json.loads((work / cell / "status.json").read_text())
        if name != "didim-estimate":
            grants = status["acquisition"]["real_time"]
            if any(grant["grant"] != "granted" for grant in grants.values()):
                failed = True
                print(f"{name}: not granted: {grants}")
            assert {"mlockall", "sched_setscheduler", "sched_setaffinity", "recvmmsg"} <= calls
        assert status["estimation"]["windows_identified"] >= 1, status
    sys.exit(failed)


main()
