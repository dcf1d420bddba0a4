"""The door to OpenSees: the virtual rig as its experimental site."""

from eft.opensees._server import serve
from eft.opensees._site import Site

__all__ = ["Site", "serve"]
