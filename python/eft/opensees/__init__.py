"""Interfaces to OpenSees: the rig as an experimental site, and models as specimens."""

from eft.opensees._server import serve
from eft.opensees._site import Site
from eft.opensees._structure import Structure

__all__ = ["Site", "Structure", "serve"]
