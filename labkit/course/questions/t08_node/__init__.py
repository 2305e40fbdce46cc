"""Questions of topic 08: what a segmentation node does to messages (sections 5 and 6 of the text)."""
