"""The errors of functions that need a package which is not installed."""

import sys

import pytest

import eft

RIG = eft.Rig.zhao2005()
COMMAND = eft.sine_sweep(100.0, 1.0, 2.0, 0.1, 1024.0)


@pytest.mark.parametrize(
    ("package", "extra", "call"),
    [
        ("pandas", "pandas", lambda: eft.simulate(RIG, COMMAND).to_pandas()),
        ("pandas", "pandas", lambda: eft.study(RIG, COMMAND, {"compensation.level": [1.0]}).to_pandas()),
        ("xarray", "xarray", lambda: eft.simulate(RIG, COMMAND).to_xarray()),
        ("control", "control", lambda: eft.simulate(RIG, COMMAND).to_control()),
        (
            "scipy",
            "study",
            lambda: eft.study(RIG, COMMAND, eft.studies.Sobol({"compensation.level": (0.9, 1.0)}, n=2)),
        ),
    ],
)
def test_a_missing_package_is_named_with_its_extra(package, extra, call, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ModuleNotFoundError) as refused:
        call()
    assert str(refused.value) == (
        f"needs the package {package}, which is not installed: pip install 'effective-force-testing[{extra}]'"
    )
    assert refused.value.name == package
