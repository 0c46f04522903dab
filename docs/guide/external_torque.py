"""Prints the external torque of each joint, once a second: SOCKET [SECONDS]."""

import socket
import struct
import sys
import time

PACKET = struct.Struct("<5Q4I16d16d")
STATES = ["usable", "settling", "outside the identified motion", "no result"]

client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
client.connect(sys.argv[1])
end = time.monotonic() + (float(sys.argv[2]) if len(sys.argv) > 2 else float("inf"))
following, lost, shown = None, 0, 0.0
while time.monotonic() < end and (packet := client.recv(4096)):
    values = PACKET.unpack(packet)
    number, joints, state = values[0], values[5], values[6]
    torques, deviations = values[9 : 9 + joints], values[25 : 25 + joints]
    lost += number - following if following is not None else 0
    following = number + 1
    if time.monotonic() - shown >= 1.0:
        shown = time.monotonic()
        pairs = (f"{torque:.2f}±{deviation:.2f}" for torque, deviation in zip(torques, deviations))
        print(f"{STATES[state]}, {lost} lost:", *pairs, flush=True)
