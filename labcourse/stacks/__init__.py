"""The same mask by other means (topic 09): other stacks' ways to it, and their listings, in Python.

threshold: HSV ranges. regions: k-means, components, the choice of one.
small_fcn: three layers. The same network in other engines: `labkit.learning.engines`.
"""
