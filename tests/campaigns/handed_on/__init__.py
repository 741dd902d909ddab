"""The demo's material in other engines: see `__main__`."""
