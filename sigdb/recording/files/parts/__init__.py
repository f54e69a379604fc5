"""Recordings in several files: the files of a folder or a ZIP archive, and how they are joined."""
