"""Questions of topic 09: blobs, buffers, labels and their size, colours and regions."""

RETIRED = ("measure_pieces",)  # no lab asks it any more; those that were released when one did are graded all the same
