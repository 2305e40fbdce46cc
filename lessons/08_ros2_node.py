"""A node of ROS 2 in forty lines: an image comes in, its mask goes out. `labkit node ros` adds depth, poses, grasps.

Run it where there is ROS 2: python lessons/08_ros2_node.py --ros-args -r image:=/camera/color/image_raw
"""

from array import array

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image

from labkit.network import load_model, weights_path
from labkit.pipeline import segment_rgb_image


class MaskNode(Node):
    def __init__(self):
        super().__init__("mask_node")
        self.model = load_model(weights_path(self.declare_parameter("model", "unet").value))
        self.publisher = self.create_publisher(Image, "mask", 10)  # reliable: what is lost is sent again
        self.create_subscription(Image, "image", self.answer, qos_profile_sensor_data)  # best effort: lost is lost

    def answer(self, image: Image) -> None:
        whole = len(image.data) == image.height * image.step and image.step >= 3 * image.width
        if image.encoding not in ("rgb8", "bgr8") or not whole:
            self.get_logger().warning(f"skipped {image.encoding}, {len(image.data)} bytes: no whole rgb8 or bgr8")
            return
        rows = np.frombuffer(image.data, np.uint8).reshape(image.height, image.step)
        pixels = rows[:, : 3 * image.width].reshape(image.height, image.width, 3)
        labels = segment_rgb_image(self.model, pixels, order=image.encoding[:3])
        mask = Image(header=image.header, height=image.height, width=image.width, encoding="mono8", step=image.width)
        mask.data = array("B", labels.tobytes())  # the image's header: the mask is of the same moment and camera
        self.publisher.publish(mask)


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(MaskNode())
    except (KeyboardInterrupt, ExternalShutdownException):
        rclpy.try_shutdown()
