"""The same mask by other means (topic 09): other engines for the network, and other stacks' ways to a mask, in Python.

engines: a network as an ONNX file, in OpenCV or onnxruntime. threshold: HSV ranges. regions: k-means, components, the
choice of one. matlab: labels with scores, a montage. small_fcn: three layers.
"""
