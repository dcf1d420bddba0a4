"""The experimental site on a socket: the protocol, and clients that violate it."""

import contextlib
import socket
import struct
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import eft
from eft.opensees import Site, serve

RIG = eft.Rig.zhao2005().replace({"structure.kind": "linear"})
SIZE = 256
STORIES = {
    "structure.stories.masses": [7040.0, 6000.0],
    "structure.stories.dampings": [2800.0, 2000.0],
    "structure.stories.stiffnesses": [1.4e6, 1.0e6],
}
BUILDING = RIG.replace({"structure.kind": "shear_building", **STORIES})


class Served:
    """A server in a thread, and the results of its clients."""

    def __init__(self, clients, rig=RIG, longest=20.0, **options):
        self.visits, self.address, ready = [], None, threading.Event()

        def started(*address):
            self.address = address
            ready.set()

        def work():
            site = Site(rig, longest=longest)
            serve(site, port=0, clients=clients, ready=started, visited=self.visits.append, **options)

        self.thread = threading.Thread(target=work, daemon=True)
        self.thread.start()
        assert ready.wait(10.0)

    def connect(self):
        client = socket.create_connection(self.address, timeout=10.0)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return client

    def end(self):
        self.thread.join(20.0)
        assert not self.thread.is_alive()
        return self.visits


def header(size=SIZE, *, displacements=1):
    return struct.pack(
        "<11i", displacements, displacements, displacements, 0, 1, 0, 0, 0, displacements, 0, size
    )


def message(action, displacements=0.0, now=0.0, size=SIZE):
    sent = np.atleast_1d(displacements)
    values = [action, *sent, *[0.0] * 2 * len(sent), now]
    return struct.pack(f"<{size}d", *values, *[0.0] * (size - len(values)))


def asked(client, action, size=SIZE, count=1):
    client.sendall(message(action, size=size))
    data = b""
    while len(data) < 8 * size:
        part = client.recv(8 * size - len(data))
        assert part, "the server hung up"
        data += part
    values = struct.unpack(f"<{size}d", data)
    assert not any(values[count:])
    return values[0] if count == 1 else np.array(values[:count])


def a_good_test(served):
    """Check that a correct client is served."""
    with served.connect() as client:
        client.sendall(header())
        client.sendall(message(3, 0.004, 0.02))
        assert asked(client, 10) == pytest.approx(RIG["structure.stiffness"] * 0.004, rel=2e-3)
        client.sendall(message(5))
        client.sendall(message(99))


def test_a_client_moves_asks_commits_and_ends():
    served = Served(1)
    with served.connect() as client:
        client.sendall(header())
        assert asked(client, 12) == asked(client, 13) == RIG["structure.stiffness"]
        assert asked(client, 14) == asked(client, 15) == asked(client, 8) == asked(client, 10) == 0.0
        for displacement in (0.004, 0.004, -0.002):
            client.sendall(message(3, displacement, 0.02))
            assert asked(client, 10) == pytest.approx(RIG["structure.stiffness"] * displacement, rel=2e-3)
        assert asked(client, 7) == pytest.approx(-0.002, abs=2e-6)
        assert asked(client, 11) == 0.02
        client.sendall(message(5))
        client.sendall(message(99))
    (visit,) = served.end()
    assert (visit.moves, visit.steps, visit.ended_well) == (2, 1, True)


def test_a_building_has_a_degree_of_freedom_at_each_floor():
    served = Served(1, BUILDING)
    (first, second), floors = STORIES["structure.stories.stiffnesses"], np.array([0.002, 0.005])
    stiffness = np.array([[first + second, -second], [-second, second]])
    with served.connect() as client:
        client.sendall(header(displacements=2))
        np.testing.assert_array_equal(asked(client, 12, count=4), stiffness.ravel())
        client.sendall(message(3, floors, 0.02))
        np.testing.assert_allclose(asked(client, 10, count=2), stiffness @ floors, rtol=2e-3)
        np.testing.assert_allclose(asked(client, 7, count=2), floors, atol=2e-6)
        assert asked(client, 11) == 0.02
        client.sendall(message(5))
        client.sendall(message(99))
    (visit,) = served.end()
    assert (visit.moves, visit.steps, visit.ended_well) == (1, 1, True)


def test_a_building_refuses_a_client_of_one_degree_of_freedom():
    served = Served(1, BUILDING)
    with served.connect() as client:
        client.sendall(header() + message(3, 0.001))
        (visit,) = served.end()
    assert "is not that of 2 degrees of freedom" in visit.ending and not visit.ended_well


def test_a_specimen_is_new_for_each_client():
    served = Served(2)
    for _ in range(2):
        a_good_test(served)
    assert [visit.ended_well for visit in served.end()] == [True, True]


def vanish_at_once(client):
    client.close()


def half_a_header(client):
    client.sendall(header()[:20])
    client.close()


def half_a_message(client):
    client.sendall(header() + message(3, 0.001)[:100])
    client.close()


def half_closed(client):
    client.sendall(header() + message(10))
    client.shutdown(socket.SHUT_WR)
    client.recv(8 * SIZE)


def reset(client):
    client.sendall(header() + message(10))
    # The client has gone before the answer.
    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    client.close()


def silent(client):
    client.sendall(header())
    assert not client.recv(1), "the server waits no longer"


def one_byte_at_a_time(client):
    with contextlib.suppress(OSError):
        for byte in header() + message(3, 0.001):
            client.sendall(bytes([byte]))
            time.sleep(0.05)


def garbage(client):
    noise = np.random.default_rng(1).bytes(65536)
    with contextlib.suppress(OSError):
        client.sendall(noise)


def a_web_browser(client):
    client.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1:8090\r\nUser-Agent: curl/8.0\r\n\r\n")


def sent(*parts):
    def send(client):
        with contextlib.suppress(OSError):
            client.sendall(b"".join(parts))
            client.recv(1)

    return send


@pytest.mark.parametrize(
    "misbehave",
    [
        vanish_at_once,
        half_a_header,
        half_a_message,
        half_closed,
        reset,
        silent,
        one_byte_at_a_time,
        garbage,
        a_web_browser,
        sent(header(displacements=3)),
        sent(header(size=2**31 - 1)),
        sent(header(size=-1)),
        sent(header(), message(42)),
        sent(header(), message(float("nan"))),
        sent(header(), message(3, float("nan"))),
        sent(header(), message(3, float("inf"))),
        sent(header(), message(3, 5.0)),
        sent(header(), message(3, 0.1)),
        # The length of a header with another number of degrees of freedom.
        sent(header(), message(3, 0.001, size=100), message(10, size=100), message(3, 1.0, size=100)),
    ],
)
def test_a_bad_client_is_dropped_in_time_and_the_next_is_served(misbehave):
    served = Served(2, longest=5.0, patience=0.5, idle=0.6)
    began = time.monotonic()
    client = served.connect()
    misbehave(client)
    a_good_test(served)
    client.close()
    bad, good = served.end()
    assert time.monotonic() - began < 15.0
    assert not bad.ended_well and bad.ending and "\n" not in bad.ending
    assert good == (1, 1, good.ending, True)


def test_wrong_arguments_are_named():
    with pytest.raises(ValueError, match=r"^tolerance = 0"):
        Site(RIG, tolerance=0.0)
    with pytest.raises(ValueError, match=r"^port = 70000"):
        serve(Site(RIG), port=70000)
    with pytest.raises(TypeError, match=r"^port = 80\.5: must be a whole number"):
        serve(Site(RIG), port=80.5, clients=0)
    with pytest.raises(ValueError, match=r"^idle = 1000000000000\.0: must be above 0 and at most 1e\+09 s"):
        serve(Site(RIG), port=0, clients=0, idle=1e12)
    with pytest.raises(ValueError, match=r"^site = .*: must be an eft\.opensees\.Site"):
        serve(RIG, port=0, clients=0)
    with pytest.raises(ValueError, match=r"^displacement = \[0, 0\]: must be one for each of 1 actuators"):
        Site(RIG).move([0.0, 0.0])
    with pytest.raises(ValueError, match=r"^displacement = \[0, 1\] m: must be within the stroke"):
        Site(BUILDING).move([0.0, 1.0])


def test_an_address_that_is_not_there_or_in_use_is_named():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(
            OSError, match=rf"^host = '127\.0\.0\.1', port = {port}: cannot .*: Address .* in use$"
        ):
            serve(Site(RIG), port=port, clients=0)
    with pytest.raises(OSError, match=r"^host = '192\.0\.2\.1', port = 0: cannot listen there: \w"):
        serve(Site(RIG), "192.0.2.1", 0, clients=0)


def test_a_force_beyond_the_rig_is_an_error_and_the_site_goes_on():
    site = Site(RIG.replace({"structure.stiffness": 2e6}), longest=2.0)
    with pytest.raises(ValueError, match=r"^displacement = 0\.12 m: the rig came to"):
        site.move(0.12)
    site.reset()
    assert site.move(0.01) == pytest.approx(2e4, rel=1e-3)


def test_the_command_serves_and_ends(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(RIG.to_toml(), encoding="utf-8")
    command = [sys.executable, "-m", "eft", "serve", str(path), "--port", "0", "--clients", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        line = process.stdout.readline()
        port = int(line.rsplit(maxsplit=1)[1])
        with socket.create_connection(("127.0.0.1", port), timeout=10.0) as client:
            client.sendall(header() + message(3, 0.001) + message(5) + message(99))
        out, wrong = process.communicate(timeout=20)
    assert process.returncode == 0 and out.startswith("1 steps, 1 displacements") and not wrong
