"""Record what Debian's cv_bridge writes and reads: `/usr/bin/python3 record_images.py > images.json`.

Without arguments it makes a few small images, one an encoding, and lets cv_bridge write them as messages; some then get
the other byte order. With `-` it takes messages from standard input. What cv_bridge reads in either case, in RGB or as
it is, is written beside each message. Runs under the system's Python, which has a NumPy that cv_bridge bears.

Rows are never padded here: Debian 12's cv_bridge does not look at `step`, and reads padding as pixels.
"""

import json
import sys

import numpy as np

TYPES = {"16UC1": np.uint16, "mono16": np.uint16, "32FC1": np.float32}
CHANNELS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1, "16UC1": 1, "32FC1": 1}


def write(bridge, encoding, rng) -> dict:
    """An image as cv_bridge writes it."""
    kind, channels = TYPES.get(encoding, np.uint8), CHANNELS[encoding]
    largest = {np.uint8: 250.0, np.uint16: 5000.0, np.float32: 3.0}[kind]
    array = (rng.random((3, 5) if channels == 1 else (3, 5, channels)) * largest).astype(kind)
    made = bridge.cv2_to_imgmsg(array, encoding)
    fields = {name: getattr(made, name) for name in ("height", "width", "encoding", "is_bigendian", "step")}
    return fields | {"data": bytes(made.data).hex()}


def swapped(m: dict) -> dict:
    """The same in the other byte order."""
    data = np.frombuffer(bytes.fromhex(m["data"]), np.dtype(TYPES[m["encoding"]])).byteswap()
    return m | {"is_bigendian": 1 - m["is_bigendian"], "data": data.tobytes().hex()}


def read(bridge, m: dict) -> dict:
    """A message with what cv_bridge reads in it."""
    from sensor_msgs.msg import Image

    raw = Image(**(m | {"data": bytes.fromhex(m["data"])}))
    wanted = "passthrough" if m["encoding"] in TYPES else "rgb8"
    return m | {"read": np.asarray(bridge.imgmsg_to_cv2(raw, wanted), float).tolist()}


def main() -> None:
    """Write the messages as JSON to standard output."""
    from cv_bridge import CvBridge

    bridge = CvBridge()
    if sys.argv[1:] == ["-"]:
        messages = json.load(sys.stdin)
    else:
        rng = np.random.default_rng(0)
        messages = [write(bridge, encoding, rng) for encoding in CHANNELS]
        messages += [swapped(m) for m in messages if m["encoding"] in TYPES]
    print(json.dumps([read(bridge, m) for m in messages]))


if __name__ == "__main__":
    main()
