"""Message types that ROS 2 has and this machine has not: made from their names, for bytes that `Wire` reads and writes.

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
    package, _, kind = name.split("/")
    donor = getattr(ctypes.CDLL(DONOR), DONOR_HANDLE)
    donor.restype = ctypes.POINTER(_Handle)
    handle = _Handle.from_buffer_copy(donor().contents)
    callbacks = _Callbacks.from_buffer_copy(ctypes.cast(handle.data, ctypes.POINTER(_Callbacks)).contents)
    callbacks.namespace, callbacks.name = f"{package}::msg".encode(), kind.encode()
    digits = bytes.fromhex(checksum.removeprefix("RIHS01_"))
    hashed = _Hash(1, (ctypes.c_uint8 * 32)(*digits))
    give_hash = ctypes.CFUNCTYPE(POINTER, POINTER)(lambda _: ctypes.addressof(hashed))
    handle.data, handle.hash = ctypes.addressof(callbacks), ctypes.cast(give_hash, POINTER)
    support = CAPSULE(ctypes.addressof(handle), None, None)
    # rclpy uses the other four when a message is to be built, which never happens to bytes.
    names = ("_TYPE_SUPPORT", "_CREATE_ROS_MESSAGE", "_CONVERT_FROM_PY", "_CONVERT_TO_PY", "_DESTROY_ROS_MESSAGE")
    metaclass = type("Made", (type,), dict.fromkeys(names, support))  # where rclpy looks
    return metaclass(kind, (), {"kept": (handle, callbacks, hashed, give_hash)})
