"""The page of the virtual rig: in a headless Chromium it computes the bits of the library."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import eft
from browsers import CHROMIUM

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "_explore" / "eft.html"
made = pytest.mark.skipif(
    not PAGE.exists() or CHROMIUM is None,
    reason="no page (`make explore`), or no Chromium (on Debian, apt-get install chromium)",
)

READY = """new Promise((done) => {
  const look = () => document.documentElement.dataset.state;
  const wait = setInterval(() => { if (look()) { clearInterval(wait); done(look()); } }, 20);
})"""
PROBE = """
<script>
addEventListener("load", () => { const wait = setInterval(() => {
  const { state, hash, milliseconds } = document.documentElement.dataset;
  if (!state) return;
  clearInterval(wait);
  const painted = (id) => {
    const { data } = byId(id).getContext("2d").getImageData(0, 0, byId(id).width, byId(id).height);
    let count = 0;
    for (let i = 3; i < data.length; i += 4) count += data[i] > 0;
    return count;
  };
  const sliders = [...document.querySelectorAll("input[type=range]")];
  const before = hash, said = byId("wrong").textContent;
  sliders[0].focus();
  sliders[0].stepUp(5);
  sliders[0].dispatchEvent(new Event("input", { bubbles: true }));
  renew();
  const answer = {
    state, hash, milliseconds: Number(milliseconds), said, wrong: byId("wrong").textContent,
    summary: byId("summary").textContent, toml: byId("toml").value, link: link(),
    painted: ["force", "error", "spool", "ratio"].map(painted),
    moved: document.documentElement.dataset.hash !== before,
    named: [...document.querySelectorAll("input")].every((one) => one.labels[0]?.textContent.trim()),
    told: ["force", "error", "spool", "ratio"].map((id) => byId(`d-${id}`).textContent),
  };
  document.body.insertAdjacentHTML("beforeend", `<pre id="probe">${btoa(JSON.stringify(answer))}</pre>`);
}, 20); });
</script>
"""


def opened(browser, folder, link="", text=None):
    text = text or PAGE.read_text(encoding="utf-8")
    page = folder / "page.html"
    page.write_text(text.replace("</body>", PROBE + "</body>"), encoding="utf-8")
    with browser.page(page.as_uri() + link) as shown:
        return shown.probe()


def fnv(values):
    value = 0xCBF29CE484222325
    for byte in np.ascontiguousarray(values, dtype="<f8").tobytes():
        value = ((value ^ byte) * 0x100000001B3) & 0xFFFFFFFFFFFFFFFF
    return f"{value:016x}"


LINKS = {
    "": {},
    "#s=linear&d=8": {"compensation.mode": "linear"},
    "#s=off&d=8&a=2.2": {"compensation.mode": "off"},
    "#s=adaptive&d=8&g=80": {
        "compensation.adaptive": True, "compensation.feedforward": True, "compensation.look_ahead": True,
        "truth.servovalve.flow_gain_scale": 0.8,
    },
    "#s=nonlinear&r=1&d=8&m=10": {
        "controller.realization": "digital", "controller.force_loop": "robust", "structure.mass": 10_000.0,
    },
}  # fmt: skip


@made
@pytest.mark.parametrize("link", LINKS)
def test_the_force_has_the_bits_of_the_library(link, browser, tmp_path):
    answer = opened(browser, tmp_path, link)
    assert answer["state"] == "ready" and not answer["wrong"]
    amplitude = 2200.0 if "a=2.2" in link else 8900.0
    command = eft.sine_sweep(amplitude, 0.0, 10.0, 8.0 if "d=8" in link else 32.0, 4096.0)
    rig = eft.Rig.zhao2005().replace(LINKS[link])
    assert answer["hash"] == fnv(eft.simulate(rig, command).force)
    assert answer["moved"] and min(answer["painted"]) > 300
    assert answer["named"] and all(answer["told"])
    values = tomllib.loads(answer["toml"])
    assert values.pop("command")["kind"] == "sweep"
    assert eft.Rig.from_dict(values) == rig


WRONG_LINKS = {
    "#s=wat&__proto__=1&constructor=2&d=1e9":
        'The link\'s "Length of the sweep" is no number from 4 to 64 s: 64 s is taken.',
    "#a=nonsense": 'The link\'s "Amplitude of the sweep" is no number from 0.5 to 15 kN: 8.9 kN is taken.',
    "#m=-4": 'The link\'s "Mass of the structure" is no number from 2 to 30 t: 2 t is taken.',
    "#" + "d=9&" * 20_000: "The link has 80001 characters, more than 1000: it is not read.",
    "#%": "",
}  # fmt: skip


@made
@pytest.mark.parametrize("link", WRONG_LINKS, ids=range(len(WRONG_LINKS)))
def test_a_wrong_link_gives_a_test_within_the_limits_and_a_sentence(link, browser, tmp_path):
    answer = opened(browser, tmp_path, link)
    assert answer["state"] == "ready" and answer["said"] == WRONG_LINKS[link]
    assert len(answer["link"]) < 200 and not answer["wrong"]


@made
def test_a_browser_without_the_module_says_so(browser, tmp_path):
    text = re.sub(r'(const MODULE = ")[^"]*', r"\g<1>AAAA", PAGE.read_text(encoding="utf-8"), count=1)
    page = tmp_path / "page.html"
    page.write_text(text, encoding="utf-8")
    with browser.page(page.as_uri()) as shown:
        assert shown.run(READY) == "wrong"
