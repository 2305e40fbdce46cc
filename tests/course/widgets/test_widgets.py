"""The explorers that all lessons share; those of one topic are tested in test_widgets_<topic>.py."""

import base64

import ipywidgets
import pytest

from labkit.course.widgets.explorer import Explorer


def explorer(seen):
    """An explorer that writes down what it is asked to draw."""

    def draw(figure, size, title):
        seen.append((size, title))
        figure.subplots().set_title(f"{title}{size}")

    controls = {"size": ipywidgets.IntSlider(2, min=0, max=9), "title": ipywidgets.Text("t"), "b": ipywidgets.Button()}
    return Explorer(draw, controls)


def test_a_change_of_any_control_draws_again():
    seen = []
    shown = explorer(seen)
    first = shown.png
    shown.controls["size"].value = 3
    shown.controls["title"].value = "u"
    assert seen == [(2, "t"), (3, "t"), (3, "u")]
    assert shown.png != first and shown.png.startswith(b"\x89PNG")


def test_where_widgets_do_not_run_the_picture_is_shown():
    shown = explorer([])
    bundle = shown._repr_mimebundle_()
    assert base64.b64decode(bundle["image/png"]) == shown.png
    assert "application/vnd.jupyter.widget-view+json" in bundle


def test_a_drawing_that_fails_says_so():
    def draw(figure, x):
        raise ValueError("x: too large")

    with pytest.raises(ValueError, match="x: too large"):
        Explorer(draw, {"x": ipywidgets.FloatSlider()})
