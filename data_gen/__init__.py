"""Random scenes, rendered and written as a dataset."""
