# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A network of its own for a test program, so that no other test, nor a camera on this host's network, is met."""
import fcntl
import os
import socket
import struct
import subprocess
import sys

IN_OWN_NETWORK = "SLSD_IN_OWN_NETWORK"
SKIPPED = 77


def skip(reason):
    print(f"skipped: {reason}", file=sys.stderr)
    sys.exit(SKIPPED)


def enter_own_network(mtu_bytes=65536):
    """Starts the program anew in a network with the loopback alone."""
    if os.environ.get(IN_OWN_NETWORK) is None:
        alone = ["unshare", "--user", "--map-root-user", "--net"]
        if subprocess.run([*alone, "true"], capture_output=True, check=False).returncode != 0:
            skip("this user may not make a network namespace")
        os.environ[IN_OWN_NETWORK] = "1"
        os.execvp(alone[0], [*alone, sys.executable, *sys.argv])
    up, running, set_flags, set_mtu = 0x1, 0x40, 0x8914, 0x8922  # of linux/if.h
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, set_mtu, struct.pack("16si12x", b"lo", mtu_bytes))
        fcntl.ioctl(any_socket, set_flags, struct.pack("16sh14x", b"lo", up | running))
