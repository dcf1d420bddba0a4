"""Every public function and method documents its arguments, results and errors, with an example that runs."""

import ast
import doctest
import importlib
import inspect
from functools import cached_property
from pathlib import Path

import pytest
from matplotlib import pyplot

import eft

pytestmark = pytest.mark.usefixtures("quick_pictures")

MODULES = [
    "eft",
    "eft.records",
    "eft.linear",
    "eft.identification",
    "eft.studies",
    "eft.firmware",
    "eft.benchmark",
    "eft.opensees",
    "eft.rths",
    "eft.data_sheets",
    "eft.report",
    "eft.traces",
    "eft.plots",
    "eft.cli",
]
THINGS = {
    f"{module}.{name}": getattr(importlib.import_module(module), name)
    for module in MODULES
    for name in importlib.import_module(module).__all__
}
FUNCTIONS = {name: thing for name, thing in THINGS.items() if inspect.isroutine(thing)}
CLASSES = {name: thing for name, thing in THINGS.items() if inspect.isclass(thing)}

NEVER_REFUSE = {
    "Comparison.table",
    "DriveIteration.plot",
    "ForceLoopEstimate.keys",
    "ForceLoopTuning.margin_at",
    "ForceLoopTuning.plot",
    "Rig.to_toml",
    "StepController.step",
    "TransferSystem.perturbed",
}
"""Methods with parameters that refuse no value of the documented type."""

STUB = ast.parse(Path(eft.__file__).with_name("_native.pyi").read_text(encoding="utf-8"))
SILENT = {
    f"{kind.name}.{method.name}"
    for kind in STUB.body
    if isinstance(kind, ast.ClassDef)
    for method in kind.body
    if isinstance(method, ast.FunctionDef) and ast.unparse(method.returns or ast.Constant("")) == "None"
}
"""Methods of the native classes that return nothing."""


def own(kind):
    """The public attributes that a class of the package defines."""
    return {
        name: thing
        for name, thing in sorted(vars(kind).items(), key=lambda item: item[0])
        if not name.startswith("_")
    }


METHODS = {
    f"{where}.{name}": (kind, getattr(kind, name))
    for where, kind in CLASSES.items()
    for name, thing in own(kind).items()
    if inspect.isroutine(thing) and not isinstance(thing, cached_property)
}
PROPERTIES = {
    f"{where}.{name}": thing
    for where, kind in CLASSES.items()
    for name, thing in own(kind).items()
    if inspect.isdatadescriptor(thing) or isinstance(thing, cached_property)
}


def missing(text, wanted):
    return [section for section in wanted if f"{section}\n{'-' * len(section)}" not in text]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_says_what_it_takes_gives_and_refuses(name):
    text = inspect.getdoc(FUNCTIONS[name]) or ""
    takes = inspect.signature(FUNCTIONS[name]).parameters
    wanted = [*(["Parameters"] if takes else []), "Returns", *(["Raises"] if takes else []), "Examples"]
    assert not missing(text, wanted)


@pytest.mark.parametrize("name", METHODS)
def test_a_method_says_what_it_takes_gives_and_refuses(name):
    kind, method = METHODS[name]
    text, signature = inspect.getdoc(method) or "", inspect.signature(method)
    # Methods of a run that are in a module of their own call it `run`.
    takes = [parameter for parameter in signature.parameters if parameter not in ("self", "run")]
    short = f"{kind.__name__}.{name.rpartition('.')[2]}"
    gives = signature.return_annotation != "None" and short not in SILENT
    wanted = ["Parameters"] * bool(takes) + ["Returns"] * gives
    wanted += ["Raises"] * (bool(takes) and short not in NEVER_REFUSE) + ["Examples"]
    assert not missing(text, wanted)


def test_methods_that_refuse_nothing_exist():
    assert {".".join(name.split(".")[-2:]) for name in METHODS} >= NEVER_REFUSE


@pytest.mark.parametrize("name", PROPERTIES)
def test_a_property_says_what_it_is(name):
    assert inspect.getdoc(PROPERTIES[name])


def examples(name, thing):
    """The doctests of an object and of its members; doctest does not search the native module."""
    parts = {name: thing}
    if inspect.isclass(thing):
        parts |= {f"{name}.{each}": getattr(thing, each) for each in own(thing)}
    parser = doctest.DocTestParser()
    tests = [
        parser.get_doctest(inspect.getdoc(part) or "", {}, each, None, 0) for each, part in parts.items()
    ]
    return [test for test in tests if test.examples]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", THINGS)
def test_examples_run(name):
    pyplot.switch_backend("Agg")
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    said = []
    for test in examples(name, THINGS[name]):
        runner.run(test, out=said.append)
    pyplot.close("all")
    assert not said, "".join(said)


def test_the_examples_are_seen():
    assert sum(len(examples(name, thing)) for name, thing in THINGS.items()) > 150
