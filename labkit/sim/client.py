"""One PyBullet simulation as an object, so that several in one process never mix."""

import functools
import inspect

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
        bound = functools.partial(function, physicsClientId=self.number)
        setattr(self, name, bound)
        return bound

    def close(self) -> None:
        """End the simulation; harmless when already closed."""
        if self.number >= 0 and pybullet.isConnected(self.number):
            pybullet.disconnect(self.number)
        self.number = -1
