"""The bits of the core through the package, compared with `firmware/golden/bits.txt`."""

from pathlib import Path

import numpy as np
import pytest

import eft

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
STEPS = 100_000
SCALES = np.array([1.0e4, 1.3, 1.6e5, 1.2, 1.0e-3], np.float32)
MASK = 0xFFFF_FFFF
# fmt: off
SPECIAL = np.array([
    0x7FC00000, 0xFFC00000, 0x7FC12345, 0xFFFFFFFF, 0x7F800001, 0xFF800001, 0x7FA00000, 0xFFBFFFFF,
    0x7F800000, 0xFF800000, 0x00000000, 0x80000000,
    0x00000001, 0x80000001, 0x007FFFFF, 0x807FFFFF, 0x00800000, 0x80800000,
    0x7F7FFFFF, 0xFF7FFFFF,
    0x5368D4A4, 0x5368D4A5, 0x5368D4A6, 0xD368D4A4, 0xD368D4A5, 0xD368D4A6,
    0x3F7FFFFF, 0x3F800000, 0x3F800001, 0xBF7FFFFF, 0xBF800000, 0xBF800001,
], np.uint32)
# fmt: on


def words(word=2463534242):
    """Marsaglia's xorshift, 32 bits."""
    while True:
        word ^= word << 13 & MASK
        word ^= word >> 17
        word ^= word << 5 & MASK
        yield word


@pytest.fixture(scope="module")
def ticks():
    """Command, velocity, force, spool and further flow of every tick, as 32-bit floats."""
    random = words()
    special, bits, ordinary = [], [], []
    places = []  # kind of each number: a special value, random bits, or an ordinary one
    for _ in range(STEPS * 5):
        kind = min(next(random) % 16, 2)
        places.append(kind)
        (special, bits, ordinary)[kind].append(next(random))
    places = np.array(places)
    scales = np.tile(SCALES, STEPS)
    values = np.empty(STEPS * 5, np.float32)
    values[places == 0] = SPECIAL[np.array(special) % len(SPECIAL)].view(np.float32)
    values[places == 1] = np.array(bits, np.uint32).view(np.float32)
    values[places == 2] = regular(ordinary, scales[places == 2])

    count = len(SPECIAL)
    pair, first, second = (
        g.ravel() for g in np.meshgrid(np.arange(25), np.arange(count), np.arange(count), indexing="ij")
    )
    more = regular([next(random) for _ in range(len(pair) * 5)], np.tile(SCALES, len(pair))).reshape(-1, 5)
    rows = np.arange(len(pair))
    # Bits, not numbers: a conversion would quieten a signalling NaN.
    more.view(np.uint32)[rows, pair // 5] = SPECIAL[first]
    more.view(np.uint32)[rows, pair % 5] = SPECIAL[second]
    return np.concatenate([values.reshape(-1, 5), more])


def next_commands(commands):
    """The next tick's command of every tick, for a rig that looks ahead."""
    with np.errstate(invalid="ignore"):
        following = np.float32(0.9375) * commands
    following[60::61] = np.nan
    return following


def regular(words, scales):
    signed = np.array(words, np.uint32).view(np.int32)
    return signed.astype(np.float32) * (scales / np.float32(2147483648.0))


@pytest.fixture(scope="module")
def learning():
    """Command, velocity, force, spool, displacement, supply pressure and next command of the learning run."""
    phase = (np.arange(STEPS + 1) % 1024).astype(np.float32) / np.float32(256)
    swing = np.where(phase < 2, phase - np.float32(1), np.float32(3) - phase)
    following, swing = np.float32(2e3) * swing[1:], swing[:-1]
    opening = np.float32(0.3) * swing
    velocity = (np.float32(2.293) - np.float32(1.579) * abs(opening)) * opening
    position = np.cumsum(velocity * np.float32(1 / 4096), dtype=np.float32)
    pressure = np.full(STEPS, 1.9e7, np.float32)
    truth = np.stack(
        [np.float32(2e3) * swing, velocity, np.float32(1.9e3) * swing, opening, position, pressure], axis=1
    )
    scales = np.array([1.0e4, 1.0, 1.5e5, 1.0, 0.127, 1.9e7], np.float32)
    random = words(20_051)
    noise, wrong = [], []
    for n in range(STEPS):
        for channel in range(6):
            noise.append(next(random))
            if n < 80_000:
                if n % 1009 == 1008 and next(random) % 4 == 0:
                    wrong.append((n, channel, np.float32("nan")))
            elif n & 0x700 == 0x400:
                kind, word = next(random) % 16, next(random)
                special = np.array([SPECIAL[word % len(SPECIAL)] if kind == 0 else word], np.uint32)
                value = special.view(np.float32) if kind < 2 else regular([word], scales[channel])
                wrong.append((n, channel, value[0]))
    values = truth + regular(noise, np.tile(np.float32(5e-4) * scales, STEPS)).reshape(-1, 6)
    for n, channel, value in wrong:
        values[n, channel] = value
    following[1012::1013] = np.nan
    return np.column_stack([values, following])


def word(controller):
    """The core's status, with the number of the first cause above the flags."""
    return controller.status | controller.cause << 26


def hashed(step, status, rows):
    """FNV-1a over the bits of every answer and its flags."""
    value = 0xCBF2_9CE4_8422_2325
    with np.errstate(invalid="ignore"):
        rows = rows.astype(np.float64).tolist()
    answers = []
    for row in rows:
        answers.append((step(*row), status()))
    outputs = np.array([a for a, _ in answers])
    assert (outputs.astype(np.float32) == outputs).all()
    bits = outputs.astype(np.float32).view(np.uint32).tolist()
    for output, (_, flags) in zip(bits, answers, strict=True):
        for word in (output, int(flags)):
            value = (value ^ word) * 0x100_0000_01B3 & 0xFFFF_FFFF_FFFF_FFFF
    return f"{value:016x}"


@pytest.mark.parametrize("name", ["zhao2005", "uneven"])
def test_python_computes_the_committed_bits(name, ticks):
    golden = dict(line.rsplit(" ", 1) for line in (FIRMWARE / "golden" / "bits.txt").read_text().splitlines())
    rig = eft.Rig.zhao2005() if name == "zhao2005" else eft.Rig.from_toml(FIRMWARE / "rigs" / "uneven.toml")
    # Like the paper's controller it continues from its last state after any gap.
    rig = rig.replace({"limits.gap_time": 1e3})
    controller = eft.Controller(rig, dtype="f32")
    assert hashed(controller.step, lambda: word(controller), ticks[:, :4]) == golden[f"{name} controller"]
    compensator = eft.Compensator(rig, dtype="f32")
    assert (
        hashed(compensator.step, lambda: compensator.status, ticks[:, 1:4]) == golden[f"{name} compensation"]
    )


def test_python_computes_the_committed_bits_of_a_worn_rig(ticks):
    golden = dict(line.rsplit(" ", 1) for line in (FIRMWARE / "golden" / "bits.txt").read_text().splitlines())
    # It learns nothing here, and starts from rest after a gap.
    fixed = {"compensation.adaptive": False, "compensation.curve_correction": False}
    rig = eft.Rig.from_toml(FIRMWARE / "rigs" / "worn.toml").replace(fixed)
    controller = eft.Controller(rig, dtype="f32")

    def step(command, velocity, force, spool, following):
        return controller.step(command, velocity, force, spool, next_command=following)

    rows = np.column_stack([ticks[:, :4], next_commands(ticks[:, 0])])
    assert hashed(step, lambda: word(controller), rows) == golden["worn controller"]


@pytest.mark.parametrize("name", ["adaptive", "guarded", "worn"])
def test_python_learns_the_committed_bits(name, learning):
    golden = dict(line.rsplit(" ", 1) for line in (FIRMWARE / "golden" / "bits.txt").read_text().splitlines())
    controller = eft.Controller(eft.Rig.from_toml(FIRMWARE / "rigs" / f"{name}.toml"), dtype="f32")

    def step(command, velocity, force, spool, displacement, pressure, following):
        if name == "adaptive":
            return controller.step(command, velocity, force, spool)
        if name == "worn":
            return controller.step(command, velocity, force, spool, next_command=following)
        return controller.step(command, velocity, force, spool, pressure, displacement=displacement)

    assert hashed(step, lambda: word(controller), learning) == golden[f"{name} learning"]
