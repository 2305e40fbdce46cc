"""What the other rooms lean on and no user imports: checks of arguments, files, processes, compiled loops."""
