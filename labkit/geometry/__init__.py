"""From pixels with depth to points in the robot's base frame, and what a cloud of points says (topic 06).

`projection` goes from pixels to points and back, and moves points between frames; `clouds` finds centroid, axes, plane,
outliers and separate objects; `channels` is what a network sees of a depth image, `sensor` what a real camera makes of
it, and `augment` what training makes of both. Metres throughout. Every function checks what it is given: a ValueError
names the argument, what was expected and what came.
"""

from labkit.geometry.clouds import (
    Plane,
    PrincipalAxes,
    centroid_and_covariance,
    cluster,
    cluster_indices,
    fit_plane,
    inliers,
    principal_axes,
    remove_outliers,
)
from labkit.geometry.projection import (
    back_project,
    back_project_to_base,
    back_projection_jacobian,
    back_projection_noise,
    backproject_to_base,
    invert_transform,
    pixel_rays,
    project,
    transform_points,
)
