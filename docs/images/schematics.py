"""Draws the schematics of the documentation: ``python docs/images/schematics.py`` writes the SVG files."""

import re
from html import escape
from pathlib import Path

HERE = Path(__file__).parent
INK, OIL, STEEL, SIGNAL, SOFT = "#1f2933", "#D55E00", "#d9dee3", "#0072B2", "#f3f5f7"


class Drawing:
    """Shapes on a white sheet, in SVG units."""

    def __init__(self, width: float, height: float, title: str) -> None:
        self.size = (width, height)
        self.parts = [
            f"<title>{escape(title)}</title>",
            *("<defs>", *(_marker(name, color) for name, color in HEADS.items()), "</defs>"),
            f'<rect width="{width}" height="{height}" rx="8" fill="white"/>',
        ]

    def box(self, x: float, y: float, w: float, h: float, *lines: str, fill: str = SOFT) -> None:
        """A rectangle with centred lines of text."""
        place = f'x="{x}" y="{y}" width="{w}" height="{h}"'
        self.parts.append(f'<rect {place} rx="4" fill="{fill}" stroke="{INK}" stroke-width="1.4"/>')
        for i, line in enumerate(lines):
            self.text(x + w / 2, y + h / 2 + 18 * (i - (len(lines) - 1) / 2) + 5, line)

    def text(
        self, x: float, y: float, words: str, anchor: str = "middle", color: str = INK, size: int = 14
    ) -> None:
        """One line of text."""
        style = f'text-anchor="{anchor}" fill="{color}" font-size="{size}"'
        self.parts.append(f'<text x="{x}" y="{y}" {style}>{_lowered(words)}</text>')

    def line(
        self, *points: tuple[float, float], color: str = INK, head: bool = False, width: float = 1.6
    ) -> None:
        """A line through the points, with an arrow head at the last one if wanted."""
        path = " ".join(f"{x},{y}" for x, y in points)
        end = f' marker-end="url(#{NAMES[color]})"' if head else ""
        self.parts.append(
            f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="{width}"{end}/>'
        )

    def arrow(self, *points: tuple[float, float], color: str = INK) -> None:
        """A line that ends in an arrow head."""
        self.line(*points, color=color, head=True)

    def sum(self, x: float, y: float) -> None:
        """A summing point."""
        self.parts.append(
            f'<circle cx="{x}" cy="{y}" r="10" fill="white" stroke="{INK}" stroke-width="1.4"/>'
        )

    def hatch(self, x: float, y: float, w: float, h: float) -> None:
        """A fixed part."""
        self.parts.append(f'<rect x="{x}" y="{y}" width="{w}" height="{h}" fill="{STEEL}" stroke="{INK}"/>')

    def write(self, name: str) -> None:
        """Write the file."""
        (HERE / name).write_text(self.svg(), encoding="utf-8")

    def svg(self) -> str:
        """The whole file."""
        width, height = self.size
        opening = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
            f'height="{height}" role="img" font-family="Helvetica, Arial, sans-serif">'
        )
        return "\n".join([opening, *self.parts, "</svg>"]) + "\n"


def _lowered(words: str) -> str:
    """The words, with what follows an underscore as a subscript."""
    subscript = r'<tspan dy="4" font-size="75%">\1</tspan><tspan dy="-4">&#8203;</tspan>'
    return re.sub(r"_(\w+)", subscript, escape(words))


HEADS = {"ink": INK, "oil": OIL, "signal": SIGNAL}
NAMES = {color: name for name, color in HEADS.items()}


def _marker(name: str, color: str) -> str:
    place = 'viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" orient="auto"'
    return f'<marker id="{name}" {place}><path d="M0,0 L10,5 L0,10 z" fill="{color}"/></marker>'


def rig() -> Drawing:
    """The rig: actuator, servovalve and supply, specimen, and the controller's signals."""
    sheet = Drawing(820, 430, "An effective force test: actuator, servovalve, specimen and controller")
    sheet.hatch(20, 140, 26, 150)
    sheet.text(4, 130, "reaction wall", "start", size=12)
    # The cylinder, its piston and rod.
    sheet.box(70, 175, 210, 80, fill="white")
    sheet.line((46, 215), (70, 215), width=6)
    sheet.parts.append(f'<rect x="72" y="177" width="96" height="76" fill="{OIL}" opacity="0.18"/>')
    sheet.parts.append(f'<rect x="182" y="177" width="96" height="76" fill="{OIL}" opacity="0.35"/>')
    sheet.parts.append(f'<rect x="168" y="177" width="14" height="76" fill="{INK}"/>')
    sheet.parts.append(f'<rect x="182" y="209" width="160" height="12" fill="{INK}"/>')
    sheet.text(120, 220, "P₂")
    sheet.text(230, 200, "P₁")
    sheet.text(175, 278, "actuator, area A", size=13)
    sheet.box(342, 196, 54, 38, "cell", fill="#fff")
    sheet.line((396, 215), (470, 215), width=6)
    # The specimen on its fixed base.
    sheet.box(470, 150, 230, 70, "specimen, mass m", fill=STEEL)
    for x in (500, 670):
        sheet.line((x, 220), (x - 8, 262), (x + 8, 285), (x, 330), width=2.4)
    sheet.hatch(440, 330, 290, 18)
    sheet.text(585, 368, "fixed base", size=13)
    sheet.text(585, 282, "stiffness k, damping c", size=13)
    sheet.arrow((650, 132), (560, 132))
    sheet.text(605, 122, "x, F positive")
    # The valve and its supply.
    sheet.box(110, 78, 130, 54, "servovalve", "opening x_v", fill="white")
    sheet.arrow((140, 132), (120, 175), color=OIL)
    sheet.arrow((210, 132), (230, 175), color=OIL)
    sheet.text(268, 158, "load flow Q_L", color=OIL, size=13)
    sheet.box(110, 18, 130, 34, "supply P_s", fill="white")
    sheet.arrow((175, 52), (175, 78), color=OIL)
    # The controller.
    sheet.box(250, 350, 150, 56, "controller", "one tick a sample", fill="#e3f0f8")
    sheet.arrow((369, 234), (369, 350), color=SIGNAL)
    sheet.text(377, 300, "force F", "start", SIGNAL, 13)
    sheet.arrow((430, 215), (430, 378), (400, 378), color=SIGNAL)
    sheet.text(437, 402, "velocity ẋ", "start", SIGNAL, 13)
    sheet.arrow((110, 118), (90, 118), (90, 150), (58, 150), (58, 392), (250, 392), color=SIGNAL)
    sheet.text(110, 410, "spool opening x_v", "start", SIGNAL, 13)
    sheet.arrow((325, 350), (325, 100), (240, 100), color=SIGNAL)
    sheet.text(332, 96, "valve command v", "start", SIGNAL, 13)
    sheet.arrow((85, 366), (250, 366), color=SIGNAL)
    sheet.text(85, 354, "command F_c = −m·a_g", "start", SIGNAL, 13)
    return sheet


def loop() -> Drawing:
    """The loop as a block diagram: controller above, plant below."""
    sheet = Drawing(900, 400, "Block diagram of the force loop with velocity feedback compensation")
    y = 210
    sheet.text(28, y - 14, "F_c")
    sheet.arrow((14, y), (62, y), color=SIGNAL)
    sheet.sum(72, y)
    sheet.text(54, y + 24, "−", size=16)
    sheet.arrow((82, y), (110, y), color=SIGNAL)
    sheet.box(110, y - 30, 100, 60, "PD control", "G_p, G_d", fill="#e3f0f8")
    sheet.arrow((210, y), (240, y), color=SIGNAL)
    sheet.sum(250, y)
    sheet.arrow((260, y), (290, y), color=SIGNAL)
    sheet.text(275, y - 14, "v", color=SIGNAL)
    sheet.box(290, y - 30, 100, 60, "servovalve", "delay T_d")
    sheet.arrow((390, y), (420, y))
    sheet.text(404, y - 14, "x_v")
    sheet.box(420, y - 30, 110, 60, "flow curve", "f(x_v)·√(1−p)")
    sheet.arrow((530, y), (560, y), color=OIL)
    sheet.text(545, y - 14, "Q_L", color=OIL)
    sheet.sum(570, y)
    sheet.text(586, y + 26, "−", size=16)
    sheet.arrow((580, y), (610, y), color=OIL)
    sheet.box(610, y - 30, 100, 60, "oil column", "A/(K_a·s+C_l)")
    sheet.arrow((710, y), (760, y))
    sheet.text(733, y - 14, "F")
    sheet.box(760, y - 30, 90, 60, "specimen", "m, c, k")
    # The motion takes flow, and the compensation returns it.
    sheet.line((850, y), (880, y))
    sheet.text(866, y - 14, "ẋ")
    sheet.arrow((880, y), (880, y + 80), (640, y + 80), color=OIL)
    sheet.box(560, y + 60, 80, 40, "area A", fill="white")
    sheet.arrow((570, y + 60), (570, y + 10), color=OIL)
    sheet.text(744, y + 98, "natural velocity", "start", OIL, 13)
    sheet.text(744, y + 114, "feedback A·ẋ", "start", OIL, 13)
    sheet.arrow((880, y), (880, 70), (660, 70), color=SIGNAL)
    sheet.text(770, 60, "measured velocity", color=SIGNAL, size=13)
    sheet.box(500, 40, 160, 60, "inverse flow", "f⁻¹(A·ẋ/√(1−p))", fill="#e3f0f8")
    sheet.arrow((500, 70), (450, 70), color=SIGNAL)
    sheet.box(300, 40, 150, 60, "inverse valve", "lead network", fill="#e3f0f8")
    sheet.arrow((300, 70), (250, 70), (250, y - 10), color=SIGNAL)
    sheet.text(258, 130, "G_p·v_c", "start", SIGNAL)
    sheet.arrow((735, y), (735, 345), (72, 345), (72, y + 10), color=SIGNAL)
    sheet.text(400, 338, "measured force", color=SIGNAL, size=13)
    sheet.text(20, 382, "blue: sampled by the controller", "start", SIGNAL, 13)
    sheet.text(240, 382, "orange: oil flow", "start", OIL, 13)
    sheet.text(360, 382, "p = sgn(x_v)·P_L/P_s", "start", INK, 13)
    return sheet


def windows() -> Drawing:
    """How the tick and the learner share the processor."""
    sheet = Drawing(820, 210, "The tick runs each sample, the learner once a window")
    left, tick, count = 120, 14, 16
    names = ("window k", "window k+1", "window k+2")
    sheet.text(100, 78, "interrupt: tick", "end", size=13)
    sheet.text(100, 138, "task: learner", "end", size=13)
    for i, name in enumerate(names):
        x = left + i * count * tick
        sheet.text(x + count * tick / 2, 34, name, size=13)
        sheet.line((x, 42), (x, 160), width=1)
        for j in range(count):
            at = x + j * tick
            sheet.parts.append(f'<rect x="{at + 2}" y="60" width="7" height="26" fill="{SIGNAL}"/>')
    start = left + count * tick
    sheet.box(start + 6, 116, 120, 34, "update", fill="#fde8dc")
    sheet.arrow((start, 86), (start, 133), (start + 6, 133), color=OIL)
    end = left + 2 * count * tick
    sheet.arrow((start + 126, 133), (end, 133), (end, 90), color=OIL)
    sheet.text(end + 8, 138, "calibration of window k takes effect", "start", OIL, 13)
    sheet.text(
        left, 190, "The same bits result when the learner runs inline, after the tick.", "start", size=13
    )
    return sheet


def cluster() -> Drawing:
    """How a study runs on several workers."""
    sheet = Drawing(760, 220, "A study is cut into chunks, which workers run; the rows return to one folder")
    sheet.box(20, 80, 130, 60, "study", "grid or sampler", fill="#e3f0f8")
    sheet.arrow((150, 110), (220, 110), color=SIGNAL)
    sheet.text(185, 98, "chunks", color=SIGNAL, size=13)
    sheet.box(220, 80, 130, 60, "executor", "pool or cluster")
    for i, y in enumerate((20, 90, 160), start=1):
        sheet.box(430, y, 120, 40, f"worker {i}", fill="white")
        sheet.arrow((350, 110), (430, y + 20), color=SIGNAL)
        sheet.arrow((550, y + 20), (610, 110), color=OIL)
    sheet.text(584, 40, "rows", color=OIL, size=13)
    sheet.box(610, 80, 130, 60, "folder", "of Parquet files", fill="#fde8dc")
    return sheet


def fmu() -> Drawing:
    """The two functional mock-up units in an importer."""
    sheet = Drawing(760, 210, "The importer connects the FMU of the controller with the FMU of the rig")
    sheet.box(150, 60, 180, 70, "rig-controller.fmu", "tick, learner, protection", fill="#e3f0f8")
    sheet.box(480, 60, 180, 70, "rig-rig.fmu", "rig, sensors, converter")
    sheet.arrow((30, 95), (150, 95), color=SIGNAL)
    sheet.text(88, 85, "command", color=SIGNAL, size=13)
    sheet.arrow((330, 80), (480, 80), color=SIGNAL)
    sheet.text(405, 70, "valve command", color=SIGNAL, size=13)
    sheet.arrow((330, 110), (480, 110), color=SIGNAL)
    sheet.text(405, 127, "tripped", color=SIGNAL, size=13)
    sheet.arrow((570, 130), (570, 180), (240, 180), (240, 130), color=SIGNAL)
    sheet.text(405, 170, "measured force, velocity, spool, ...", color=SIGNAL, size=13)
    sheet.arrow((660, 95), (740, 95), color=OIL)
    sheet.text(700, 85, "true force", color=OIL, size=13)
    return sheet


DRAWINGS = {"rig.svg": rig, "loop.svg": loop, "windows.svg": windows, "cluster.svg": cluster, "fmu.svg": fmu}

if __name__ == "__main__":
    for name, draw in DRAWINGS.items():
        draw().write(name)
