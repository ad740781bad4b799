"""Matplotlib figures without a window: made and saved in one style. Matplotlib is imported when the first is made."""

from pathlib import Path
from typing import TYPE_CHECKING, Final

from rsrl.drawing.style import FAINT, INK
from rsrl.errors import RsrlError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI: Final = 130


def new_figure(width_in: float, height_in: float, columns: int = 1, *, share_y: bool = False) -> "tuple[Figure, list[Axes]]":
    """A figure of so many inches with axes side by side, without a window system."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    axes = list(figure.subplots(1, columns, squeeze=False, sharey=share_y)[0])
    for axis in axes:
        dress(axis)
    return figure, axes


def dress(axes: "Axes") -> None:
    """Give axes the house style: two spines and a faint grid behind what is drawn."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(INK)
    axes.grid(color=FAINT, lw=0.6)
    axes.set_axisbelow(True)


def save_figure(figure: "Figure", title: str, path: Path) -> None:
    """Put the title on the figure and write it as PNG.

    Raises:
        RsrlError: the file cannot be written.
    """
    from matplotlib.text import Text

    figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold", color=INK)
    for text in figure.findobj(Text):
        text.set_parse_math(False)  # a name with dollar signs is no formula
    try:
        figure.savefig(path, dpi=DPI)
    except OSError as error:
        raise RsrlError(f"{path}: cannot be written ({error.strerror}); choose another folder with --out") from None
