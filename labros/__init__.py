"""The edges of `labkit.node` on ROS 1, ROS 2 and their recordings (topic 08)."""
