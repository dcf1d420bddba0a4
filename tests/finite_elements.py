"""Models of OpenSees beside a virtual rig that is their experimental site."""

import re
import subprocess
import sys
import threading
from contextlib import contextmanager

import numpy as np

from eft.opensees import Site, serve


@contextmanager
def site(rig):
    """The port of a site of a rig for one client, and the results of that client."""
    visits, ports, started = [], [], threading.Event()

    def ready(_, port):
        ports.append(port)
        started.set()

    def work():
        serve(Site(rig), port=0, clients=1, ready=ready, visited=visits.append)

    server = threading.Thread(target=work, daemon=True)
    server.start()
    assert started.wait(10.0)
    yield ports[0], visits
    server.join(30.0)


def displacements(script):
    """The numbers that a script prints."""
    # A separate process, because OpenSees has one model and prints at its end.
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return np.array([float(line) for line in done.stdout.split() if re.match(r"^-?\d", line)])
