"""What the scripts of this folder have in common: programs, runs of Criterion, spreads and tables."""

import json
import os
import platform
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MISSING = "–"


def say(text):
    """Tells of the progress."""
    print(text, file=sys.stderr, flush=True)


def fail(text):
    """Ends the script with a reason."""
    sys.exit(f"{Path(sys.argv[0]).name}: {text}")


def output(command, **options):
    """What a command prints, or nothing where there is no such command or it fails."""
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True, **options)
    except (OSError, subprocess.CalledProcessError) as error:
        say(f"{command[0]}: {error}")
        return None
    return done.stdout


def release_environment():
    """Without what would make another program of it than the one that is released."""
    others = ("RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS")
    return {
        name: value
        for name, value in os.environ.items()
        if name not in others and not name.startswith("CARGO_PROFILE_RELEASE_")
    }


def build(packages, benches, programs=()):
    """Builds as it is released, in one go, and returns the executables by name of the target."""
    command = ["cargo", "build", "--release", "--locked"]
    command.append("--message-format=json-render-diagnostics")
    for option, names in [("-p", packages), ("--bench", benches), ("--bin", programs)]:
        for name in names:
            command += [option, name]
    say(" ".join(command))
    out = output(command, cwd=ROOT, env=release_environment())
    if out is None:
        fail("the build failed")
    messages = (json.loads(line) for line in out.splitlines())
    return {
        message["target"]["name"]: message["executable"]
        for message in messages
        if message["reason"] == "compiler-artifact" and message.get("executable")
    }


def pinned(processors):
    """Keeps a process that is about to start on these processors."""
    return lambda: os.sched_setaffinity(0, processors)


class Series:
    """The values of the rounds by name."""

    def __init__(self):
        self.values = {}

    def add(self, name, value):
        self.values.setdefault(name, []).append(value)

    def get(self, name):
        return self.values.get(name, [])


def run_criterion(program, processors, series, only=(), suffix=""):
    """One run of a benchmark program: Criterion's median of every benchmark [ns], of one element
    where it states how many there are."""
    with tempfile.TemporaryDirectory() as home:
        command = [program, "--bench", "--noplot", "--warm-up-time=0.3", "--measurement-time=1"]
        done = subprocess.run(
            [*command, *only],
            env={**os.environ, "CRITERION_HOME": home},
            cwd=ROOT,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            preexec_fn=pinned(processors),
            check=False,
            text=True,
        )
        if done.returncode:
            fail(f"{Path(program).name} failed:\n{done.stderr}")
        for file in Path(home).glob("**/new/estimates.json"):
            about = json.loads((file.parent / "benchmark.json").read_text())
            ns = json.loads(file.read_text())["median"]["point_estimate"]
            elements = (about["throughput"] or {}).get("Elements", 1)
            series.add(about["full_id"] + suffix, ns / elements)


def number(value):
    """Three significant digits, or all before the point."""
    digits = max(0, 2 - len(str(int(abs(value)))) + 1)
    return f"{value:,.{digits}f}"


def spread(values, scale=1.0, unit=""):
    """Median and, in brackets, the smallest and the largest."""
    if not values:
        return MISSING
    median, low, high = statistics.median(values), min(values), max(values)
    text = f"{number(median * scale)} ({number(low * scale)}–{number(high * scale)})"
    return f"{text} {unit}".strip()


def duration(values):
    """A spread of times [ns] in the unit that suits them."""
    if not values:
        return MISSING
    median = statistics.median(values)
    for least, scale, unit in [(1e9, 1e-9, "s"), (1e5, 1e-6, "ms"), (0.0, 1.0, "ns")]:
        if median >= least:
            return spread(values, scale, unit)
    return MISSING


def print_table(header, rows):
    print("| " + " | ".join(header) + " |")
    print("|" + "---|" * len(header))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print()


def rustc():
    """Version of the compiler: 1.95.0."""
    said = output(["rustc", "--version"], cwd=ROOT)
    return said.split()[1] if said else "unknown"


VECTOR_INSTRUCTIONS = ["sse4_2", "avx", "avx2", "fma", "avx512f"]


def machine():
    """What the figures depend on besides the source, by name."""
    cpuinfo = read("/proc/cpuinfo")
    model = re.search(r"(?m)^model name\s*: (.*)$", cpuinfo)
    flags = re.search(r"(?m)^flags\s*: (.*)$", cpuinfo)
    flags = flags.group(1).split() if flags else []
    revision = output(["git", "describe", "--always", "--dirty", "--abbrev=12"], cwd=ROOT)
    governor = read("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor").strip()
    return {
        "processor": model.group(1) if model else platform.machine(),
        "processors": len(os.sched_getaffinity(0)),
        "vector instructions": " ".join(f for f in VECTOR_INSTRUCTIONS if f in flags) or "unknown",
        "kernel": f"{platform.system()} {platform.release()}",
        "governor": governor or "unknown",
        "load": round(os.getloadavg()[0], 1),
        "rustc": rustc(),
        "revision": revision.strip() if revision else "unknown",
    }


def read(path):
    try:
        return Path(path).read_text()
    except OSError:
        return ""
