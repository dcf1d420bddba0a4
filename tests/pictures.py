"""Pictures that cost little, for tests that read what is beside them."""

from contextlib import contextmanager

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure


@contextmanager
def quick():
    """Save figures with few dots and without the layout, which draws each of them twice.

    test_plots.py draws the whole figures with their layout, and test_notebooks.py the pictures of results.
    """
    save = Figure.savefig

    def quickly(figure, *arguments, **named):
        figure.set_layout_engine(None)
        return save(figure, *arguments, **(named | {"dpi": 40}))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", quickly)
        yield


@contextmanager
def blank():
    """Make figures without drawing them, for tests that have drawn the same ones in other units."""

    def write(_, file, **named):
        file.write(b"\x89PNG\r\n\x1a\n")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", write)
        yield


def drawn(figure, layout=True):
    """Draw a figure once and with few dots; `savefig` draws and lays it out twice.

    The canvas of a figure without pyplot draws nothing. Half of the time is the layout's.
    """
    if not layout:
        figure.set_layout_engine(None)
    figure.set_dpi(40)
    FigureCanvasAgg(figure).draw()
