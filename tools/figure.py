"""Pictures of plots."""

from contextlib import contextmanager

from .errors import written_whole

__all__ = ["drawn_figure"]


@contextmanager
def drawn_figure(path, *, dpi=110, **options):
    """A figure to draw on, which is then written to ``path``; ``options`` are matplotlib's."""
    # Here, because few commands need it and it takes a while.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(layout="constrained", **options)
    FigureCanvasAgg(figure)
    yield figure
    with written_whole(path) as whole:
        figure.savefig(whole, format="png", dpi=dpi, metadata={"Software": None})
