"""Pictures that cost little, for tests that read what is beside them."""

from contextlib import contextmanager

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure


@contextmanager
def quick():
    """Save figures with few dots and without the layout, which draws each of them twice.

    test_plots.py and test_notebooks.py draw every figure with its layout.
    """
    save = Figure.savefig

    def quickly(figure, *arguments, **named):
        figure.set_layout_engine(None)
        return save(figure, *arguments, **(named | {"dpi": 40}))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", quickly)
        yield


def drawn(figure):
    """Draw a figure once and with few dots; `savefig` draws and lays it out twice.

    The canvas of a figure without pyplot draws nothing.
    """
    figure.set_dpi(40)
    FigureCanvasAgg(figure).draw()
