"""Semantic segmentation for robotic manipulation: one RGB-D image becomes one grasp.

    RGBDFrame -> class probabilities -> labels -> target cloud in the base frame -> grasp -> lift

Each arrow is a module; `labkit.pipeline` puts them in a row.
"""

__version__ = "0.1.0"
