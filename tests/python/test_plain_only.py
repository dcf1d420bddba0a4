"""What a rig asks for is never left out in silence."""

import pytest

import eft


@pytest.mark.parametrize("kind", [eft.Compensator, eft.Controller])
@pytest.mark.parametrize(
    "key",
    ["compensation.adaptive", "compensation.guard", "compensation.supply_correction", "protection.enabled"],
)
def test_steps_of_the_core_refuse_what_they_do_not_run(kind, key):
    rig = eft.Rig.zhao2005()
    kind(rig)
    with pytest.raises(ValueError, match=f"{key} = true: must be false"):
        kind(rig.replace({key: True}))
