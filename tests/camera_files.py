"""Files that say a camera as programs write them: of one camera of 640 x 480, each by its published format."""

import json

import numpy as np

K = [[600.0, 0.0, 320.0], [0.0, 601.0, 240.0], [0.0, 0.0, 1.0]]
FLAT = [600, 0, 320, 0, 601, 240, 0, 0, 1]
ROS2 = """header:
  stamp:
    sec: 1700000000
    nanosec: 5
  frame_id: camera_color_optical_frame
height: 480
width: 640
distortion_model: plumb_bob
d:
- 0.1
- -0.2
- 0.001
- 0.002
- 0.0
k:
- 600.0
- 0.0
- 320.0
- 0.0
- 601.0
- 240.0
- 0.0
- 0.0
- 1.0
r: [1, 0, 0, 0, 1, 0, 0, 0, 1]
p: [600, 0, 320, 0, 0, 601, 240, 0, 0, 0, 1, 0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  do_rectify: false
---
"""
ROS1 = """header:
  seq: 7
  frame_id: "camera"
height: 480
width: 640
distortion_model: "plumb_bob"
D: [0.1, -0.2, 0.001, 0.002, 0.0]
K: [600.0, 0.0, 320.0, 0.0, 601.0, 240.0, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [600.0, 0.0, 320.0, 0.0, 0.0, 601.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
---
"""
OPENCV_YAML = """%YAML:1.0
---
image_width: 640
image_height: 480
cameraMatrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 600., 0., 320., 0., 601., 240., 0., 0., 1. ]
distCoeffs: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 1.0e-01, -2.0e-01, 1.0e-03, 2.0e-03, 0. ]
"""
OPENCV_XML = """<?xml version="1.0"?>
<opencv_storage>
<image_Width>640</image_Width>
<cameraMatrix type_id="opencv-matrix">
  <rows>3</rows><cols>3</cols><dt>d</dt>
  <data>600. 0. 320. 0. 601. 240. 0. 0. 1.</data></cameraMatrix>
<distCoeffs type_id="opencv-matrix">
  <rows>5</rows><cols>1</cols><dt>d</dt>
  <data>1.0e-01 -2.0e-01 1.0e-03 2.0e-03 0.</data></distCoeffs>
</opencv_storage>
"""
KALIBR = """cam0:
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [0.1, -0.2, 0.001, 0.002]
  distortion_model: radtan
  intrinsics: [600.0, 601.0, 320.0, 240.0]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
"""
COLMAP = """# Camera list with one line of data per camera:
#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]
# Number of cameras: 1
1 OPENCV 640 480 600.0 601.0 320.5 240.5 0.1 -0.2 0.001 0.002
"""
NERF = {
    "w": 640,
    "h": 480,
    "fl_x": 600.0,
    "fl_y": 601.0,
    "cx": 320.5,
    "cy": 240.5,
    "k1": 0.1,
    "k2": -0.2,
    "p1": 0.001,
    "p2": 0.002,
    "camera_model": "OPENCV",
    "frames": [{"file_path": "images/a.png", "transform_matrix": np.eye(4).tolist()}],
}
POLYCAM = {"fx": 600.0, "fy": 601.0, "cx": 320.0, "cy": 240.0, "width": 640, "height": 480, "blur_score": 9.1}
POLYCAM |= {f"t_{row}{column}": float(row == column) for row in range(3) for column in range(4)}
ORB_SLAM = "%YAML:1.0\nCamera.fx: 600.0\nCamera.fy: 601.0\nCamera.cx: 320.0\nCamera.cy: 240.0\nCamera.k1: 0.1\n"
ORB_SLAM += "Camera.k2: -0.2\nCamera.p1: 0.001\nCamera.p2: 0.002\nCamera.width: 640\nCamera.height: 480\n"
ORB_SLAM += "DepthMapFactor: 5000.0\n"
REALSENSE = """ Intrinsic of "Color" / 640x480 / {YUYV/RGB8/BGR8/RGBA8/BGRA8/Y8/Y16}
  Width:      \t640
  Height:     \t480
  PPX:        \t320
  PPY:        \t240
  Fx:         \t600
  Fy:         \t601
  Distortion: \tBrown Conrady
  Coeffs:     \t0.1  \t-0.2  \t0.001  \t0.002  \t0
  FOV (deg):  \t56.14 x 43.53

"""
VIEWER = """Frame Info:
Type,Color
Format,RGB8
Frame Number,139
Timestamp (ms),1650000000.00
Resolution x,640
Resolution y,480
Bytes per pixel,3

Intrinsic:,
Fx,600.000000
Fy,601.000000
PPx,320.000000
PPy,240.000000
Distorsion,Inverse Brown Conrady
"""
PYREALSENSE = "[ 640x480  p[320 240]  f[600 601]  Brown Conrady [0.1 -0.2 0.001 0.002 0] ]\n"
LENS, SIZE = (0.1, -0.2, 0.001, 0.002), (640, 480)
PLAIN = {"fx": 600, "fy": 601, "cx": 320, "cy": 240}

FILES = {  # name of the file, its content, size, lens
    "ros2 topic echo": ("info.yaml", ROS2, SIZE, LENS),
    "rostopic echo": ("info.txt", ROS1, SIZE, LENS),
    "OpenCV, YAML": ("camera.yml", OPENCV_YAML, SIZE, LENS),
    "OpenCV, XML": ("camera.xml", OPENCV_XML, None, LENS),
    "OpenCV, JSON": (
        "opencv.json",
        json.dumps({"cameraMatrix": {"type_id": "opencv-matrix", "rows": 3, "cols": 3, "dt": "d", "data": FLAT}}),
        None,
        (),
    ),
    "Kalibr": ("camchain.yaml", KALIBR, SIZE, LENS),
    "COLMAP": ("cameras.txt", COLMAP, SIZE, LENS),
    "NeRF": ("transforms.json", json.dumps(NERF), SIZE, LENS),
    "Polycam": ("1700.json", json.dumps(POLYCAM), SIZE, ()),
    "Record3D": ("metadata", json.dumps({"K": [600, 0, 0, 0, 601, 0, 320, 240, 1], "w": 640, "h": 480}), SIZE, ()),
    "Stray Scanner": ("camera_matrix.csv", "600.0,0.0,320.0\n0.0,601.0,240.0\n0.0,0.0,1.0\n", None, ()),
    "rs-enumerate-devices -c": ("d455.txt", REALSENSE, SIZE, LENS),
    "realsense-viewer": ("1_Color_metadata.csv", VIEWER, SIZE, ()),
    "print of pyrealsense2": ("intrinsics.txt", PYREALSENSE, SIZE, LENS),
    "TUM's nine numbers": (
        "freiburg1.txt",
        "# fx fy cx cy d0 ...\n600 601 320 240 0.1 -0.2 0.001 0.002 0\n",
        None,
        LENS,
    ),
    "ORB-SLAM": ("TUM.yaml", ORB_SLAM, SIZE, LENS),
    "lists of lists": ("K.json", json.dumps({"K": K, "dist": LENS, "image_size": SIZE}), SIZE, LENS),
    "cam_K as three lists": ("bop.json", json.dumps({"cam_K": K, "depth_scale": 0.1}), None, ()),
    "within intrinsics": (
        "own.json",
        json.dumps({"intrinsics": PLAIN}),
        None,
        (),
    ),
    "lens beside intrinsics": (
        "azure.json",
        json.dumps({"intrinsics": PLAIN, "distortion": {"k1": 0.1, "k2": -0.2}}),
        None,
        (0.1, -0.2, 0, 0),
    ),
    "4x4": ("intrinsic_color.txt", "600 0 320 0\n0 601 240 0\n0 0 1 0\n0 0 0 1\n", None, ()),
    "NumPy's brackets": ("K.txt", "[[600.   0. 320.]\n [  0. 601. 240.]\n [  0.   0.   1.]]\n", None, ()),
    "a line with #": ("K2.txt", "# fx 0 cx 0 fy cy 0 0 1\n600 0 320\n0 601 240\n0 0 1\n", None, ()),
    "savetxt": ("K3.txt", "6.0e+02 0.0e+00 3.2e+02\n0 6.01e+02 2.4e+02\n0 0 1e0\n", None, ()),
}
