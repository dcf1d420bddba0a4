"""Both couplings with OpenSees; skipped if it is not installed."""

import importlib.util
import os

import numpy as np
import pytest

import eft
from finite_elements import displacements, site

if importlib.util.find_spec("openseespy") is None:
    pytest.skip("openseespy is not installed: pip install openseespy", allow_module_level=True)

RATE = 2048.0
RIG = eft.Rig.zhao2005().replace({"structure.kind": "linear"})
FIRMWARE = os.environ.get("EFT_FIRMWARE")


FRAME = """
import openseespy.opensees as ops

ops.model("basic", "-ndm", 1, "-ndf", 1)
for node, mass in ((1, 7040.0), (2, 7040.0), (3, 6000.0)):
    ops.node(node, 0.0)
    ops.mass(node, mass)
{specimen}
ops.timeSeries("Trig", 1, 0.0, 10.0, 0.5)
ops.pattern("Plain", 1, 1)
ops.load(3, 2000.0)
ops.system("FullGeneral")
ops.algorithm("Linear")
ops.integrator("NewmarkExplicit", 0.5)
ops.analysis("Transient")
for _ in range(40):
    ops.analyze(1, 0.01)
    print(ops.nodeDisp(1, 1), ops.nodeDisp(2, 1), ops.nodeDisp(3, 1))
ops.wipe()
"""
STORIES = (1.4e6, 1.2e6, 1.0e6)


def test_a_model_of_three_stories_drives_three_actuators():
    stories = {"masses": [7040.0] * 3, "dampings": [2000.0] * 3, "stiffnesses": STORIES}
    rig = RIG.replace({"structure.kind": "shear_building", "structure.stories": stories})
    client = (
        'ops.element("genericClient", 1, "-node", 1, 2, 3, "-dof", 1, "-dof", 1, "-dof", 1, "-server", {})'
    )
    springs = ["ops.node(9, 0.0); ops.fix(9, 1)"] + [
        f'ops.uniaxialMaterial("Elastic", {story}, {stiffness})\n'
        f'ops.element("zeroLength", {story}, {story - 1 or 9}, {story}, "-mat", {story}, "-dir", 1)'
        for story, stiffness in enumerate(STORIES, 1)
    ]
    with site(rig) as (port, visits):
        found = displacements(FRAME.format(specimen=client.format(f'{port}, "127.0.0.1"')))
    wanted = displacements(FRAME.format(specimen="\n".join(springs)))
    assert len(wanted) == 120 and np.abs(wanted).max() > 1e-3
    np.testing.assert_allclose(found, wanted, atol=1e-3 * np.abs(wanted).max())
    assert visits[0].steps == 40 and visits[0].ended_well


@pytest.fixture
def ops():
    from openseespy import opensees

    opensees.wipe()
    yield opensees
    opensees.wipe()


def column(ops, material, *parameters):
    """A mass on a column of a material, with the rig's damping."""
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(1, 0.0)
    ops.node(2, 0.0)
    ops.fix(1, 1)
    ops.mass(2, RIG["structure.mass"])
    ops.uniaxialMaterial(material, 1, *parameters)
    ops.uniaxialMaterial("Viscous", 2, RIG["structure.damping"], 1.0)
    ops.uniaxialMaterial("Parallel", 3, 1, 2)
    ops.element("zeroLength", 1, 1, 2, "-mat", 3, "-dir", 1, "-doRayleigh", 0)
    return eft.opensees.Structure(2)


def close(found, wanted, share):
    for name in ("force", "displacement", "velocity"):
        a, b = np.atleast_2d(getattr(found, name)), np.atleast_2d(getattr(wanted, name))
        assert (np.abs(a - b).max(axis=1) < share * np.abs(b).max(axis=1)).all(), name


@pytest.mark.parametrize("realization", ["analog", "digital"])
def test_an_elastic_model_is_the_rigs_own_structure(ops, realization):
    rig = RIG.replace({"controller.realization": realization})
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 8.0, RATE)
    found = eft.simulate(rig, command, structure=column(ops, "Elastic", rig["structure.stiffness"]))
    close(found, eft.simulate(rig, command, method="runge-kutta"), 1e-3)


def test_a_frame_of_three_stories_takes_three_actuators(ops):
    masses, stiffnesses = [7040.0, 7040.0, 6000.0], [1.4e6, 1.2e6, 1.0e6]
    dampings = [2e-3 * stiffness for stiffness in stiffnesses]
    stories = {"masses": masses, "dampings": dampings, "stiffnesses": stiffnesses}
    rig = RIG.replace({"structure.kind": "shear_building", "structure.stories": stories})
    height, modulus = 3.0, 2e11
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    ops.geomTransf("Linear", 1)
    for floor in range(4):
        for side in (0, 1):
            ops.node(10 * floor + side, 4.0 * side, height * floor)
            # Rigid beams: the floors move sideways and do not rotate.
            ops.fix(10 * floor + side, int(floor == 0), 1, 1)
    for floor, (mass, stiffness) in enumerate(zip(masses, stiffnesses, strict=True), 1):
        ops.mass(10 * floor, mass, 0.0, 0.0)
        ops.equalDOF(10 * floor, 10 * floor + 1, 1)
        for node in (10 * floor, 10 * floor + 1):
            inertia = stiffness * height**3 / (24.0 * modulus)
            ops.element("elasticBeamColumn", node, node - 10, node, 1.0, modulus, inertia, 1)
    ops.rayleigh(0.0, 0.0, 2e-3, 0.0)
    time = np.arange(int(3 * RATE)) / RATE
    forces = [size * np.sin(2 * np.pi * f * time) for size, f in ((3e3, 1.5), (4e3, 2.5), (5e3, 0.9))]
    command = eft.Command(forces, RATE)
    found = eft.simulate(rig, command, structure=eft.opensees.Structure([10, 20, 30]))
    assert found.force.shape == (3, len(time))
    close(found, eft.simulate(rig, command), 1e-3)


def test_a_yielding_column_agrees_with_bouc_wen(ops):
    hysteresis = {"yield_displacement": 0.01, "post_yield_ratio": 0.1, "exponent": 4.0, "shape": 0.5}
    rig = RIG.replace({"structure.kind": "bouc_wen", "structure.bouc_wen": hysteresis})
    command = eft.sine_sweep(8000.0, 0.5, 3.0, 8.0, RATE)
    stiffness = rig["structure.stiffness"]
    steel = column(ops, "Steel02", 0.01 * stiffness, stiffness, 0.1, 5.0, 0.0, 0.15)
    found, own = eft.simulate(rig, command, structure=steel), eft.simulate(rig, command)
    assert np.abs(own.displacement).max() > 4 * 0.01
    # Two different laws of the same column, with similar results.
    work = [np.trapezoid(run.force, run.displacement) for run in (found, own)]
    assert work[0] == pytest.approx(work[1], rel=0.02)
    assert np.abs(found.displacement).max() == pytest.approx(np.abs(own.displacement).max(), rel=0.06)
    apart = np.std(found.displacement - own.displacement) / np.std(own.displacement)
    assert 0.01 < apart < 0.1


def test_a_study_builds_the_model_anew_for_each_test(ops):
    def make(rig):
        ops.wipe()
        return column(ops, "Elastic", rig["structure.stiffness"])

    command = eft.sine_sweep(8900.0, 0.5, 6.0, 2.0, RATE)
    variations = {"structure.stiffness": [5e5, 9e5], "compensation.mode": ["linear", "nonlinear"]}
    found, own = (eft.study(RIG, command, variations, **how) for how in ({"structure": make}, {}))
    np.testing.assert_allclose(found["nrmse"], own["nrmse"], atol=1e-3)
    assert np.diff(np.sort(own["nrmse"])).min() > 3e-3


def test_a_model_that_does_not_converge_trips_the_test(ops, capfd):
    column(ops, "Steel02", 100.0, RIG["structure.stiffness"], 0.1, 20.0, 0.925, 0.15)
    ops.wipeAnalysis()
    ops.system("FullGeneral")
    # Without motion one iteration suffices.
    ops.test("NormDispIncr", 1e-9, 1, 0)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    structure = eft.opensees.Structure(2, own_analysis=True, tag=7)
    run = eft.simulate(RIG, eft.Command.sine(5000.0, 1.0, 2.0, RATE), structure=structure)
    assert 1 < len(run) < 2 * RATE
    assert "converge" in run.stopped and "\n" not in run.stopped
    assert run.flags & eft.Status.TRIPPED and not run.verdict.ok and run.stopped in run.verdict.text
    assert np.isfinite(run.force).all()
    assert "failed" in capfd.readouterr().err


def test_what_the_model_has_not_is_named(ops):
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(1, 0.0)
    for arguments, says in [
        ((5,), "nodes = 5"),
        ((1, 2), "directions = 2"),
        (([1, 1], [1]), "directions = 1 values"),
        (([],), "directions = 0 values"),
    ]:
        with pytest.raises(ValueError, match=f"^{says}"):
            eft.opensees.Structure(*arguments)


def test_a_fixed_node_and_a_used_tag_are_named(ops):
    column(ops, "Elastic", 1e6)
    with pytest.raises(ValueError, match=r"^nodes = 1: must be free to move in direction 1"):
        eft.opensees.Structure(1, tag=7)
    with pytest.raises(ValueError, match=r"^tag = 910000: must be unused"):
        eft.opensees.Structure(2)


def test_a_structure_of_too_few_nodes_is_refused(ops):
    structure = column(ops, "Elastic", 1e6)
    with pytest.raises(ValueError, match=r"^nodes = \[2\]"):
        structure(np.zeros(2), 1e-3)


@pytest.mark.skipif(FIRMWARE is None, reason="EFT_FIRMWARE names no image; `make firmware` does")
def test_the_chain_from_a_finite_element_to_a_processors_bits(ops):
    rig = RIG.replace({"controller.realization": "digital"})
    rate = rig["controller.sample_rate"]
    command = eft.sine_sweep(8900.0, 0.0, 5.0, 2.0, rate)
    stiffness = rig["structure.stiffness"]
    steel = ("Steel02", 0.01 * stiffness, stiffness, 0.1, 20.0, 0.925, 0.15)
    here = eft.simulate(rig, command, "f32", structure=column(ops, *steel))
    ops.wipe()
    loop = eft.firmware.ProcessorInTheLoop(FIRMWARE)
    there = loop.simulate(rig, command, structure=column(ops, *steel))
    assert np.abs(here.displacement).max() > 0.01
    for name in ("force", "displacement", "spool", "valve_command", "compensation"):
        np.testing.assert_array_equal(getattr(there, name), getattr(here, name), err_msg=name)
