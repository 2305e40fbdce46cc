"""The commands: `cli` names them, and each module here does the work of one; they alone may import data_gen."""
