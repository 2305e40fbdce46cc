"""What has weights, or feeds what has: networks, their engines, training and its images (topics 03, 05 and 09)."""
