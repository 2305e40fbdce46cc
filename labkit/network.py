"""The networks at their public address; the module is `labkit.learning.network` (topic 03)."""
