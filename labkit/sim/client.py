"""One PyBullet simulation as an object, so that several in one process never mix."""

import contextlib
import functools
import inspect
import os


@contextlib.contextmanager
def silent_stderr():
    """Send what C code writes to stderr nowhere: PyBullet greets every process with the time it was built."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


with silent_stderr():
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
        self.number = pybullet.connect(pybullet.DIRECT)
        if self.number < 0:
            raise RuntimeError("PyBullet could not start another simulation; close() the ones no longer needed")

    def __getattr__(self, name: str):
        function = getattr(pybullet, name)
        if not inspect.isbuiltin(function):
            return function
        if self.number < 0:
            raise ValueError(f"{name}: expected an open simulation, got one that close() has ended")
        bound = functools.partial(function, physicsClientId=self.number)
        setattr(self, name, bound)
        return bound

    def close(self) -> None:
        """End the simulation; harmless when already closed."""
        if self.number >= 0 and pybullet.isConnected(self.number):
            pybullet.disconnect(self.number)
        self.__dict__.clear()  # methods bound to this simulation would act on the next one of the same number
        self.number = -1
