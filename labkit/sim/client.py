"""One PyBullet simulation as an object, so that several in one process never mix."""

import contextlib
import ctypes
import functools
import importlib.util
import inspect
import os

from labkit.support.validation import require


@contextlib.contextmanager
def silent(descriptor: int = 2):
    """Send what C code writes to stderr (or to 1, stdout) nowhere: PyBullet and its OpenGL greet every process."""
    kept, nowhere = os.dup(descriptor), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    try:
        yield
    finally:
        if descriptor == 1:
            ctypes.CDLL(None).fflush(None)  # else what C's printf has kept comes out later
        os.dup2(kept, descriptor)
        os.close(kept)
        os.close(nowhere)


with silent():
    import pybullet


class Client:
    """A simulation without a window; every function of pybullet is a method that acts on this simulation only.

    >>> client = Client()
    >>> client.getNumBodies()
    0
    >>> client.close()
    """

    def __init__(self):
        # pybullet_utils' BulletClient does the same but prints a line for every simulation.
        self.number, self.egl = pybullet.connect(pybullet.DIRECT), False
        if self.number < 0:
            raise RuntimeError("PyBullet could not start another simulation; close() the ones no longer needed")

    def __getattr__(self, name: str):
        function = getattr(pybullet, name)
        if not inspect.isbuiltin(function):
            return function
        require(name, self.number >= 0, "an open simulation", "one that close() has ended")
        bound = functools.partial(function, physicsClientId=self.number)
        setattr(self, name, bound)
        return bound

    def open_egl(self) -> None:
        """Render with OpenGL from now on; only what is loaded afterwards is seen. Raises ValueError without an EGL."""
        plugin = importlib.util.find_spec("eglRenderer")
        with silent(1), silent(2):
            opened = plugin is not None and self.loadPlugin(plugin.origin, "_eglRendererPlugin") >= 0
        require("renderer", opened, 'a machine with EGL for "egl"', "none (Debian: libegl1)")
        self.egl = True

    def quiet(self):
        """While entered, OpenGL's own messages go nowhere."""
        return silent(1) if self.egl else contextlib.nullcontext()

    def close(self) -> None:
        """End the simulation; harmless when already closed."""
        if self.number >= 0 and pybullet.isConnected(self.number):
            with self.quiet():
                pybullet.disconnect(self.number)
        self.__dict__.clear()  # methods bound to this simulation would act on the next one of the same number
        self.number, self.egl = -1, False
