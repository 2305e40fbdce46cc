"""Questions of topic 08: what a segmentation node does to messages."""
