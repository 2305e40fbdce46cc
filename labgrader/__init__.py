"""Judges an answer and finds its mistake, grades a class of untrusted notebooks, and releases labs from solutions."""
