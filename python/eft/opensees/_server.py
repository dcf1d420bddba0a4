"""The experimental site on a socket, with the protocol of the element `genericClient` of OpenSees.

All data is little-endian. A client first sends a header of eleven 32-bit integers, then messages of 64-bit
floats. The last integer of the header is the number of floats of a message. The first five integers are the
sizes of displacement, velocity, acceleration, force and time that the client sends; the next five are the
sizes that it requests. A message begins with the number of the action. Displacements, velocities,
accelerations and time follow, with a value for each actuator. A request is answered with one message, padded
with zeros.
"""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eft._numbers import real_number, whole_number
from eft.opensees._site import Site

Array = NDArray[np.float64]

_HEADER = struct.Struct("<11i")
_LARGEST = 4096
"""Largest number of floats in a message, far more than the actuators need."""
_LONGEST = 1e9
"""Longest time to wait, which every system can count, s."""


class ClientError(ValueError):
    """An error of a client; the message completes a sentence."""


class Visit(NamedTuple):
    """The result of one client."""

    moves: int
    """Displacements that were applied."""
    steps: int
    """Steps that were committed."""
    ending: str
    """Reason for the end."""
    ended_well: bool
    """Whether the client ended the connection by the protocol."""


def serve(
    site: Site,
    host: str = "127.0.0.1",
    port: int = 8090,
    *,
    clients: int | None = None,
    patience: float = 10.0,
    idle: float = 600.0,
    ready: Callable[[str, int], object] | None = None,
    visited: Callable[[Visit], object] | None = None,
) -> None:
    """Serve a virtual rig to finite-element models, one after another, as the site of their `genericClient`.

    Each client starts with the rig at rest and a new specimen. A client that disconnects, sends nothing for
    too long or sends an invalid message is dropped, and the next one is served.

    Parameters
    ----------
    site : Site
        The rig.
    host : str
        Address to listen at. Anyone who reaches it can drive the rig: the protocol has no passwords.
    port : int
        Port to listen at; 0 lets the system choose.
    clients : int, optional
        Clients after which to return; without it the call lasts until it is interrupted.
    patience : float
        Longest time to receive or send a message, s.
    idle : float
        Longest time between two messages, s.
    ready : callable, optional
        Called with host and port when clients can connect.
    visited : callable, optional
        Called with a `Visit` when a client is gone.

    Returns
    -------
    None

    Raises
    ------
    ValueError
        If an argument is not allowed.
    TypeError
        If a number has another type.
    OSError
        If the address does not belong to this machine, or the port is in use. The message has host and port.

    Examples
    --------
    >>> import eft
    >>> site = eft.opensees.Site(eft.Rig.zhao2005())
    >>> eft.opensees.serve(site, port=0, clients=0, ready=lambda host, port: print(host))
    127.0.0.1
    """
    if not isinstance(site, Site):
        raise ValueError(f"site = {site!r}: must be an eft.opensees.Site")
    for name, value in (("patience", patience), ("idle", idle)):
        if not 0.0 < real_number(name, value) <= _LONGEST:
            raise ValueError(f"{name} = {value!r}: must be above 0 and at most {_LONGEST:g} s")
    if not 0 <= whole_number("port", port) <= 65535:
        raise ValueError(f"port = {port!r}: must be from 0 to 65535")
    try:
        opened = socket.create_server((host, port), backlog=8)
    except OSError as error:
        # The socket module adds the address in brackets.
        reason = str(error.strerror).partition(" (")[0]
        raise OSError(f"host = {host!r}, port = {port}: cannot listen there: {reason}") from error
    with opened as listener:
        if ready is not None:
            ready(*listener.getsockname()[:2])
        served = 0
        while clients is None or served < clients:
            connection, _ = listener.accept()
            served += 1
            site.reset()
            with connection:
                visit = _Conversation(connection, site, patience, idle).run()
            if visited is not None:
                visited(visit)


class _Conversation:
    """One client and the rig."""

    def __init__(self, connection: socket.socket, site: Site, patience: float, idle: float) -> None:
        self._connection, self._site = connection, site
        self._patience, self._idle = patience, idle
        self._size = self._moves = self._steps = 0
        self._floors = site.actuators
        self._force = self._wanted = np.zeros(self._floors)
        self._time = 0.0

    def run(self) -> Visit:
        """Serve a client until it ends or fails."""
        try:
            self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._greet()
            while self._answer():
                pass
            return self._visit("the client ended the test", ended_well=True)
        except ValueError as error:
            return self._visit(str(error))
        except OSError as error:
            return self._visit(f"the connection broke: {error.strerror or error}")

    def _visit(self, ending: str, ended_well: bool = False) -> Visit:
        return Visit(self._moves, self._steps, ending, ended_well)

    def _greet(self) -> None:
        header = _HEADER.unpack(self._receive(_HEADER.size, self._patience))
        sent, wanted, size = header[:5], header[5:10], header[10]
        floors = self._floors
        if sent != (floors, floors, floors, 0, 1) or wanted[3] != floors:
            count = "one degree" if floors == 1 else f"{floors} degrees"
            raise ClientError(f"the client's header {header} is not that of {count} of freedom")
        # The answer to a stiffness request is the whole matrix.
        least = max(3 * floors + 2, floors**2)
        if not least <= size <= _LARGEST:
            raise ClientError(f"the client's message size {size} must be from {least} to {_LARGEST}")
        self._size = size

    def _answer(self) -> bool:
        message = np.frombuffer(self._receive(8 * self._size, self._idle), dtype="<f8")
        action, floors = float(message[0]), self._floors
        match action:
            case 3.0:
                self._move(message[1 : 1 + floors])
                self._time = float(message[1 + 3 * floors])
            case 4.0:
                pass
            case 5.0:
                self._steps += 1
            case 6.0 | 10.0:
                self._send(self._force)
            case 7.0:
                self._send(self._site.state.displacement)
            case 8.0 | 9.0 | 14.0 | 15.0:
                # Zero, because the specimen is at rest and the external model has damping and mass.
                self._send(0.0)
            case 11.0:
                self._send(self._time)
            case 12.0 | 13.0:
                self._send(self._site.stiffness)
            case 99.0:
                return False
            case _:
                raise ClientError(f"the client's action {action:g} is unknown")
        return True

    def _move(self, displacement: Array) -> None:
        if np.array_equal(displacement, self._wanted) and self._moves:
            return
        self._force = self._site.move(displacement)
        self._wanted = displacement
        self._moves += 1

    def _send(self, values: ArrayLike) -> None:
        message = np.zeros(self._size, dtype="<f8")
        flat = np.ravel(values)
        message[: flat.size] = flat
        self._connection.settimeout(self._patience)
        self._connection.sendall(message.tobytes())

    def _acknowledge_at_once(self) -> None:
        # OpenSees sends its next message only after an acknowledgement of the last one, for which Linux may
        # take 40 ms. The kernel withdraws the option by itself.
        if hasattr(socket, "TCP_QUICKACK"):
            self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)

    def _receive(self, size: int, first: float) -> bytes:
        """Read a number of bytes, with `first` s for the first one and `patience` for the others."""
        data = bytearray()
        deadline = time.monotonic() + first
        while len(data) < size:
            left = deadline - time.monotonic()
            if left <= 0.0:
                raise ClientError("the client fell silent")
            self._connection.settimeout(left)
            self._acknowledge_at_once()
            try:
                part = self._connection.recv(size - len(data))
            except TimeoutError:
                raise ClientError("the client fell silent") from None
            if not part:
                raise ClientError(
                    "the client disconnected in the middle of a message"
                    if data
                    else "the client disconnected"
                )
            if not data:
                deadline = time.monotonic() + self._patience
            data += part
        return bytes(data)
