"""Training at scale: what makes weights for `labkit`, on one machine or several (topics 03 and 05)."""
