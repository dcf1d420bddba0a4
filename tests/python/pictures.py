"""Pictures that cost little, for tests that read what is beside them."""

from contextlib import contextmanager

import pytest
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
