"""The page for screen readers: the browser's tree of accessible names."""

from test_explore import PAGE, READY, made

CONTROLS = {"slider": 10, "radio": 4, "checkbox": 1, "button": 2, "textbox": 1}
VALUES = (
    """[...document.querySelectorAll('input[type=range]')].map((one) => one.getAttribute('aria-valuetext'))"""
)
FOCUSED = "(({ name, id, tagName }) => name || id || tagName)(document.activeElement)"


def spoken(page):
    """Names by role, in the order of reading."""
    told = {}
    for node in page.call("Accessibility.getFullAXTree")["nodes"]:
        if not node["ignored"]:
            name = node.get("name", {}).get("value", "")
            told.setdefault(node["role"]["value"], []).append(name.strip())
    return told


@made
def test_every_control_and_figure_has_a_name_of_its_own(browser):
    with browser.page(PAGE.as_uri()) as page:
        assert page.run(READY) == "ready"
        page.run("document.querySelector('details').open = true")
        told = spoken(page)
    assert {role: len(told[role]) for role in CONTROLS} == CONTROLS
    names = [name for role in CONTROLS for name in told[role]]
    assert all(names) and len(set(names)) == len(names)
    assert any(name.startswith("Mass of the structure") for name in told["slider"])
    assert told["form"] == ["Settings"]
    assert {"Compensation of the velocity feedback", "Test and rig"} <= set(told["group"])
    # A figure has a description.
    assert len(told["image"]) == 4 and all(" from " in name and " to " in name for name in told["image"])
    # The result of the test and its errors are announced.
    assert len(told["status"]) == len(told["alert"]) == 1


@made
def test_the_keyboard_reaches_every_control_and_moves_a_slider(browser):
    with browser.page(PAGE.as_uri()) as page:
        assert page.run(READY) == "ready"
        # A slider has its value with the unit.
        values = page.run(VALUES)
        assert len(values) == 10 and all(len(text.split()) == 2 for text in values)
        before, reached = page.run("document.documentElement.dataset.hash"), []
        while (name := press(page, "Tab")) not in reached:
            reached.append(name)
        assert {"scheme", "robust", *"afdltgmkcp", "copy", "original", "SUMMARY"} <= set(reached)
        page.run("document.querySelector('[name=m]').focus()")
        press(page, "ArrowRight")
        page.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        assert page.run("document.documentElement.dataset.hash") != before
        assert page.run(VALUES)[6] == "7.05 t"


@made
def test_a_link_of_a_million_samples_ends_in_one_sentence(browser):
    with browser.page(PAGE.as_uri()) as page:
        assert page.run(READY) == "ready"
        before = page.run("document.documentElement.dataset.hash")
        page.run("location.hash = '#' + Array.from({ length: 1e6 }, (_, i) => i % 7).join()")
        said = page.run("new Promise((done) => setTimeout(() => done(byId('wrong').textContent), 500))")
        assert said == "The link has 2000000 characters, more than 1000: it is not read."
        assert page.run("document.documentElement.dataset.hash") == before
        assert page.run("location.hash").startswith("#s=nonlinear")


def press(page, key):
    """The element with the focus after a key press."""
    for kind in ("keyDown", "keyUp"):
        number = {"Tab": 9, "ArrowRight": 39}[key]
        page.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=number)
    return page.run(FOCUSED)
