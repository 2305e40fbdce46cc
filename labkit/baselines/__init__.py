"""The other stacks' ways to a mask, in Python: what the text's Java, MATLAB, Simulink and Mathematica listings are for.

threshold: HSV ranges (section 8). matlab: labels with scores, montage, cloud of a mask; blocks: a diagram that runs and
draws itself (section 9). regions: k-means, components, the choice of one; small_fcn: three layers (section 10).
"""
