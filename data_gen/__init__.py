"""Random scenes, rendered and written as a dataset.

sample_scene(seed, config) draws a scene, render(spec, size) takes its picture, generate(out, seeds, ...) writes a
dataset, load(path) reads it. calm(spec) gives a scene quiet colours.
"""

from data_gen.dataset import Dataset, Joined, generate, load, render, verify
from data_gen.looks import calm
from data_gen.scenes import CONFIGS, sample_scene
from labkit.geometry.sensor import DepthSensor
