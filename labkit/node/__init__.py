"""The segmentation node (topic 08): images in, mask, target cloud and grasp out, over any transport.

From the inside out: `messages` (what travels), `convert` (messages to arrays and back), `sync` (which messages belong
together), `transforms` (where the camera stood when), `segmentation` (the node), `bus` (a transport in one process),
`actors` (a camera and an arm, the node's neighbours), `rehearsal` (all of these at once). Then the edges to the world:
`wire` (messages as ROS's bytes), `bags`, `ros1` and `ros2`, and `ros`, which runs the node on either.
"""
