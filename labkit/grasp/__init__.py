"""From the target's cloud to a grasp (topic 07): `planner` looks for the best grasps of a parallel jaw, from above.

`surroundings_kernels` collects what is near a target and what the camera did not see there, `search_kernels` tries many
grips on maps of heights, `measure_kernels` looks closely at the best; numba compiles these.
"""

from labkit.grasp.planner import Grasp, GraspPlan, Gripper, plan_grasps, principal_axis_grasp, weighed
