"""A picture with controls, of ipywidgets alone: it works in JupyterLab, without a browser, and in tests."""

import base64
import io
from collections.abc import Callable, Mapping

import ipywidgets
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure


class Explorer:
    """A picture that is drawn again whenever one of its controls changes.

    draw: function (figure, **values) that draws on an empty matplotlib Figure. controls: name -> ipywidgets control;
    the names are draw's arguments. size: of the picture, inches; dpi: its resolution. Where widgets do not run (a code
    host, a printed page) the notebook shows the picture as it was last drawn.

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
    ):
        self.draw, self.controls, self.size, self.dpi = draw, dict(controls), size, dpi
        # As large as it is drawn, not stretched over the page; narrower where there is less room.
        self.picture = ipywidgets.Image(format="png", layout={"max_width": "100%", "align_self": "flex-start"})
        self.widget = ipywidgets.VBox([*self.controls.values(), self.picture])
        for control in self.controls.values():
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

    def figure(self) -> Figure:
        """Draw the picture for the controls' values, and give the figure, whose axes can be looked into."""
        figure = Figure(self.size, dpi=self.dpi, layout="constrained")
        FigureCanvasAgg(figure)
        self.draw(figure, **self.values)
        return figure

    def redraw(self) -> None:
        """Show the picture for the controls' values."""
        file = io.BytesIO()
        self.figure().savefig(file, format="png")
        self.picture.value = file.getvalue()

    def _repr_mimebundle_(self, include=None, exclude=None):
        bundle = self.widget._repr_mimebundle_() or {}
        picture = base64.b64encode(self.png).decode()
        return bundle | {"image/png": picture, "text/plain": "an explorer: " + ", ".join(self.controls)}
