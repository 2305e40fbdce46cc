"""Questions of topic 09: blobs, labels and their size (section 7 of the text); t09_regions has those on colours."""
