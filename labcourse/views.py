"""Views in 3-D that a reader turns with the mouse: points, lines and jaws in the robot's base frame.

A `View` collects what is to be seen. JupyterLab shows it as a plotly figure to turn; where nothing runs (a code host, a
printed page) the same view stands still as a picture. `page` makes HTML of it that needs no network.
"""

import io
import json
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Num
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

PLOTLY = "application/vnd.plotly.v1+json"
AXIS_COLOURS = ("#d62728", "#2ca02c", "#1f77b4")  # x, y and z of a frame: red, green, blue
JAW_COLOUR = "#1f77b4"
# The twelve triangles of a box whose corners are numbered by the bits of their index.
BOX = np.array(
    [0, 1, 3, 0, 3, 2, 4, 7, 5, 4, 6, 7, 0, 5, 1, 0, 4, 5, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3]
).reshape(12, 3)


def fingers(T_base_grasp: Float[np.ndarray, "4 4"], width: float, gripper) -> Float[np.ndarray, "2 8 3"]:
    """Corners of the two fingers of a hand that is open by `width`, metres in the base frame, from palm to tips.

    gripper: a labkit.grasp.Gripper. Bits 0, 1 and 2 of a corner's number are its side in x, y and z of the grasp frame.
    """
    across = np.array([-1, 1]) * gripper.finger_width / 2
    inner, outer = width / 2, width / 2 + gripper.tip_thickness
    along = gripper.tips_below_grasp - np.array([gripper.palm_above_tips, 0.0])  # z of the grasp frame points down
    corners = [
        [(across[i & 1], closing[i >> 1 & 1], along[i >> 2]) for i in range(8)]
        for closing in ((-outer, -inner), (inner, outer))
    ]
    return np.array(corners) @ T_base_grasp[:3, :3].T + T_base_grasp[:3, 3]


@dataclass
class View:
    """What is to be seen, in metres of the base frame; each method adds to it and returns the view.

    eye: the direction from the middle of things to the observer, (x, y, z). Topics 06, 07 and 08.

    >>> view = View().points(np.zeros((2, 3)), "cloud").frame(np.eye(4), "base")
    >>> sorted(view._repr_mimebundle_())
    ['application/vnd.plotly.v1+json', 'image/png', 'text/plain']
    """

    title: str = ""
    eye: tuple[float, float, float] = (-1.0, -1.0, 0.8)
    height: int = 460
    layers: list[dict] = field(default_factory=list)

    def points(self, P: Float[np.ndarray, "N 3"], name: str, colour=None, size: float = 2.0) -> "View":
        """Add points; colour: one for all (a name or #rrggbb), or uint8 (N, 3), an RGB colour per point."""
        self.layers.append({"kind": "points", "P": np.asarray(P), "name": name, "colour": colour, "size": size})
        return self

    def lines(self, ends: Num[np.ndarray, "N 2 3"], name: str, colour: str, width: float = 4.0) -> "View":
        """Add straight lines, each from its first to its second end."""
        self.layers.append({"kind": "lines", "P": np.asarray(ends), "name": name, "colour": colour, "width": width})
        return self

    def frame(self, T: Float[np.ndarray, "4 4"], name: str, length: float = 0.06) -> "View":
        """Add the axes of a frame, given its pose: x red, y green, z blue."""
        for axis, colour in enumerate(AXIS_COLOURS):
            ends = np.stack([T[:3, 3], T[:3, 3] + length * T[:3, axis]])
            self.lines(ends[None], f"{name} {'xyz'[axis]}", colour, 6.0)
        return self

    def boxes(self, corners: Num[np.ndarray, "N 8 3"], name: str, colour: str = JAW_COLOUR) -> "View":
        """Add boxes; bit b of a corner's number (0 to 7) says on which side of the box's axis b it lies."""
        self.layers.append({"kind": "boxes", "P": np.asarray(corners), "name": name, "colour": colour})
        return self

    def jaws(self, grasps, gripper, name: str = "jaws", colour: str = JAW_COLOUR) -> "View":
        """Add the fingers of grasps (labkit.grasp.Grasp), each opened as it says, down from the palm to the tips."""
        boxes = [fingers(grasp.T_base_grasp, grasp.width, gripper) for grasp in grasps]
        return self.boxes(np.concatenate(boxes), name, colour) if boxes else self

    # ------------------------------------------------------------------------------------------------- as HTML

    def plotly(self):
        """The view as a plotly figure."""
        import plotly.graph_objects as go

        figure = go.Figure()
        camera = self.camera()
        smaller = 1.5 / np.linalg.norm(camera)  # from further away a point has fewer pixels
        for layer in self.layers:
            P, name = layer["P"].astype(np.float32), layer["name"]
            if layer["kind"] == "points":
                marker = {"size": layer["size"] * smaller, "color": _colours(layer["colour"])}
                figure.add_scatter3d(x=P[:, 0], y=P[:, 1], z=P[:, 2], mode="markers", name=name, marker=marker)
            elif layer["kind"] == "lines":
                broken = np.concatenate([P, np.full((len(P), 1, 3), np.nan, np.float32)], axis=1).reshape(-1, 3)
                line = {"width": layer["width"], "color": layer["colour"]}
                figure.add_scatter3d(x=broken[:, 0], y=broken[:, 1], z=broken[:, 2], mode="lines", name=name, line=line)
            else:
                x, y, z = P.reshape(-1, 3).T
                i, j, k = (BOX + 8 * np.arange(len(P))[:, None, None]).reshape(-1, 3).T
                figure.add_mesh3d(
                    x=x, y=y, z=z, i=i, j=j, k=k, name=name, color=layer["colour"], flatshading=True, showlegend=True
                )
        x, y, z = camera
        figure.update_layout(
            title=self.title,
            height=self.height,
            margin={"l": 0, "r": 0, "t": 40 if self.title else 0, "b": 0},
            legend={"itemsizing": "constant", "x": 0.0, "y": 1.0},
            scene={
                "aspectmode": "data",
                "camera": {"eye": {"x": x, "y": y, "z": z}},
                **{f"{axis}axis": {"title": {"text": f"{axis} (m)"}} for axis in "xyz"},
            },
        )
        return figure

    def camera(self) -> Float[np.ndarray, "3"]:
        """Where plotly's camera stands so that it sees everything, in plotly's units: a box of volume 1 at the origin.

        Its field of view is 45 degrees from the lower to the upper edge; a page may leave it no more from side to side.
        """
        room = np.maximum(np.ptp(self.everything(), axis=0), 1e-3)
        signs = np.array(list(np.ndindex(2, 2, 2))) - 0.5
        corners = signs * room / np.cbrt(room.prod())
        towards = np.array(self.eye) / np.linalg.norm(self.eye)
        nearer = corners @ towards
        aside = np.linalg.norm(corners - nearer[:, None] * towards, axis=1)
        return 1.1 * (nearer + aside / np.tan(np.pi / 8)).max() * towards  # a tenth more for the axes' numbers

    def everything(self) -> Float[np.ndarray, "N 3"]:
        """All points, ends and corners of the view."""
        return np.concatenate([layer["P"].reshape(-1, 3) for layer in self.layers] or [np.zeros((1, 3))])

    def html(self, script: bool | str = True) -> str:
        """The view as a piece of HTML. script: True puts plotly itself into it (4.8 MB), False leaves it out."""
        import plotly.io

        return plotly.io.to_html(self.plotly(), include_plotlyjs=script, full_html=False, div_id=None)

    # ---------------------------------------------------------------------------------------------- as a picture

    def picture(self) -> Figure:
        """The view as a still picture, seen from the same side."""
        figure = Figure(figsize=(6.4, self.height / 80), dpi=80, layout="constrained")
        axes = figure.add_subplot(projection="3d")
        for layer in self.layers:
            P, name, colour = layer["P"], layer["name"], layer["colour"]
            if layer["kind"] == "points":
                c = np.asarray(colour) / 255.0 if isinstance(colour, np.ndarray) else colour
                axes.scatter(
                    *P.T, s=2 * layer["size"], c=c, label=name, depthshade=False, linewidths=0, rasterized=True
                )
            elif layer["kind"] == "lines":
                axes.add_collection3d(Line3DCollection(P, colors=colour, linewidths=layer["width"] / 2, label=name))
            else:
                faces = P[:, BOX].reshape(-1, 3, 3)
                axes.add_collection3d(Poly3DCollection(faces, facecolors=colour, edgecolors="none", label=name))
        everything = self.everything()
        low, high = everything.min(axis=0), everything.max(axis=0)
        room = np.maximum(high - low, 1e-3)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(room, zoom=0.9)
        x, y, z = self.eye
        axes.view_init(elev=np.degrees(np.arctan2(z, np.hypot(x, y))), azim=np.degrees(np.arctan2(y, x)))
        axes.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)", title=self.title)
        axes.locator_params(nbins=4)
        axes.tick_params(labelsize=7)
        if self.layers:
            axes.legend(fontsize=7, loc="upper left", markerscale=2)
        return figure

    def _repr_mimebundle_(self, include=None, exclude=None) -> dict:
        """What Jupyter shows: the figure to turn, and the picture for pages that run nothing."""
        png = io.BytesIO()
        self.picture().savefig(png, format="png")
        words = "a view to turn: " + ", ".join(dict.fromkeys(layer["name"] for layer in self.layers))
        return {PLOTLY: json.loads(self.plotly().to_json()), "image/png": png.getvalue(), "text/plain": words}


def _colours(colour):
    """What plotly takes: a colour, or one per point."""
    if isinstance(colour, np.ndarray):
        return [f"rgb({r},{g},{b})" for r, g, b in colour.tolist()]
    return colour
