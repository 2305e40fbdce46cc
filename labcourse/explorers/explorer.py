"""A picture with controls, of ipywidgets alone: it works in JupyterLab, without a browser, and in tests."""

import base64
import io
from collections.abc import Callable, Mapping, Sequence

import ipywidgets
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave

VIEW = "application/vnd.jupyter.widget-view+json"


def show(axes: Axes, image: np.ndarray, title: str = "") -> None:
    """Show an image under a title, without ticks and frame."""
    axes.imshow(image)
    axes.set_title(title)
    axes.axis("off")


class Explorer:
    """A picture that is drawn again whenever one of its controls changes.

    draw: function (figure, **values) that draws on an empty matplotlib Figure. controls: name -> ipywidgets control;
    the names are draw's arguments. size: of the picture, inches; dpi: its resolution. stills: states worth seeing, each
    as values of some controls; where widgets do not run (a code host, a printed page) the notebook shows these, one
    below the other, else the picture as it was last drawn.

    >>> def draw(figure, slope):
    ...     figure.subplots().plot([0, 1], [0, slope])
    >>> explorer = Explorer(draw, {"slope": ipywidgets.FloatSlider(1.0, min=0, max=2)})
    >>> before = explorer.png
    >>> explorer.controls["slope"].value = 2.0
    >>> explorer.png != before
    True
    """

    def __init__(
        self,
        draw: Callable[..., None],
        controls: Mapping[str, ipywidgets.Widget],
        size: tuple[float, float] = (7.0, 3.0),
        dpi: int = 80,
        stills: Sequence[Mapping] = (),
    ):
        self.draw, self.controls, self.size, self.dpi, self.stills = draw, dict(controls), size, dpi, stills
        # As large as it is drawn, not stretched over the page; narrower where there is less room.
        self.picture = ipywidgets.Image(format="png", layout={"max_width": "100%", "align_self": "flex-start"})
        self.widget = ipywidgets.VBox([*self.controls.values(), self.picture])
        # All labels are as wide as the longest needs: by itself ipywidgets cuts one of twelve letters off.
        unlabelled = ipywidgets.Button | ipywidgets.Checkbox | ipywidgets.ToggleButton
        labelled = [c for c in self.controls.values() if c.has_trait("description") and not isinstance(c, unlabelled)]
        for control in labelled:
            control.style.description_width = f"{max(10, *(len(c.description) for c in labelled))}ch"
        for control in self.controls.values():
            if isinstance(control, ipywidgets.Checkbox):
                control.layout.width = "max-content"
            if control.has_trait("value"):
                control.observe(lambda change: self.redraw(), names="value")
        self.redraw()

    @property
    def values(self) -> dict:
        """What the controls stand at, by name; buttons, which have no value, are left out."""
        return {name: control.value for name, control in self.controls.items() if control.has_trait("value")}

    @property
    def png(self) -> bytes:
        """The picture as it stands, a PNG file's bytes."""
        return bytes(self.picture.value)

    def figure(self, **values) -> Figure:
        """Draw the picture for the controls' values, or others, and give the figure, whose axes can be looked into."""
        figure = Figure(self.size, dpi=self.dpi, layout="constrained")
        FigureCanvasAgg(figure)
        self.draw(figure, **self.values | values)
        return figure

    def still(self) -> bytes:
        """The picture for readers without a kernel, a PNG file's bytes: the stills, each under the values it shows."""
        if not self.stills:
            return self.png
        shown, file = [], io.BytesIO()
        for values in self.stills:
            figure = self.figure(**values)
            figure.suptitle(
                ", ".join(f"{name} = {value}" for name, value in values.items()), fontsize=10, weight="bold"
            )
            figure.canvas.draw()
            shown.append(np.asarray(figure.canvas.buffer_rgba())[..., :3])
        imsave(file, np.concatenate(shown), format="png")
        return file.getvalue()

    def redraw(self) -> None:
        """Show the picture for the controls' values."""
        file = io.BytesIO()
        self.figure().savefig(file, format="png")
        self.picture.value = file.getvalue()

    def _repr_mimebundle_(self, include=None, exclude=None):
        """What Jupyter shows: the widget, which ipywidgets 7 (Colab) would not say itself, and the still picture."""
        return {
            VIEW: {"version_major": 2, "version_minor": 0, "model_id": self.widget.model_id},
            "image/png": base64.b64encode(self.still()).decode(),
            "text/plain": "an explorer: " + ", ".join(self.controls),
        }
