"""Message types that ROS 2 has and this machine has not: made from their names, for the bytes of `RosCodec`.

A sourced ROS 2 has every package of messages; the wheels from PyPI lack tf2_msgs. rclpy asks a message class for its
"type support": a C structure that says what the type is called, and how a C message becomes bytes. The kit sends and
receives bytes, so the name and the checksum suffice, and the structure of any other type serves with these replaced.
That works with Fast DDS of Kilted, the middleware of the wheels. Jazzy's Fast DDS asks for a description of the fields
besides and refuses such a type: there tf2_msgs must be installed.
"""

import ctypes
import importlib
from functools import cache

POINTER = ctypes.c_void_p
CAPSULE = ctypes.pythonapi.PyCapsule_New
CAPSULE.restype, CAPSULE.argtypes = ctypes.py_object, (POINTER, ctypes.c_char_p, POINTER)
DONOR = "libgeometry_msgs__rosidl_typesupport_fastrtps_c.so"
DONOR_HANDLE = "rosidl_typesupport_fastrtps_c__get_message_type_support_handle__geometry_msgs__msg__TransformStamped"
# Where rclpy looks in a message class's own class; all but the first serve to build messages, which bytes never are.
LOOKED_UP = ("_TYPE_SUPPORT", "_CREATE_ROS_MESSAGE", "_CONVERT_FROM_PY", "_CONVERT_TO_PY", "_DESTROY_ROS_MESSAGE")


class _Handle(ctypes.Structure):
    """rosidl_message_type_support_t."""

    _fields_ = tuple((name, POINTER) for name in ("identifier", "data", "get", "hash", "description", "sources"))


class _Callbacks(ctypes.Structure):
    """message_type_support_callbacks_t of rosidl_typesupport_fastrtps_cpp: two names, then functions on C messages."""

    _fields_ = (("namespace", ctypes.c_char_p), ("name", ctypes.c_char_p), ("functions", POINTER * 5))


class _Hash(ctypes.Structure):
    """rosidl_type_hash_t."""

    _fields_ = (("version", ctypes.c_uint8), ("value", ctypes.c_uint8 * 32))


def reset_error() -> None:
    """Clear the note that Fast DDS found no description of a made type's fields; the next error would print it."""
    ctypes.CDLL("librcutils.so").rcutils_reset_error()


@cache
def message_class(name: str, checksum: str) -> type:
    """Give the class of a type such as "tf2_msgs/msg/TFMessage": the one that is installed, or else a made one.

    checksum: the type's hash as ROS 2 writes it, "RIHS01_" and 64 hexadecimal digits.
    """
    package, _, kind = name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), kind)
    except ModuleNotFoundError:
        return made_class(name, checksum)


def made_class(name: str, checksum: str) -> type:
    """Make the class of a type for `raw` subscriptions and for publishing bytes; arguments as in `message_class`."""
    support, alive = type_support(name, checksum)
    metaclass = type("Made", (type,), dict.fromkeys(LOOKED_UP, support))
    return metaclass(name.rpartition("/")[2], (), {"alive": alive})


def type_support(name: str, checksum: str) -> tuple[object, tuple]:
    """A type's support as rclpy takes it, in a capsule: the donor's, with another name and another hash.

    The second result is what the first points to: it must live as long.
    """
    package, _, kind = name.split("/")
    donor = getattr(ctypes.CDLL(DONOR), DONOR_HANDLE)
    donor.restype = ctypes.POINTER(_Handle)
    handle = _Handle.from_buffer_copy(donor().contents)

    callbacks = _Callbacks.from_buffer_copy(ctypes.cast(handle.data, ctypes.POINTER(_Callbacks)).contents)
    callbacks.namespace, callbacks.name = f"{package}::msg".encode(), kind.encode()
    handle.data = ctypes.addressof(callbacks)

    digits = bytes.fromhex(checksum.removeprefix("RIHS01_"))
    type_hash = _Hash(version=1, value=(ctypes.c_uint8 * 32)(*digits))
    give_hash = ctypes.CFUNCTYPE(POINTER, POINTER)(lambda _: ctypes.addressof(type_hash))
    handle.hash = ctypes.cast(give_hash, POINTER)

    return CAPSULE(ctypes.addressof(handle), None, None), (handle, callbacks, type_hash, give_hash)
