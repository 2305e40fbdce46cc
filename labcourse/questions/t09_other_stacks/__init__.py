"""Questions of topic 09: blobs, labels and their size, colours and regions."""
