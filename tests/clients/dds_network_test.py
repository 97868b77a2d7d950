#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd-dds among others: whom it looks for, strangers, readers that stall, and services that vanish or are none."""
import contextlib
import ipaddress
import json
import os
import pathlib
import signal
import subprocess
import sys
import types
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "clients/python"), str(HERE.parent / "daemon")]

import slsd  # noqa: E402
from dds_bridge import DOMAIN, Bridge, Listener, States, probe  # noqa: E402
from dds_load import measure  # noqa: E402
from python_test import Impostor, ply, result  # noqa: E402
from service import BIN, Service, wait_until  # noqa: E402


class Twins(unittest.TestCase):
    def test_that_start_at_once_are_told_too(self):
        with Service() as service, Bridge(service, name="twin") as one, Bridge(service, name="twin") as other:
            wait_until(lambda: "name_taken" in one.said() + other.said(), "that the name is taken")


class Stalling(unittest.TestCase):
    def test_of_a_reader_costs_the_others_nothing(self):
        got = measure(points=40_000, clouds=30, stalled=True)
        self.assertEqual((got["sent"], got["lost"]), (30, 0))

    def test_of_nobody_loses_nothing_among_many(self):
        got = measure(scanners=4, clouds=20)
        self.assertEqual((got["sent"], got["lost"]), (80, 0))


class Discovery(unittest.TestCase):
    """What ROS's environment says of who is looked for."""

    def listens(self, bridge):
        """The addresses and ports of the sockets that it has."""
        inodes = set()
        for link in pathlib.Path(f"/proc/{bridge.process.pid}/fd").iterdir():
            with contextlib.suppress(FileNotFoundError):  # closed meanwhile
                target = os.readlink(link)
                if target.startswith("socket:["):
                    inodes.add(target[8:-1])
        lines = [line.split() for line in pathlib.Path("/proc/net/udp").read_text(encoding="utf-8").splitlines()[1:]]
        local = [line[1].split(":") for line in lines if line[9] in inodes]
        return {(str(ipaddress.IPv4Address(int(address, 16).to_bytes(4, "little"))), int(port, 16)) for address, port in local}

    def started(self, service, **environment):
        bridge = Bridge(service, "--rate", "5", name="found", network=["--domain", str(DOMAIN)], **environment)
        self.addCleanup(bridge.__exit__)
        wait_until(lambda: len(self.listens(bridge)) >= 3, "that it listens")
        return bridge

    MULTICAST = 7400 + 250 * DOMAIN

    def test_of_this_host_alone_listens_on_loopback_alone(self):
        with Service() as service:
            for environment in ({"ROS_LOCALHOST_ONLY": "1"}, {"ROS_LOCALHOST_ONLY": "1", "ROS_STATIC_PEERS": "192.0.2.1"},
                                {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
                                {"ROS_AUTOMATIC_DISCOVERY_RANGE": "anything"}):
                bridge = self.started(service, **environment)
                self.assertEqual({address for address, _ in self.listens(bridge)}, {"127.0.0.1"}, environment)
                self.assertNotIn(self.MULTICAST, {port for _, port in self.listens(bridge)})
                self.assertEqual(len(probe("found/points", "PointCloud2")), 1)
                bridge.__exit__()

    def test_that_is_off_is_seen_by_nobody(self):
        with Service() as service:
            bridge = self.started(service, ROS_AUTOMATIC_DISCOVERY_RANGE="OFF")
            self.assertEqual({address for address, _ in self.listens(bridge)}, {"127.0.0.1"})
            self.assertEqual(probe("found/points", "PointCloud2", "--seconds", "6"), [])

    def test_of_the_subnet_listens_to_multicast_and_static_peers_do_not_need_it(self):
        with Service() as service:
            ports = lambda bridge: {port for _, port in self.listens(bridge)}  # noqa: E731
            self.assertIn(self.MULTICAST, ports(self.started(service)))
            bridge = self.started(service, ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST", ROS_STATIC_PEERS="127.0.0.1;192.0.2.1")
            self.assertNotIn(self.MULTICAST, ports(bridge))
            self.assertIn("0.0.0.0", {address for address, _ in self.listens(bridge)})

    def test_of_peers_that_are_no_hosts_is_refused(self):
        done = subprocess.run([BIN / "slsd-dds"], env={**os.environ, "ROS_STATIC_PEERS": "no.such.host.invalid"},
                              capture_output=True, text=True, timeout=600, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("no.such.host.invalid", done.stderr)


class Strangers(unittest.TestCase):
    def test_of_the_domain_cost_nothing(self):
        others = [subprocess.Popen([BIN / "dds_probe", "--domain", str(DOMAIN), "--seconds", "600", "--write" if i % 2 else "--topic",
                                    f"stranger{i}/points"], stdout=subprocess.DEVNULL) for i in range(24)]
        # One has other things to say about scanners, under a name of its own.
        others.append(subprocess.Popen([BIN / "dds_probe", "--domain", str(DOMAIN), "--seconds", "600", "--write", "map/points",
                                        "--bytes", "7", "--width", "4294967295"]))
        try:
            with Service() as service, Bridge(service, "--rate", "10", name="known") as bridge, States() as states, \
                    Listener("known/points", "PointCloud2") as clouds:
                wait_until(lambda: states.samples.get("known: slsd", {}).get("level") == 0, "the scanner")
                with slsd.Scanner(service.socket) as scanner:
                    self.assertEqual(clouds.next().point_cloud()["width"], len(scanner.scan()))
                # It may say of this host that its sockets are small.
                self.assertEqual([line for line in bridge.said().splitlines() if "net.core.rmem_max" not in line], [])
        finally:
            for other in others:
                other.terminate()
            for other in others:
                other.wait(600)

    def test_that_are_not_there_are_not_waited_for(self):
        with Service() as service, Bridge(service, "--peer", "192.0.2.1", "--peer", "192.0.2.2", "--rate", "5", name="known"), \
                Listener("known/points", "PointCloud2") as clouds:
            self.assertGreater(clouds.next().point_cloud()["width"], 0)

    def test_that_are_no_addresses_are_refused(self):
        for word in ("--interface", "--peer"):
            done = subprocess.run([BIN / "slsd-dds", word, "<no>"], capture_output=True, text=True, timeout=600, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn("a name or an address", done.stderr)


class Impostors(unittest.TestCase):
    """What listens where slsd would is another program, or another version."""

    def told(self, answer, text):
        with Impostor(answer) as other, States() as states, Listener("left/points", "PointCloud2") as clouds:
            with Bridge(types.SimpleNamespace(socket=other.path)) as bridge:
                wait_until(lambda: text in bridge.said(), text)
                wait_until(lambda: states.samples.get("left: slsd", {}).get("level") == 2, "that something is wrong")
                self.assertIsNone(bridge.process.poll())
                self.assertEqual(clouds.count, 0)

    def test_are_told_and_nothing_of_theirs_is_published(self):
        def lies(request):
            answer = result(request, **({"ready": True} if request["method"] == "status" else {}))
            if request["method"] == "subscribe":
                cloud = ply(3, said=4)
                return answer + json.dumps({"jsonrpc": "2.0", "method": "cloud", "params": {"bytes": len(cloud)}}).encode() + b"\n" + cloud
            return answer

        self.told(lies, "but its header says")
        self.told(lambda request: b'{"jsonrpc": "3.0", "id": 1, "result": {}}\n', "not JSON-RPC 2.0")
        self.told(lambda request: b"220 mail ready\n", "not a valid answer of slsd")
        self.told(lambda request: result(request, cameras="none", calibration=7, ready=[]), "the service sent")


class Vanishing(unittest.TestCase):
    def test_of_a_service_that_stalls_is_told_and_overcome(self):
        with Service() as service, Bridge(service, "--rate", "5", name="top"), States() as states, \
                Listener("top/points", "PointCloud2") as clouds:
            wait_until(lambda: states.samples.get("top: slsd", {}).get("level") == 0, "the scanner")
            clouds.next()
            service.send_signal(signal.SIGSTOP)
            try:
                wait_until(lambda: "does not answer" in states.samples["top: slsd"]["message"], "that it stalls")
            finally:
                service.send_signal(signal.SIGCONT)
            wait_until(lambda: states.samples["top: slsd"]["level"] == 0, "the scanner again")
            clouds.next()

    def test_of_the_service_is_told_and_it_is_found_again(self):
        def state():
            samples = probe("diagnostics", "DiagnosticArray")
            (status,) = samples[0].diagnostics()["status"]
            return status["level"], status["message"]

        with Service() as service, Bridge(service, "--rate", "5", name="top"):
            wait_until(lambda: state()[0] == 0, "the scanner")
            service.stop(signal.SIGKILL)
            wait_until(lambda: state()[0] == 2, "an error")
            self.assertIn("no service answers", state()[1])
            service.socket.unlink(missing_ok=True)
            service.start()
            wait_until(lambda: state()[0] == 0, "the scanner again")
            self.assertEqual(len(probe("top/points", "PointCloud2")), 1)


if __name__ == "__main__":
    unittest.main()
