"""Readers that use a library which trusts its file; they run in a child process."""
