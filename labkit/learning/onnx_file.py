"""An ONNX file is checked before an engine runs it: OpenCV's gives other labels for a NaN, and dies of a short weight.

Its weights must be dense, whole and finite, all in the file itself, and its graph whole, with the inputs and outputs
that `labkit.learning.engines.export` writes.
"""

import math
from collections.abc import Iterator

import numpy as np

from labkit.support.validation import require


def check_onnx(file: bytes, inputs, outputs) -> None:
    """Raise a ValueError that says what is wrong with an ONNX file's bytes.

    inputs, outputs: the names that its graph must have. Arrays of weights are looked for in the whole graph: its
    initializers, its nodes' attributes, and graphs inside of these.
    """
    import onnx

    graph = parsed(file).graph
    for name, array in arrays_of(graph):
        _check_array(name, array, onnx)
    require("model", not _sparse(graph), "dense weights", "sparse ones")
    stated = {value.name for value in graph.initializer}
    for kind, expected, got in (
        ("inputs", inputs, [value.name for value in graph.input if value.name not in stated]),
        ("outputs", outputs, [value.name for value in graph.output]),
    ):
        require("model", sorted(got) == sorted(expected), f"the {kind} {', '.join(expected)}", ", ".join(got) or "none")
    try:
        onnx.checker.check_model(file)
    except Exception as error:  # ValidationError, and what protobuf raises
        said = (str(error).strip().splitlines() or [type(error).__name__])[0]
        raise ValueError(f"model: expected a whole network, got one in which {said}") from error


def parsed(file: bytes):
    """The network that an ONNX file's bytes hold; raises ValueError for others."""
    import onnx

    try:
        return onnx.load_model_from_string(file)
    except Exception as error:  # protobuf's own kind of error, and protobuf is not ours to import
        raise ValueError("model: expected an ONNX file, got one that is damaged or of another kind") from error


def arrays_of(graph) -> Iterator[tuple[str, object]]:
    """All dense arrays that a graph holds, each with a name."""
    yield from ((array.name, array) for array in graph.initializer)
    for node in graph.node:
        for attribute in node.attribute:
            name = f"{attribute.name} of {node.name or node.op_type}"
            held = [*attribute.tensors, *([attribute.t] if attribute.HasField("t") else [])]
            yield from ((name, array) for array in held)
            for inner in [*attribute.graphs, *([attribute.g] if attribute.HasField("g") else [])]:
                yield from arrays_of(inner)


def _sparse(graph) -> bool:
    attributes = [attribute for node in graph.node for attribute in node.attribute]
    return bool(graph.sparse_initializer) or any(a.HasField("sparse_tensor") or a.sparse_tensors for a in attributes)


def _check_array(name: str, array, onnx) -> None:
    outside = array.data_location == onnx.TensorProto.EXTERNAL or array.external_data
    mend = "save it as one file (onnx.save_model with save_as_external_data=False)"
    require("model", not outside, "one file that holds all weights", f"{name} in another file; {mend}")
    count = math.prod(array.dims)
    try:
        values = onnx.numpy_helper.to_array(array)
    except Exception:  # each way to hold numbers has its own
        values = None
    if values is None or values.shape != tuple(array.dims):
        raise ValueError(f"model: expected {count} numbers of {name}, {list(array.dims)}, got others: is it cut short?")
    if values.dtype.kind in "fcV":  # V: bfloat16 and shorter floats
        bad = count - np.count_nonzero(np.isfinite(values if values.dtype.kind != "V" else values.astype(np.float32)))
        require("model", not bad, "finite weights", f"{bad} NaN or infinite of {count} in {name}")
