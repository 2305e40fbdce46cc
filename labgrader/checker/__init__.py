"""What judges an answer to a blank and says why it is wrong; it knows no topic and nothing of the pipeline."""
