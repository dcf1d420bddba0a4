"""Flow tests of the virtual rig, each simulated once in a process."""

from functools import cache

import eft

RIG = eft.Rig.zhao2005()
STROKE = RIG["actuator.stroke"]


@cache
def strokes(*changes):
    """Flow tests of a rig with these changes."""
    rig = RIG.replace(dict(changes))
    return [eft.identification.flow_test(rig, share * STROKE) for share in (0.9, 0.8, 0.6, 0.4, 0.2)]
