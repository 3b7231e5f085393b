"""The shell: one file per command. Only here are there prints, progress bars and exit codes."""
