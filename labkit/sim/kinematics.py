"""The Panda's geometry as numbers: its joints, limits and home, read off the URDF. Nothing here imports PyBullet."""

# Seven arm joints (rad), then two finger joints (m): folded back over the base, the hand pointing down, fingers open.
# From the front or the sides nothing of the arm stands between a camera and the workspace (x >= 0.35 m).
HOME = (0.0, -1.5, 0.0, -2.7, 0.0, 1.2, 0.7853981633974483, 0.04, 0.04)
PANDA_URDF = "franka_panda/panda.urdf"  # within pybullet_data
