"""The ``dynrt`` command line."""
