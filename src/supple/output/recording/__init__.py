"""Recordings: written frame by frame, read without trust."""
