"""The same mask by other means (topic 09): other engines for the network, and other stacks' ways to a mask, in Python.

engines: a network in PyTorch, OpenCV or onnxruntime. threshold: HSV ranges. matlab: labels with scores, a montage, the
cloud of a mask. blocks: a diagram that runs and draws itself. regions: k-means, components, the choice of one.
small_fcn: three layers.
"""
