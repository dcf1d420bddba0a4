"""The configuration from Python: every conversion, and the errors for wrong input."""

import math
import pickle
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import eft

RIG = eft.Rig.zhao2005()
KEYS = {row.key: row for row in eft.rig_keys()}


def leaves(tree, prefix=""):
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def test_the_rig_of_the_paper_in_si():
    rig = RIG.to_dict()
    assert rig["actuator"]["piston_area"] == 8.212e-3
    assert rig["servovalve"]["pilot_flow_gain"] == 1.06e-5
    assert rig["compensation"]["response_delay"] == 5.0e-3
    assert rig["structure"] == {
        "kind": "bilinear",
        "mass": 7040.0,
        "damping": 4330.0,
        "stiffness": 693.8e3,
        "softening": {"displacement": 0.025, "stiffness": 350e3},
    }
    table = rig["servovalve"]["flow_table"]
    assert table["openings"] == [i / 10 for i in range(-10, 11)]
    inch = 0.0254
    assert table["flows"][11] == pytest.approx(102.2 * inch**3, rel=1e-12)
    assert table["flows"][0] == pytest.approx(-536.2 * inch**3, rel=1e-12)


def test_a_designed_loop_is_named_as_digital():
    rig = eft.Rig.zhao2005()
    assert " analog controller " in repr(rig)
    assert " digital controller " in repr(rig.replace({"controller.force_loop": "robust"}))


def test_a_rig_of_the_required_keys_has_the_defaults_that_the_schema_names():
    tree = {}
    for key, row in KEYS.items():
        kinds = 'structure.kind = "bilinear"', 'structure.kind is not "shear_building"'
        needed = row["required"] or row["required_where"] in kinds
        if needed and not key.startswith("truth."):
            *sections, leaf = key.split(".")
            inner = tree
            for section in sections:
                inner = inner.setdefault(section, {})
            inner[leaf] = RIG[key]
    rig = eft.Rig.from_dict(tree)
    assert KEYS["compensation.level"]["default"] == 1.0
    assert KEYS["compensation.sign_from"]["default"] == "spool"
    assert KEYS["controller.observer_mass"]["required_where"] == 'controller.velocity_source = "observer"'
    for key, row in KEYS.items():
        if not key.startswith("truth.") and key not in tree and not row["required"]:
            expected = RIG[key] if row["required_where"] else row["default"]
            assert rig[key] == expected and type(rig[key]) is type(expected), key


def test_every_way_out_is_a_way_in(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(RIG.to_toml(), encoding="utf-8")
    assert eft.Rig.from_toml(path) == RIG
    assert eft.Rig.from_toml(str(path)) == RIG
    assert eft.Rig.from_dict(RIG.to_dict()) == RIG
    assert eft.Rig.from_dict(tomllib.loads(RIG.to_toml(comments=True))) == RIG
    assert pickle.loads(pickle.dumps(RIG)) == RIG
    assert RIG.replace({"structure.damping": 8e3}) != RIG
    assert RIG != "a rig"


def test_python_reads_the_toml_as_the_same_values():
    assert tomllib.loads(RIG.to_toml()) == RIG.to_dict()


def test_commented_toml_explains_every_key():
    text = RIG.to_toml(comments=True)
    for row in KEYS.values():
        assert row["doc"] in text and row["allowed"] in text


def test_replace_gives_a_new_rig():
    changed = RIG.replace({"compensation.mode": "linear", "structure.damping": 8})
    assert changed["compensation.mode"] == "linear"
    assert changed["structure.damping"] == 8.0 and isinstance(changed["structure.damping"], float)
    assert RIG["structure.damping"] == 4330.0
    assert changed.replace({"compensation.mode": "nonlinear", "structure.damping": 4330.0}) == RIG


def test_numpy_values_and_tables_are_taken_as_they_are():
    scaled = np.array(RIG["servovalve.flow_table.flows"]) * 1.1
    changed = RIG.replace(
        {
            "structure.mass": np.float32(7000),
            "compensation.computation_delay": np.int64(2),
            "compensation.feedforward": np.bool_(True),
            "servovalve.flow_table.flows": scaled,
        }
    )
    assert changed["structure.mass"] == 7000.0
    assert changed["compensation.computation_delay"] == 2
    assert changed["compensation.feedforward"] is True
    table = eft.FlowTable(changed["servovalve.flow_table.openings"], scaled)
    assert RIG.replace({"servovalve.flow_table": table})["servovalve.flow_table.flows"] == list(scaled)


def test_none_takes_an_optional_value_away():
    limited = RIG.replace({"limits.valve_command": 10.0, "name": "limited"})
    assert limited["limits.valve_command"] == 10.0
    assert limited.replace({"limits.valve_command": None, "name": "zhao2005"}) == RIG
    assert RIG["limits.valve_command"] is None
    with pytest.raises(ValueError, match=r"missing key `structure.mass`"):
        RIG.replace({"structure.mass": None})


def test_keys_are_read_by_their_dotted_names():
    assert RIG["structure"] == RIG.to_dict()["structure"]
    assert RIG["structure.softening.stiffness"] == 350e3
    with pytest.raises(KeyError, match=r"structure\.mass"):
        RIG["structure.mas"]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            {"structure.mas": 1.0},
            r"^unknown key `structure\.mas`; the nearest known key is `structure\.mass`$",
        ),
        ({"stiffness": 1.0}, r"unknown key `stiffness`; the nearest known key is `structure\.stiffness`"),
        ({"structure.mass": math.nan}, r"^structure\.mass = NaN: must be a number between .* kg$"),
        ({"structure.mass": -math.inf}, r"^structure\.mass = -inf: must be a number between"),
        ({"structure.mass": "7 V"}, r'^structure\.mass = "7 V": must be a number between'),
        ({"structure.mass": True}, r"^structure\.mass = true: must be a number between"),
        ({"structure.mass": [1.0]}, r"^structure\.mass = \[1\.0\]: must be a number between"),
        ({"structure.mass": {}}, r"^structure\.mass = a section: must be a number between"),
        ({"structure.mass": 1j}, r"^structure\.mass = an object of type complex: must be"),
        ({"structure.mass": 10**30}, r"^structure\.mass = 10{30}: must"),
        (
            {"controller.sample_rate": 0},
            r"^controller\.sample_rate = 0: must be a number between 1 and .* Hz$",
        ),
        (
            {"compensation.mode": "cubic"},
            r'^compensation\.mode = "cubic": must be one of "off", "linear", "non',
        ),
        ({"sensors.seed": -1}, r"^sensors\.seed = -1: must be a whole number of at least 0$"),
        ({"compensation.lead_alpha": 1.0}, r"^compensation\.lead_alpha = 1: must be a number between"),
        ({"servovalve.flow_table.flows": [0.0, 1.0]}, r"^servovalve\.flow_table\.flows = 2 values: .* 21$"),
        ({"servovalve.flow_table.flows": [[0.0]]}, r"servovalve\.flow_table\.flows"),
        ({"structure": 3}, r"^structure = 3: must be a section$"),
        ({3: 1.0}, r"^key = 3: must be a string$"),
        ({"name": "\ud800"}, r"name"),
    ],
)
def test_a_wrong_value_is_named_with_what_is_allowed(changes, says):
    with pytest.raises(ValueError, match=says) as error:
        RIG.replace(changes)
    assert "\n" not in str(error.value)


def test_a_table_that_does_not_increase_names_the_place():
    flows = list(RIG["servovalve.flow_table.flows"])
    flows[7] = flows[6]
    with pytest.raises(ValueError, match=r"flows\[7\] = .*: must increase strictly"):
        RIG.replace({"servovalve.flow_table.flows": flows})


def test_nothing_physical_has_a_silent_default():
    with pytest.raises(
        ValueError, match=r"missing key `actuator\.piston_area` \(effective piston area A, m²\)"
    ):
        eft.Rig.from_dict({})
    whole = dict(leaves(RIG.to_dict()))
    for key, row in KEYS.items():
        if row["required"]:
            assert key in whole
            with pytest.raises(ValueError, match=f"missing key `{key}`"):
                RIG.replace({key: None})


def test_a_dictionary_that_contains_itself_is_refused():
    loop = {}
    loop["actuator"] = loop
    with pytest.raises(ValueError, match="nested too deeply"):
        eft.Rig.from_dict(loop)
    with pytest.raises(TypeError):
        eft.Rig.from_dict([("actuator", 1)])


def test_files_that_are_not_there_or_not_toml(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"nowhere\.toml"):
        eft.Rig.from_toml(tmp_path / "nowhere.toml")
    path = tmp_path / "rig.toml"
    path.write_text("[actuator]\npiston_area = = 3\n")
    with pytest.raises(ValueError, match=r"rig\.toml: line 2, column 15: "):
        eft.Rig.from_toml(path)
    path.write_bytes(b"name = '\xff'")
    with pytest.raises(ValueError, match=r"rig\.toml: not UTF-8 text at byte 8"):
        eft.Rig.from_toml(path)
    path.write_bytes(b"")
    with pytest.raises(ValueError, match="missing key"):
        eft.Rig.from_toml(path)


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.complex_numbers() | st.text() | st.binary(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)
NAMES = st.sampled_from(sorted(KEYS)) | st.sampled_from(sorted(RIG.to_dict())) | st.text(max_size=12)


@given(st.dictionaries(NAMES, ANYTHING, max_size=3))
def test_whatever_is_given_the_answer_is_a_rig_or_a_value_error(changes):
    for make in (RIG.replace, eft.Rig.from_dict, lambda tree: eft.Rig.from_dict(RIG.to_dict() | tree)):
        try:
            rig = make(changes)
        except ValueError:
            continue
        assert eft.Rig(rig.to_toml()) == rig


@given(st.text(max_size=60))
def test_no_text_does_more_than_raise_a_value_error(text):
    with pytest.raises(ValueError, match=r"."):
        eft.Rig(text)


@given(
    mass=st.floats(1.0, 1e6),
    gain=st.floats(0.5, 2.0),
    delay=st.integers(0, 1000),
    name=st.text(st.characters(codec="utf-8"), max_size=20),
)
def test_any_valid_rig_survives_toml_and_pickling_bit_for_bit(mass, gain, delay, name):
    rig = RIG.replace(
        {
            "structure.mass": mass,
            "servovalve.flow_gain_scale": gain,
            "compensation.computation_delay": delay,
            "name": name,
        }
    )
    assert rig["structure.mass"] == mass and rig["name"] == name
    assert eft.Rig(rig.to_toml()) == rig == pickle.loads(pickle.dumps(rig))
    assert tomllib.loads(rig.to_toml())["structure"]["mass"] == mass


def test_a_flow_beyond_any_valve_is_refused_by_its_key():
    flows = RIG["servovalve.flow_table.flows"]
    for key in ("servovalve.flow_table.flows", "servovalve.true_flow_table.flows"):
        changes = {"servovalve.true_flow_table": RIG["servovalve.flow_table"], key: [*flows[:-1], 1e300]}
        with pytest.raises(
            ValueError, match=rf"^{key}\[20\] = 1e300: must be a number between -1000 and 1000 m"
        ):
            RIG.replace(changes)


def test_a_key_without_a_near_one_suggests_none():
    with pytest.raises(ValueError, match=r"^unknown key `compensation\.tuning`$"):
        RIG.replace({"compensation.tuning": 1.0})


def test_the_core_s_messages_count_no_zeros():
    with pytest.raises(ValueError, match=r"^sample_rate = 1e-300: must lie within"):
        eft.Controller(RIG, sample_rate=1e-300)
