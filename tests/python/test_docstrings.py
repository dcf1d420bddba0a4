"""Every public function documents its arguments, results and errors, with an example that runs."""

import doctest
import importlib
import inspect

import pytest
from matplotlib import pyplot

MODULES = [
    "eft",
    "eft.records",
    "eft.linear",
    "eft.identification",
    "eft.studies",
    "eft.firmware",
    "eft.rths",
    "eft.data_sheets",
    "eft.report",
    "eft.traces",
    "eft.plots",
]
THINGS = {
    f"{module}.{name}": getattr(importlib.import_module(module), name)
    for module in MODULES
    for name in importlib.import_module(module).__all__
}
FUNCTIONS = {name: thing for name, thing in THINGS.items() if inspect.isroutine(thing)}
CLASSES = {name: thing for name, thing in THINGS.items() if inspect.isclass(thing)}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_says_what_it_takes_gives_and_refuses(name):
    text = inspect.getdoc(FUNCTIONS[name]) or ""
    takes = inspect.signature(FUNCTIONS[name]).parameters
    wanted = [*(["Parameters"] if takes else []), "Returns", *(["Raises"] if takes else []), "Examples"]
    missing = [section for section in wanted if f"{section}\n{'-' * len(section)}" not in text]
    assert not missing


def examples(name, thing):
    """The doctests of an object and of its members; doctest does not search the native module."""
    parts = {name: thing}
    if inspect.isclass(thing):
        parts |= {f"{name}.{each}": getattr(thing, each) for each in vars(thing) if not each.startswith("_")}
    parser = doctest.DocTestParser()
    tests = [
        parser.get_doctest(inspect.getdoc(part) or "", {}, each, None, 0) for each, part in parts.items()
    ]
    return [test for test in tests if test.examples]


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
    assert sum(len(examples(name, thing)) for name, thing in THINGS.items()) > 25
