"""The doors to OpenSees: the virtual rig as its experimental site, and its models under the actuators."""

from eft.opensees._server import serve
from eft.opensees._site import Site
from eft.opensees._structure import Structure

__all__ = ["Site", "Structure", "serve"]
