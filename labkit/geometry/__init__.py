"""From pixels with depth to points in the robot's base frame, and what a cloud of points says (topic 06).

`projection` goes from pixels to points and back, and moves points between frames; `clouds` finds centroid, axes, plane,
outliers and separate objects; `tables` chooses the table among planes, and says what stands on it; `sensor` is what a
real camera makes of a depth image. Metres throughout. Every function checks what it is given: a ValueError names the
argument, what was expected and what came.
"""

from labkit.geometry.clouds import (
    Plane,
    PrincipalAxes,
    centroid_and_covariance,
    cluster_indices,
    fit_plane,
    inlier_indices,
    principal_axes,
)
from labkit.geometry.projection import (
    back_project,
    back_project_to_base,
    back_projection_jacobian,
    back_projection_noise,
    invert_transform,
    masked_cloud_to_base,
    nearest_rotation,
    pixel_rays,
    project,
    transform_points,
)
from labkit.geometry.tables import Table, base_on_table, find_tables
