"""A file for each command of `labkit`; `labcli.cli` gathers them."""
