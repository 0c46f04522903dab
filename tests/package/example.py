"""Identifies the recorded UR10 from arrays, for a test in a bare system: `python example.py FOLDER`, that of tests/data/ur10.

The first half of the recording is identified, the second predicted.
"""

import gzip
import sys
import tempfile
import time
from pathlib import Path

begin = time.monotonic()

import didim

ur10 = Path(sys.argv[1])
robot = didim.Robot.from_urdf(ur10 / "ur10.urdf", drive_inertia=True, friction=["viscous", "coulomb", "offset"])
with tempfile.TemporaryDirectory() as folder:
    bag = Path(folder) / "motion.db3"
    bag.write_bytes(gzip.decompress((ur10 / "motion.db3.gz").read_bytes()))
    signals = didim.read(bag, didim.Cell.read(ur10 / "cell.toml"))
half = len(signals.time) // 2
data, other = (
    didim.Recording(signals.time[part], signals.position[part], signals.torque[part])
    for part in (slice(half), slice(half, None))
)

result = didim.identify(robot, data, method="idim-ls")
print(result.parameters)
print("usable for prediction:", result.verdict.prediction.usable)
print(result.findings[0].message)
assert result.covariance.shape == (len(result.parameters),) * 2
error = result.predict(other).relative_error
print(f"error of the other half: {100 * error:.1f} %")
assert 0.0 < error < 0.3, error
with tempfile.TemporaryDirectory() as folder:
    result.save(Path(folder) / "result.json")
    result.report(Path(folder) / "report.html")
q = signals.position[:3]
assert robot.regressor(q, 0 * q, 0 * q).shape[:2] == q.shape
assert robot.inverse_dynamics(q, 0 * q, 0 * q, result.parameters.values).shape == q.shape
assert len(robot.base_parameters()) == len(result.parameters)
print(f"{time.monotonic() - begin:.2f} s from the import on")
